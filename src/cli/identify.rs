//! `kincal identify`: parameters from a recording or a table.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use serde_json::Value;

use super::Outcome;
use super::arguments::{Global, IdentifyOptions};
use super::output::{self, Audience};
use crate::arm::Arm;
use crate::kinematics::{JointKind, urdf};
use crate::measurement::{Measurement, Role, table};
use crate::recording::event::{Event, Listener, RealCell, Start};
use crate::{recording, report, scene, session};

pub(crate) fn command(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    if is_recording(&options.input) { from_recording(global, options) } else { from_table(global, options) }
}

fn from_recording(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    no_links(options, "a recording carries its own nominal arm; leave it out")?;
    ensure!(
        options.robot.is_none(),
        "--robot {}: a recording carries its own nominal arm; give --robot with a table (.csv) only",
        options.robot.as_deref().unwrap_or(Path::new("")).display()
    );
    let (start, measurements) = recorded(global, &options.input, options.partial)?;
    if let Some(real) = start.real {
        let start = Start { real: Some(real.clone()), ..session::start_event("identify", &start.scene) };
        return real_cell(global, options, start, &real, &options.input, measurements);
    }
    let file = scene::parse(&start.scene, &format!("{} (scene)", options.input.display()))?;
    let scene = &file.scene;
    let measurements = with_evaluation(measurements, options, &scene.arm)?;

    let stem = input_stem(&options.input, "-identified");
    let mut audience = Audience::open(global, &scene.arm, None, Some(&stem), &stem)?;
    session::start("identify", &file.public_toml()?, &mut audience)?;
    for measurement in &measurements {
        audience.take(&Event::Measured(measurement.clone()))?;
    }
    let identification = session::identify_and_tell(scene, &measurements, &mut audience)?;
    let recording = audience.finish()?;
    conclude(global, options, &scene.arm, &identification, recording.as_deref(), &stem)
}

fn from_table(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    let Some(robot) = &options.robot else {
        bail!("{} is a table: give its nominal robot with --robot FILE (a URDF or a scene)", options.input.display());
    };
    if robot.extension().is_some_and(|extension| extension == "toml") {
        no_links(options, "the arm of a scene is taken whole; leave it out or give a URDF")?;
    }
    for (name, value) in
        [("--position-noise-um", options.position_noise_um), ("--attitude-noise-deg", options.attitude_noise_deg)]
    {
        ensure!((1e-6..=1e6).contains(&value), "{name} {value}: a positive number is needed, from 0.000001 to 1000000");
    }
    let (start, real) = described(robot, options)?;
    let table = table::read(&options.input)?;
    if !table.conditions.is_empty() {
        output::note(global, &format!("note: an identification does not use {}", table.conditions.join(", ")));
    }
    let (nominal, _) = session::real_robot(&start, &real).with_context(|| robot.display().to_string())?;
    check_units(&options.input, &table, &nominal)?;
    real_cell(global, options, start, &real, robot, table.measurements)
}

/// Identifies a real arm. `start` is the first event of the recording, `robot` the file that the nominal arm comes from.
fn real_cell(
    global: &Global,
    options: &IdentifyOptions,
    start: Start,
    real: &RealCell,
    robot: &Path,
    measurements: Vec<Measurement>,
) -> anyhow::Result<Outcome> {
    let nominal = session::real_robot(&start, real).with_context(|| robot.display().to_string())?;
    let joint_count = nominal.0.joint_count();
    check_joints(&options.input, &measurements, joint_count)?;
    let measurements = with_evaluation(measurements, options, &nominal.0)?;
    let real = session::real_arm(real, nominal, &measurements).with_context(|| options.input.display().to_string())?;

    let stem = input_stem(&options.input, "-identified");
    let mut audience = Audience::open(global, &real.arm, None, Some(&stem), &stem)?;
    audience.take(&Event::Start(start))?;
    for measurement in &measurements {
        audience.take(&Event::Measured(measurement.clone()))?;
    }
    let identification = session::identify_real(&real, &measurements, &mut audience)?;
    let recording = audience.finish()?;
    conclude(global, options, &real.arm, &identification, recording.as_deref(), &stem)
}

/// The first event of a table's recording: the robot as its file stands, and the sensor as declared.
fn described(robot: &Path, options: &IdentifyOptions) -> anyhow::Result<(Start, RealCell)> {
    let is_scene = robot.extension().is_some_and(|extension| extension == "toml");
    let scene = if is_scene { scene::read(robot)?.public_toml()? } else { String::new() };
    let urdf = if is_scene {
        None
    } else {
        // Read as a file first: its errors name lines.
        urdf::read(robot, options.base_link.as_deref(), options.tip_link.as_deref())?;
        Some(std::fs::read_to_string(robot).with_context(|| robot.display().to_string())?)
    };
    let real = RealCell {
        urdf,
        base_link: options.base_link.clone(),
        tip_link: options.tip_link.clone(),
        position_sigma_m: options.position_noise_um * 1e-6,
        attitude_sigma_rad: options.attitude_noise_deg.to_radians(),
    };
    Ok((Start { real: Some(real.clone()), ..session::start_event("identify", &scene) }, real))
}

