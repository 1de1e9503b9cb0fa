//! `kincal correct`: joint angles at which a calibrated robot reaches wanted poses.

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{CorrectOptions, Global};
use super::output;
use crate::arm::frames::Pose;
use crate::arm::inverse::reach;
use crate::arm::urdf;
use crate::measurement::table;
use crate::report;

pub(crate) fn command(global: &Global, options: &CorrectOptions) -> anyhow::Result<Outcome> {
    let imported = urdf::read(&options.robot, options.base_link.as_deref(), options.tip_link.as_deref())?;
    let arm = imported.arm;
    let hints = table::Hints { needs: table::Needs::Pose, ..super::input::hints(&arm, &options.layout)? };
    let table = table::read_as(&options.targets, &hints)?;
    table.notes.iter().for_each(|note| output::note(global, &format!("note: {note}")));
    let count = arm.joint_count();
    let given = table.joint_factor.len();
    ensure!(
        given == 0 || given == count,
        "{} has {given} joint columns, the robot has {count} joints: give all, from where each pose is to be looked for, or none",
        options.targets.display()
    );
    let chain = arm.chain.at_nominal();
    let mut last: Vec<f64> = arm.chain.joints.iter().map(|joint| 0.0_f64.clamp(joint.lower, joint.upper)).collect();
    let mut rows = table.measurements;
    let mut missed = Vec::new();
    for row in &mut rows {
        ensure!(
            row.unread == [false; 3] && row.fixed_point.is_none(),
            "{}: pose {} lacks a coordinate: a wanted pose needs x, y and z",
            options.targets.display(),
            row.index + 1
        );
        let start = if given == count { row.joints.clone() } else { last.clone() };
        let wanted = Pose::from_parts(row.position().into(), row.orientation().unwrap_or_default());
        let found = reach(&chain, &arm.chain.joints, &wanted, row.orientation_xyzw.is_some(), &start);
        if !found.is_there() {
            missed.push((row.pose_id, found.off));
        }
        last.clone_from(&found.joints);
        row.joints = found.joints;
    }
    let stem = super::input::input_stem(&options.targets, "-joints");
    let path = global.out.join(format!("{stem}.csv"));
    output::check_target(&path)?;
    output::write(&path, &table::write(&rows, &arm.slides()).context("writing the joints")?)?;
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
    output::show_json(global, &json!({ "written": path, "joints": joints, "not_reached": off }))?;
    Ok(if missed.is_empty() { Outcome::Good } else { Outcome::Bad })
}
