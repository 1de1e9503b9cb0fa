//! `kincal correct`: joint angles at which a calibrated robot reaches wanted poses.

use std::path::Path;

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{CorrectOptions, Global};
use super::{diagnose, input, output};
use crate::arm::frames::Pose;
use crate::arm::inverse::{Reached, reach};
use crate::arm::{Arm, urdf};
use crate::diagnosis::correction::{Correction, Wanted};
use crate::measurement::{Measurement, table};
use crate::report;

pub(crate) fn command(global: &Global, options: &CorrectOptions) -> anyhow::Result<Outcome> {
    match &options.measurements {
        Some(measurements) => with_effects(global, options, measurements),
        None => with_geometry(global, options),
    }
}

/// With the geometry of a calibrated robot alone.
fn with_geometry(global: &Global, options: &CorrectOptions) -> anyhow::Result<Outcome> {
    let of = &options.robot;
    let Some(robot) = &of.robot else {
        anyhow::bail!("--robot FILE is needed, a calibrated URDF; or --measurements FILE with the nominal one");
    };
    let of_tables = of.ticks_per_turn.is_some() || !of.gravity.is_empty() || !of.fix_columns.is_empty() || of.distances.is_some();
    ensure!(!of_tables, "--ticks-per-turn, --gravity, --fix-columns, --distances are about --measurements; leave them out");
    let arm = urdf::read(robot, of.base_link.as_deref(), of.tip_link.as_deref())?.arm;
    let mut rows = wanted(global, options, &arm)?;
    let chain = arm.chain.at_nominal();
    let found = in_turn(&mut rows, &arm, |row, _, start| {
        let pose = Pose::from_parts(row.position().into(), row.orientation().unwrap_or_default());
        reach(&chain, &arm.chain.joints, &pose, row.orientation_xyzw.is_some(), start)
    });
    conclude(global, options, &arm, &rows, &found, &[])
}

/// With the geometry that a diagnosis fits beside the effects that it names, and with these.
fn with_effects(global: &Global, options: &CorrectOptions, measurements: &Path) -> anyhow::Result<Outcome> {
    let subject = diagnose::subject(global, measurements, &options.robot, &[], false)?;
    let measured: Vec<&Measurement> = subject.measurements.iter().collect();
    let diagnosis = diagnose::diagnosed(&subject, &measured, measurements, Vec::new(), &[])?;
    let arm = diagnose::as_mounted(&subject, &diagnosis)?;
    let correction = Correction::new(&arm, &subject.sensor, &measured, &diagnosis, options.in_measurement_frame)
        .with_context(|| measurements.display().to_string())?;
    // Joints are told in the table's own count; the model has them with their zeros looked for.
    let zeros = subject.start.real.as_ref().map(|real| real.zeros.clone()).unwrap_or_default();
    let zero = |joint: usize| zeros.get(joint).copied().unwrap_or(0.0);
    let mut limits = arm.chain.joints.clone();
    for (number, joint) in limits.iter_mut().enumerate() {
        joint.lower += zero(number);
        joint.upper += zero(number);
    }
    let shifted = Arm { chain: crate::arm::Chain { joints: limits.clone(), ..arm.chain.clone() }, ..arm.clone() };
    let mut rows = wanted(global, options, &arm)?;
    for row in &mut rows {
        row.joints.iter_mut().enumerate().for_each(|(joint, value)| *value += zero(joint));
    }
    let last = measured.last().context("no measurements")?;
    let mut found = in_turn(&mut rows, &shifted, |row, before, start| {
        let pose = Pose::from_parts(row.position().into(), row.orientation().unwrap_or_default());
        let oriented = row.orientation_xyzw.is_some();
        let like = Measurement { joints: start.to_vec(), ..row.clone() };
        let before = before.unwrap_or(last);
        correction.reach(&Wanted { pose, oriented, like }, before, &limits)
    });
    for (row, found) in rows.iter_mut().zip(&mut found) {
        row.joints.iter_mut().enumerate().for_each(|(joint, value)| *value -= zero(joint));
        found.joints.clone_from(&row.joints);
    }
    let effects: Vec<String> = diagnosis
        .effects
        .iter()
        .map(|effect| match effect.location.index {
            Some(index) => format!("{} {index}", effect.kind.name()),
            None => effect.kind.name().to_owned(),
        })
        .collect();
    let said = if effects.is_empty() { "none".to_owned() } else { effects.join(", ") };
    output::show(global, &format!("Effects that count: {said}."))?;
    conclude(global, options, &arm, &rows, &found, &effects)
}

