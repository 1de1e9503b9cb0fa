//! `kincal diagnose`: what causes what a calibration leaves.

use std::path::Path;

use anyhow::{Context, bail, ensure};

use super::Outcome;
use super::arguments::{DiagnoseOptions, Global, RobotOptions};
use super::output::Audience;
use super::{input, output};
use crate::arm::Arm;
use crate::diagnosis::gravity::Gravity;
use crate::diagnosis::outcome::{Diagnosis, NoiseSource, Verdict};
use crate::diagnosis::settings::Settings;
use crate::diagnosis::{self, Options};
use crate::effects::Kind;
use crate::event::{Event, Start};
use crate::lab::confirm::{Answer, confirm};
use crate::measurement::{Measurement, Sensor};
use crate::progress::Progress as _;
use crate::{lab, report, scene, session};

pub(crate) fn command(global: &Global, options: &DiagnoseOptions) -> anyhow::Result<Outcome> {
    let mut without = Vec::new();
    for name in &options.without {
        let Some(kind) = Kind::known_from_name(name) else {
            let known: Vec<&str> = Kind::known().map(Kind::name).collect();
            bail!("--without {name}: no such kind; known are {}", known.join(", "));
        };
        without.push(kind);
    }
    let subject = subject(global, &options.input, &options.robot, &options.set, options.partial)?;
    let rows: Vec<&Measurement> = subject.measurements.iter().collect();
    let diagnosis = diagnosed(&subject, &rows, &options.input, without, &options.set)?;
    show(global, options, &subject, &diagnosis)?;
    let confirmation = if options.confirm {
        let arm = as_mounted(&subject, &diagnosis)?;
        let confirmation = confirm(&diagnosis, &arm, &subject.sensor, &rows);
        Some(confirmation.with_context(|| options.input.display().to_string())?)
    } else {
        None
    };
    let mut json = serde_json::to_value(&diagnosis)?;
    output::show(global, &report::diagnosis::text(&diagnosis))?;
    if let Some(confirmation) = &confirmation {
        output::show(global, &lab::report::confirm::text(confirmation))?;
        json["confirmation"] = serde_json::to_value(confirmation)?;
    }
    output::show_json(global, &json)?;
    if confirmation.is_some_and(|confirmation| confirmation.verdict == Answer::Disagrees) {
        return Ok(Outcome::Bad);
    }
    // A gap that nobody can explain is a bad answer; that nothing could be seen is none at all.
    Ok(match diagnosis.verdict {
        Verdict::NoGap | Verdict::Explained => Outcome::Good,
        Verdict::Ambiguous | Verdict::UnknownRemains | Verdict::NotDetectable => Outcome::Bad,
    })
}

/// The diagnosis of `subject`, whose measurements are `rows`, without these kinds.
pub(super) fn diagnosed(
    subject: &Subject,
    rows: &[&Measurement],
    path: &Path,
    without: Vec<Kind>,
    set: &[String],
) -> anyhow::Result<Diagnosis> {
    let settings = settings(&subject.settings, set)?;
    // A scene says how its arm stands; a URDF does not.
    let is_urdf = subject.start.real.as_ref().is_some_and(|real| real.urdf.is_some());
    let gravity = if is_urdf { Gravity::Assumed } else { Gravity::Known };
    let options = Options { without, settings, gravity, ..Options::new(subject.noise) };
    let conclusion =
        diagnosis::diagnose(&subject.arm, &subject.sensor, rows, &options).with_context(|| path.display().to_string())?;
    let mut diagnosis = report::wording::diagnosis(conclusion);
    diagnosis.notes.extend(subject.notes.iter().cloned());
    Ok(diagnosis)
}

/// The arm under gravity as the diagnosis has it.
pub(super) fn as_mounted(subject: &Subject, diagnosis: &Diagnosis) -> anyhow::Result<Arm> {
    let of_rows = |row: &Measurement| row.gravity_m_s2;
    let first = subject.measurements.first().and_then(of_rows);
    ensure!(
        subject.measurements.iter().all(|row| of_rows(row) == first),
        "an arm under one gravity is needed for what its effects do elsewhere (--confirm, correct), and the rows have several: give the rows of one of them"
    );
    let gravity = diagnosis.gravity_m_s2.or(first);
    let mut arm = subject.arm.clone();
    arm.gravity_in_base = gravity.map_or(arm.gravity_in_base, Into::into);
    Ok(arm)
}

