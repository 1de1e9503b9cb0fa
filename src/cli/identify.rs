//! `kincal identify`: parameters from a recording or a table.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use serde_json::Value;

use super::Outcome;
use super::arguments::{Global, IdentifyOptions};
use super::input;
use super::output::{self, Audience};
use crate::arm::Arm;
use crate::diagnosis::rows::check_robot;
use crate::diagnosis::settings::Model;
use crate::event::{self, Event, RealCell, Start};
use crate::identification::known::{Words, known};
use crate::identification::mistake::Said;
use crate::measurement::{Measurement, Role, table};
use crate::progress::Progress as _;
use crate::{recording, report, scene, session};

pub(crate) fn command(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    if input::is_recording(&options.input) { from_recording(global, options) } else { from_table(global, options) }
}

fn from_recording(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    input::no_robot(&options.robot)?;
    let (start, measurements) = input::recorded(global, &options.input, options.partial)?;
    if let Some(real) = start.real {
        let start = Start { real: Some(real.clone()), ..session::start_event("identify", &start.scene) };
        let nominal = session::real_robot(&start, &real).with_context(|| options.input.display().to_string())?;
        if real.zeros.is_empty() {
            // A table was looked at when it was read.
            let fitted: Vec<&Measurement> = measurements.iter().filter(|row| row.role == Role::Fit).collect();
            let sensor = session::real_sensor(&real, &measurements);
            check_robot(&nominal.0, &sensor, &fitted, &Model::default(), &Said::default())
                .with_context(|| options.input.display().to_string())?;
        }
        return real_cell(global, options, start, &real, nominal, measurements);
    }
    let of_real_arms = !options.fix.is_empty() || !options.free.is_empty() || !options.prior.is_empty();
    ensure!(!of_real_arms, "--fix, --free, --prior: they are for tables of real arms, not for those of a scene; leave them out");
    let file = scene::parse(&start.scene, &format!("{} (scene)", options.input.display()))?;
    let scene = &file.scene;
    let measurements = with_evaluation(measurements, options, &scene.arm)?;

    let stem = input::input_stem(&options.input, "-identified");
    let mut audience = Audience::open(global, &scene.arm, None, Some(&stem), &stem)?;
    session::start("identify", &file.public_toml()?, &mut audience)?;
    for measurement in &measurements {
        audience.report(&Event::Measured(measurement.clone()))?;
    }
    let identification = session::identify_and_tell(scene, &measurements, &mut audience)?;
    let recording = audience.finish()?;
    conclude(global, options, &scene.arm, None, &identification, recording.as_deref(), &stem)
}

fn from_table(global: &Global, options: &IdentifyOptions) -> anyhow::Result<Outcome> {
    let input::Front { start, real, arm, table, notes } =
        input::front("identify", &options.input, &options.robot, &Model::default())?;
    let unused: Vec<&str> =
        table.conditions.iter().map(String::as_str).filter(|name| !table::TO_IDENTIFY.contains(name)).collect();
    if !unused.is_empty() {
        output::note(global, &format!("note: an identification does not use {}", unused.join(", ")));
    }
    real_cell(global, options, start, &real, (arm, notes), table.measurements)
}

/// Identifies a real arm. `start` is the first event of the recording, `nominal` the arm and what is to be known of its file.
fn real_cell(
    global: &Global,
    options: &IdentifyOptions,
    start: Start,
    real: &RealCell,
    nominal: (Arm, Vec<String>),
    measurements: Vec<Measurement>,
) -> anyhow::Result<Outcome> {
    let joint_count = nominal.0.joint_count();
    input::check_joints(&options.input, &measurements, joint_count)?;
    let measurements = with_evaluation(measurements, options, &nominal.0)?;
    let words = Words { fix: &options.fix, free: &options.free, prior: &options.prior };
    let known = known(&nominal.0, words).map_err(anyhow::Error::msg)?;
    let mut nominal = nominal;
    let mut notes = real.notes.clone();
    for (option, names, meaning) in [
        ("--fix", &options.fix, "held as the file has it"),
        ("--free", &options.free, "free"),
        ("--prior", &options.prior, "one sigma beforehand"),
    ] {
        if !names.is_empty() {
            let note = format!("{meaning}, as {option} says: {}", names.join(", "));
            nominal.1.push(note.clone());
            notes.push(note);
        }
    }
    let real = &RealCell { only: options.only.map(Into::into), known, notes, ..real.clone() };
    let start = Start { real: Some(real.clone()), ..start };
    let own = real.urdf.clone();
    let real = session::real_arm(real, nominal, &measurements).with_context(|| options.input.display().to_string())?;

    let stem = input::input_stem(&options.input, "-identified");
    let mut audience = Audience::open(global, &real.arm, None, Some(&stem), &stem)?;
    audience.report(&Event::Start(start))?;
    for measurement in &measurements {
        audience.report(&Event::Measured(measurement.clone()))?;
    }
    let identification = session::identify_real(&real, &measurements, &mut audience)?;
    let recording = audience.finish()?;
    conclude(global, options, &real.arm, own.as_deref(), &identification, recording.as_deref(), &stem)
}

fn conclude(
    global: &Global,
    options: &IdentifyOptions,
    arm: &Arm,
    own: Option<&str>,
    identification: &crate::identification::outcome::Identification,
    recording: Option<&Path>,
    stem: &str,
) -> anyhow::Result<Outcome> {
    let path = global.out.join(format!("{stem}.urdf"));
    let path = output::write_calibrated(path, arm, own, options.with_frames, identification)?;
    output::show(global, &report::identification(identification))?;
    if options.parameters {
        if !identification.joint_frames.is_empty() {
            output::show(global, &report::joint_frames(identification))?;
        }
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

/// Adds the measurements of `--evaluate` as held-out ones.
fn with_evaluation(mut measurements: Vec<Measurement>, options: &IdentifyOptions, arm: &Arm) -> anyhow::Result<Vec<Measurement>> {
    let Some(other) = &options.evaluate else {
        return Ok(measurements);
    };
    let others = if input::is_recording(other) {
        let recording = recording::read::read(other)?;
        if let Some(cut) = recording.cut.filter(|_| !options.partial) {
            bail!("{cut}; --partial uses what is there");
        }
        event::measurements(&recording.events)
    } else {
        let mut table = input::read_table(other, arm, &options.robot)?;
        input::check_units(other, &table, arm)?;
        input::corrected(&mut table, arm, &options.robot)?;
        table.forget_angles();
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
    input::check_joints(other, &others, arm.joint_count())?;
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