/// The wanted poses.
fn wanted(global: &Global, options: &CorrectOptions, arm: &Arm) -> anyhow::Result<Vec<Measurement>> {
    let driven = arm.chain.joints.iter().find(|joint| joint.mimic.is_some());
    ensure!(
        driven.is_none(),
        "joint `{}` is driven by another one, and joints that move together cannot be corrected: end the chain before it with --tip-link",
        driven.map_or("", |joint| &joint.name)
    );
    let hints = table::Hints { needs: table::Needs::Pose, ..input::hints(arm, &options.robot.layout)? };
    let mut table = table::read_as(&options.targets, &hints)?;
    table.notes.iter().for_each(|note| output::note(global, &format!("note: {note}")));
    let (given, count) = (table.joint_factor.len(), arm.joint_count());
    ensure!(
        given == 0 || given == count,
        "{} has {given} joint columns, the robot has {count} joints: give all, from where each pose is to be looked for, or none",
        options.targets.display()
    );
    for row in &mut table.measurements {
        ensure!(
            row.unread == [false; 3] && row.is_in_frame(),
            "{}: pose {} lacks a coordinate: a wanted pose needs x, y and z",
            options.targets.display(),
            row.index + 1
        );
        if given == 0 {
            row.joints.clear();
        }
    }
    Ok(table.measurements)
}

/// Reaches one pose after the other, each looked for from where its row says, else from the one before; its joints are then those found.
fn in_turn(
    rows: &mut [Measurement],
    arm: &Arm,
    mut reach: impl FnMut(&Measurement, Option<&Measurement>, &[f64]) -> Reached,
) -> Vec<Reached> {
    let mut last: Vec<f64> = arm.chain.joints.iter().map(|joint| 0.0_f64.clamp(joint.lower, joint.upper)).collect();
    let mut found: Vec<Reached> = Vec::new();
    for at in 0..rows.len() {
        let (before, now) = rows.split_at(at);
        let row = &now[0];
        let start = if row.joints.is_empty() { last.clone() } else { row.joints.clone() };
        let one = reach(row, before.last(), &start);
        last.clone_from(&one.joints);
        rows[at].joints.clone_from(&one.joints);
        found.push(one);
    }
    found
}

fn conclude(
    global: &Global,
    options: &CorrectOptions,
    arm: &Arm,
    rows: &[Measurement],
    found: &[Reached],
    effects: &[String],
) -> anyhow::Result<Outcome> {
    let stem = input::input_stem(&options.targets, "-joints");
    let path = global.out.join(format!("{stem}.csv"));
    output::check_target(&path)?;
    output::write(&path, &table::write(rows, &arm.slides()).context("writing the joints")?)?;
    let missed: Vec<(usize, [f64; 2])> =
        rows.iter().zip(found).filter(|(_, found)| !found.is_there()).map(|(row, found)| (row.pose_id, found.off)).collect();
    let off_by = missed
        .iter()
        .map(|(pose, [position, turn])| {
            vec![pose.to_string(), format!("{:.3}", position * 1e3), format!("{:.4}", turn.to_degrees())]
        })
        .collect();
    let reached = rows.len() - missed.len();
    output::show(global, &format!("{reached} of {} poses are reached within the joints' limits.", rows.len()))?;
    if !missed.is_empty() {
        output::show(global, &report::table(&["pose that is not reached", "off by (mm)", "(°)"], off_by))?;
    }
    output::show(global, &format!("Joints      {}", path.display()))?;
    let joints: Vec<&Vec<f64>> = rows.iter().map(|row| &row.joints).collect();
    let off: Vec<serde_json::Value> = missed
        .iter()
        .map(|(pose, [position, turn])| json!({ "pose_id": pose, "position_m": position, "rotation_rad": turn }))
        .collect();
    output::show_json(global, &json!({ "written": path, "joints": joints, "not_reached": off, "effects": effects }))?;
    Ok(if missed.is_empty() { Outcome::Good } else { Outcome::Bad })
}
