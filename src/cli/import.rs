//! `kincal import`: a table of measurements out of a bag of ROS 2.

use anyhow::{Context, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{Global, ImportOptions};
use super::{input, output};
use crate::arm::frames::Pose;
use crate::arm::{Arm, urdf};
use crate::identification::standing;
use crate::measurement::streams::Latency;
use crate::measurement::{Measurement, table};
use crate::recording::ros;
use crate::{report, scene};

/// Clocks that agree within this many standard errors agree.
const STANDARD_ERRORS: f64 = 3.0;
/// Share of what is left with clocks that agree, above which a shift is no improvement.
const WORTH_IT: f64 = 0.9;

pub(crate) fn command(global: &Global, options: &ImportOptions) -> anyhow::Result<Outcome> {
    let is_scene = options.robot.extension().is_some_and(|extension| extension == "toml");
    let arm = if is_scene {
        scene::read(&options.robot)?.scene.arm
    } else {
        urdf::read(&options.robot, options.base_link.as_deref(), options.tip_link.as_deref())?.arm
    };
    if let Some(said) = options.latency {
        ensure!(said.is_finite() && said.abs() <= 60.0, "--latency {said}: seconds are needed, from -60 to 60");
    }
    let bag = ros::read(&options.bag)?;
    if let Some(cut) = &bag.cut {
        output::note(global, &format!("note: {cut}"));
    }
    let names: Vec<String> = arm.chain.joints.iter().map(|joint| joint.name.clone()).collect();
    let picked = bag.pick(&options.bag, &names, options.joints.as_deref(), options.poses.as_deref())?;
    let found = picked.streams.latency(|joints, positions| left(&arm, joints, positions));
    let late =
        found.filter(|of| of.seconds.abs() > STANDARD_ERRORS * of.standard_error && of.left_m[1] < WORTH_IT * of.left_m[0]);
    let latency_s = options.latency.unwrap_or_else(|| late.map_or(0.0, |of| of.seconds));
    let rows = picked.streams.rows(latency_s, options.moving);
    ensure!(
        !rows.measurements.is_empty(),
        "{}: no pose on {} is within a quarter of a second of joint readings on {}: are their clocks the same? --latency shifts them",
        options.bag.display(),
        picked.poses,
        picked.joints
    );
    let path = global.out.join(format!("{}.csv", input::input_stem(&options.bag, "")));
    output::check_target(&path)?;
    output::write(&path, &table::write(&rows.measurements, &arm.slides()).context("writing the table")?)?;
    let said = vec![
        vec!["joints".to_owned(), format!("{} readings on {}", picked.streams.joints.len(), picked.joints)],
        vec!["poses".to_owned(), format!("{} on {}", picked.streams.poses.len(), picked.poses)],
        vec![
            "rows".to_owned(),
            format!(
                "{}, {}; {} poses are in none",
                rows.measurements.len(),
                if rows.still {
                    "one for each time that the arm stood still"
                } else {
                    "one for each pose; the arm may have moved"
                },
                rows.unused
            ),
        ],
        vec!["clocks".to_owned(), clocks(options.latency, found, late)],
    ];
    output::show(global, &report::table(&["", ""], said))?;
    output::show(global, &format!("Table       {}", path.display()))?;
    output::show_json(
        global,
        &json!({
            "written": path,
            "rows": rows.measurements.len(),
            "still": rows.still,
            "joints": picked.joints,
            "poses": picked.poses,
            "unused_poses": rows.unused,
            "latency_s": latency_s,
            "latency_found": found.map(|of| json!({
                "seconds": of.seconds, "standard_error": of.standard_error, "left_m": of.left_m, "taken": options.latency.is_none() && late.is_some(),
            })),
        }),
    )?;
    Ok(Outcome::Good)
}

fn clocks(said: Option<f64>, found: Option<Latency>, late: Option<Latency>) -> String {
    let of = |found: Latency| {
        format!(
            "{:.1} ms (standard error {:.1} ms) late against the joints: the nominal arm is then within {:.2} mm, else {:.2} mm",
            found.seconds * 1e3,
            found.standard_error * 1e3,
            found.left_m[1] * 1e3,
            found.left_m[0] * 1e3
        )
    };
    match (said, found, late) {
        (Some(said), None, _) => format!("poses {:.1} ms late, as --latency says", said * 1e3),
        (Some(said), Some(found), _) => format!("poses {:.1} ms late, as --latency says; they look {}", said * 1e3, of(found)),
        (None, _, Some(late)) => format!("poses are {}; taken out", of(late)),
        (None, Some(found), None) => {
            format!("agree: poses are {:.1} ms late (standard error {:.1} ms)", found.seconds * 1e3, found.standard_error * 1e3)
        }
        (None, None, None) => "not compared: too little was read while the arm moved".to_owned(),
    }
}

/// How far the nominal arm misses positions, base and target placed anew, m.
fn left(arm: &Arm, joints: &[Vec<f64>], positions: &[nalgebra::Vector3<f64>]) -> Option<f64> {
    let chain = arm.chain.at_nominal();
    let tools: Vec<Pose> = joints.iter().map(|joints| chain.forward(joints)).collect();
    let rows: Vec<Measurement> =
        positions.iter().map(|position| Measurement { position_m: (*position).into(), ..Measurement::default() }).collect();
    let rows: Vec<&Measurement> = rows.iter().collect();
    standing::stand(&tools, &rows, &vec![0; rows.len()], 1).map(|found| found.left_m)
}