/// Shows readings and diagnosis in the viewer; nothing is recorded.
fn show(global: &Global, options: &DiagnoseOptions, subject: &Subject, diagnosis: &Diagnosis) -> anyhow::Result<()> {
    // A real arm stands somewhere in the measurement frame; where that cannot be fitted, it is drawn at its origin.
    let placed = subject.start.real.as_ref().and_then(|real| {
        session::real_arm(real, (subject.arm.clone(), Vec::new()), &subject.measurements).map(|real| real.arm).ok()
    });
    let stem = input::input_stem(&options.input, "-diagnosed");
    let mut audience = Audience::open(global, placed.as_ref().unwrap_or(&subject.arm), None, None, &stem)?;
    audience.report(&Event::Start(subject.start.clone()))?;
    for measurement in &subject.measurements {
        audience.report(&Event::Measured(measurement.clone()))?;
    }
    audience.report(&Event::Diagnosed(Box::new(diagnosis.clone())))?;
    audience.finish()?;
    Ok(())
}

/// The settings of what is diagnosed with the changes of the command line.
fn settings(usual: &Settings, changes: &[String]) -> anyhow::Result<Settings> {
    let mut settings = usual.clone();
    for change in changes {
        let (key, value) = change
            .split_once('=')
            .with_context(|| format!("--set {change}: KEY=VALUE is needed, such as diagnosis.decision.named=0.7"))?;
        settings = settings.with(key.trim(), value.trim()).map_err(|wrong| anyhow::anyhow!("--set {change}: {wrong}"))?;
    }
    Ok(settings)
}

/// What is diagnosed.
pub(super) struct Subject {
    /// What a recording of it would begin with.
    pub(super) start: Start,
    pub(super) arm: Arm,
    pub(super) sensor: Sensor,
    noise: NoiseSource,
    settings: Settings,
    pub(super) measurements: Vec<Measurement>,
    pub(super) notes: Vec<String>,
}

/// Reads `path`, a recording or a table of the robot of `robot`; `set`: changes of settings.
pub(super) fn subject(
    global: &Global,
    path: &Path,
    robot: &RobotOptions,
    set: &[String],
    partial: bool,
) -> anyhow::Result<Subject> {
    if input::is_recording(path) {
        input::no_robot(robot)?;
        let (recorded, measurements) = input::recorded(global, path, partial)?;
        let start = Start { real: recorded.real, ..session::start_event("diagnose", &recorded.scene) };
        return match &start.real {
            Some(real) => {
                let (arm, notes) = session::real_robot(&start, real).with_context(|| path.display().to_string())?;
                let sensor = session::real_sensor(real, &measurements);
                Ok(Subject {
                    start,
                    arm,
                    sensor,
                    noise: NoiseSource::Declared,
                    settings: Settings::default(),
                    measurements,
                    notes,
                })
            }
            None => {
                let scene = scene::parse(&start.scene, &format!("{} (scene)", path.display()))?.scene;
                let noise = NoiseSource::Declared;
                Ok(Subject {
                    start,
                    arm: scene.arm,
                    sensor: scene.sensor,
                    noise,
                    settings: scene.diagnosis,
                    measurements,
                    notes: scene.urdf_notes,
                })
            }
        };
    }
    let input::Front { start, real, arm, mut table, mut notes } =
        input::front("diagnose", path, robot, &settings(&Settings::default(), set)?.model)?;
    // An effect is looked for about joints as they stand.
    for row in &mut table.measurements {
        row.joints.iter_mut().zip(&real.zeros).for_each(|(value, zero)| *value += zero);
    }
    let noise = if robot.position_noise_um.is_some() { NoiseSource::Declared } else { NoiseSource::Assumed };
    let sensor = session::real_sensor(&real, &table.measurements);
    if table.fill_in_approach() {
        notes.push(
            "no columns of approach: rows are taken to be in the order of measuring, and each joint to come straight from where the row \
             before has it. Where it came from a side of the plan's choice, write approach1 …; where rows have no order, write `# order: \
             unknown` under the header"
                .to_owned(),
        );
    }
    Ok(Subject { start, arm, sensor, noise, settings: Settings::default(), measurements: table.measurements, notes })
}