fn conclude(
    global: &Global,
    options: &IdentifyOptions,
    arm: &Arm,
    identification: &crate::identification::outcome::Identification,
    recording: Option<&Path>,
    stem: &str,
) -> anyhow::Result<Outcome> {
    let path = output::write_calibrated(global.out.join(format!("{stem}.urdf")), arm, identification)?;
    output::show(global, &report::identification(identification))?;
    if options.parameters {
        output::show(global, &report::combinations(identification))?;
    }
    if let Some(recording) = recording {
        output::show(global, &format!("Recording   {}", recording.display()))?;
    }
    output::show(global, &format!("Calibrated  {}", output::written(path.as_deref())))?;
    let mut object = serde_json::to_value(identification)?;
    if let Value::Object(map) = &mut object {
        map.insert("recording".to_owned(), serde_json::to_value(recording)?);
        map.insert("calibrated_urdf".to_owned(), serde_json::to_value(&path)?);
    }
    output::show_json(global, &object)?;
    Ok(output::judged(identification))
}

/// The first event and the measurements of a recording.
fn recorded(global: &Global, path: &Path, partial: bool) -> anyhow::Result<(Start, Vec<Measurement>)> {
    let recording = recording::read::read(path)?;
    if let Some(cut) = &recording.cut {
        if !partial {
            bail!("{cut}; --partial uses what is there");
        }
        output::note(global, &format!("note: {cut}"));
    }
    if let Some(warning) = &recording.version_warning {
        output::note(global, &format!("note: {warning}"));
    }
    let measurements: Vec<Measurement> = recording
        .events
        .into_iter()
        .filter_map(|event| match event {
            Event::Measured(measurement) => Some(measurement),
            _ => None,
        })
        .collect();
    ensure!(
        !measurements.is_empty(),
        "{} holds no measurements; make some with `kincal measure` or `kincal run`",
        path.display()
    );
    Ok((recording.start, measurements))
}

/// Adds the measurements of `--evaluate` as held-out ones.
fn with_evaluation(mut measurements: Vec<Measurement>, options: &IdentifyOptions, arm: &Arm) -> anyhow::Result<Vec<Measurement>> {
    let Some(other) = &options.evaluate else {
        return Ok(measurements);
    };
    let others = if is_recording(other) {
        let recording = recording::read::read(other)?;
        if let Some(cut) = recording.cut.filter(|_| !options.partial) {
            bail!("{cut}; --partial uses what is there");
        }
        let measured = recording.events.into_iter().filter_map(|event| match event {
            Event::Measured(measurement) => Some(measurement),
            _ => None,
        });
        measured.collect()
    } else {
        let table = table::read(other)?;
        check_units(other, &table, arm)?;
        table.measurements
    };
    ensure!(!others.is_empty(), "{} holds no measurements", other.display());
    let fitted = |row: &Measurement| {
        let mut fit = measurements.iter().filter(|known| known.role == Role::Fit);
        fit.any(|known| known.joints == row.joints && known.position_m == row.position_m)
    };
    let known = others.iter().filter(|row| fitted(row)).count();
    ensure!(
        known == 0,
        "{}: {known} of its {} measurements are among those that are fitted, and can show no held-out error; give other measurements",
        other.display(),
        others.len()
    );
    check_joints(other, &others, arm.joint_count())?;
    // What is evaluated is only the other file: its rows are held out whatever they were for.
    measurements.retain(|measurement| measurement.role == Role::Fit);
    let (first_index, first_id) = (measurements.len(), measurements.iter().map(|row| row.pose_id + 1).max().unwrap_or(0));
    for (index, row) in measurements.iter_mut().enumerate() {
        row.index = index;
    }
    let last_time = measurements.last().map_or(0.0, |row| row.time_s);
    measurements.extend(others.into_iter().enumerate().map(|(index, row)| Measurement {
        index: first_index + index,
        pose_id: first_id + row.pose_id,
        role: Role::HeldOut,
        time_s: last_time + row.time_s,
        ..row
    }));
    Ok(measurements)
}

/// Refuses lengths for joints that turn and angles for joints that slide.
fn check_units(path: &Path, table: &table::Table, arm: &Arm) -> anyhow::Result<()> {
    for (number, (is_length, joint)) in table.joint_is_length.iter().zip(&arm.chain.joints).enumerate() {
        let slides = joint.kind == JointKind::Prismatic;
        let (verb, units) = if slides { ("slides", "_m or _mm") } else { ("turns", "_rad or _deg") };
        ensure!(
            *is_length == slides,
            "{}: column q{} has the unit of {}, but joint `{}` of the robot {verb}: its column must end in {units}",
            path.display(),
            number + 1,
            if *is_length { "a length" } else { "an angle" },
            joint.name
        );
    }
    Ok(())
}

fn check_joints(path: &Path, measurements: &[Measurement], joint_count: usize) -> anyhow::Result<()> {
    let found = measurements.iter().map(|row| row.joints.len()).find(|found| *found != joint_count).unwrap_or(joint_count);
    ensure!(
        found == joint_count,
        "{} has {found} joint columns, the robot has {joint_count} joints: is it the right robot, and are its links from --base-link \
         to --tip-link?",
        path.display()
    );
    Ok(())
}

/// Refuses `--base-link` and `--tip-link` where they would do nothing.
fn no_links(options: &IdentifyOptions, why: &str) -> anyhow::Result<()> {
    for (name, link) in [("--base-link", &options.base_link), ("--tip-link", &options.tip_link)] {
        ensure!(link.is_none(), "{name} {}: {why}", link.as_deref().unwrap_or_default());
    }
    Ok(())
}

pub(crate) fn is_recording(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "mcap")
}

pub(crate) fn input_stem(path: &Path, suffix: &str) -> String {
    let stem = path.file_stem().map_or_else(|| "input".to_owned(), |stem| stem.to_string_lossy().into_owned());
    format!("{stem}{suffix}")
}
