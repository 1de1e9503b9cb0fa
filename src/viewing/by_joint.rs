//! What is left of the error, joint by joint: how far the end point was measured from where it is predicted, along the way on which the
//! joint would move it, over that joint's coordinate. Play, ripple and lost motion of a joint show as a shape in its panel.

use nalgebra::Vector3;
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::Radius;
use rerun::{RecordingStream, RecordingStreamResult};

use super::summary::significant;
use crate::arm::Arm;
use crate::arm::JointKind;
use crate::identification::outcome::Residual;
use crate::measurement::Measurement;

/// Size of a panel, and from one to the next.
const WIDTH: f64 = 60.0;
const HEIGHT: f64 = 32.0;
const STEP: [f64; 2] = [WIDTH + 10.0, HEIGHT + 16.0];
const COLUMNS: usize = 4;
const GRID: [u8; 3] = [70, 74, 82];
const TEXT: [u8; 3] = [190, 194, 202];
/// Where the joint came from: from above, not known or no move, from below.
const APPROACHES: [(&str, [u8; 3]); 3] =
    [("came_down", [110, 170, 230]), ("no_move", [170, 180, 120]), ("came_up", [255, 184, 56])];
/// An end point nearer to the joint's axis than this share of the longest lever tells nothing of its joint.
const SHORTEST: f64 = 0.05;

/// x and y ranges of the whole drawing for an arm of `joints` joints.
pub(super) fn bounds(joints: usize) -> [[f64; 2]; 2] {
    let (columns, rows) = (joints.clamp(1, COLUMNS), joints.max(1).div_ceil(COLUMNS));
    [[-8.0, STEP[0] * columns as f64], [-14.0, STEP[1] * rows as f64 - 4.0]]
}

/// The part of a residual that one joint could have made.
struct Part {
    /// Joint coordinate, rad or m.
    at: f64,
    /// m, positive where the joint's coordinate grows.
    by: f64,
    /// Index into [`APPROACHES`].
    approach: usize,
}

/// The parts of the residuals (of the identified model) along the way of each joint.
fn parts(arm: &Arm, measurements: &[Measurement], residuals: &[Residual]) -> Vec<Vec<Part>> {
    let at = arm.chain.at_nominal();
    let mut parts: Vec<Vec<Part>> = (0..arm.joint_count()).map(|_| Vec::new()).collect();
    let rows: Vec<(&Measurement, &Residual)> = residuals
        .iter()
        .filter_map(|residual| Some((measurements.iter().find(|measurement| measurement.index == residual.index)?, residual)))
        .collect();
    // How each joint would move the end point, per rad or m.
    let ways: Vec<Vec<Vector3<f64>>> = rows
        .iter()
        .map(|(row, _)| at.joint_jacobian(&row.joints).iter().map(|column| column.fixed_rows::<3>(0).into()).collect())
        .collect();
    let longest = ways.iter().flatten().map(Vector3::norm).fold(0.0, f64::max);
    for ((measurement, residual), ways) in rows.iter().zip(&ways) {
        let [x, y, z, ..] = residual.identified;
        for (joint, way) in ways.iter().enumerate().filter(|(_, way)| way.norm() > SHORTEST * longest) {
            let approach = match measurement.approach.get(joint) {
                Some(..=-1) => 0,
                Some(1..) => 2,
                _ => 1,
            };
            let by = way.dot(&Vector3::new(x, y, z)) / way.norm();
            parts[joint].push(Part { at: measurement.joints[joint], by, approach });
        }
    }
    parts
}

/// Logs one panel per joint under `path`, of the identified model's residuals.
pub(super) fn log(
    stream: &RecordingStream,
    path: &str,
    arm: &Arm,
    measurements: &[Measurement],
    residuals: &[Residual],
) -> RecordingStreamResult<()> {
    let parts = parts(arm, measurements, residuals);
    // One scale for all, so that the joint that errs stands out: three times the mean square takes in nearly all.
    let square = |joint: &Vec<Part>| joint.iter().map(|part| part.by * part.by).sum::<f64>() / joint.len().max(1) as f64;
    let scale = 3.0 * parts.iter().map(square).fold(0.0, f64::max).sqrt();
    if !(scale > 0.0 && scale.is_finite()) {
        return Ok(());
    }
    let (mut frames, mut places, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    let mut points: [Vec<[f32; 2]>; 3] = Default::default();
    for (joint, (parts, of)) in parts.iter().zip(&arm.chain.joints).enumerate() {
        let (x0, y0) = (STEP[0] * (joint % COLUMNS) as f64, STEP[1] * (joint / COLUMNS) as f64);
        let [left, right, top, middle, bottom] = [x0, x0 + WIDTH, y0, y0 + HEIGHT / 2.0, y0 + HEIGHT].map(|value| value as f32);
        frames.push(vec![[left, top], [right, top], [right, bottom], [left, bottom], [left, top]]);
        frames.push(vec![[left, middle], [right, middle]]);
        let turning = of.kind == JointKind::Revolute;
        let (low, high) =
            parts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), part| (low.min(part.at), high.max(part.at)));
        let (low, high) = if low < high { (low, high) } else { (of.lower, of.upper) };
        let range = if turning {
            format!("{:.0} … {:.0}°", low.to_degrees(), high.to_degrees())
        } else {
            format!("{:.0} … {:.0} mm", low * 1e3, high * 1e3)
        };
        places.push([(left + right) / 2.0, top - 8.0]);
        labels.push(format!("{}: {range}", of.name));
        for part in parts {
            let x = x0 + WIDTH * (part.at - low) / (high - low);
            let y = y0 + HEIGHT * (0.5 - 0.5 * (part.by / scale).clamp(-1.0, 1.0));
            points[part.approach].push([x as f32, y as f32]);
        }
    }
    places.push([
        (STEP[0] * 0.5 * COLUMNS as f64 - 8.0) as f32,
        (STEP[1] * arm.joint_count().div_ceil(COLUMNS) as f64 - 16.0) as f32,
    ]);
    labels.push(format!("height of a panel: ±{} µm at the end point", significant(scale * 1e6, 2)));
    let thin = Radius::new_ui_points(0.6);
    stream.log(format!("{path}/frames"), &LineStrips2D::new(frames).with_colors([GRID]).with_radii([thin]))?;
    let text = Points2D::new(places).with_labels(labels).with_show_labels(true).with_colors([TEXT]);
    stream.log(format!("{path}/text"), &text.with_radii([Radius::new_ui_points(0.0)]))?;
    for ((name, colour), points) in APPROACHES.iter().zip(points) {
        let points = Points2D::new(points).with_colors([*colour]).with_radii([Radius::new_ui_points(2.2)]);
        stream.log(format!("{path}/{name}"), &points)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_joint_did_shows_in_its_panel_in_full() {
        let arm = crate::lab::reproduce::arms::arms().unwrap().swap_remove(0).scene.arm;
        let (chain, joint, turned) = (arm.chain.at_nominal(), 2, 1e-6);
        let (mut measurements, mut residuals, mut shifts) = (Vec::new(), Vec::new(), Vec::new());
        for index in 0..20 {
            let joints: Vec<f64> = (0..arm.joint_count()).map(|joint| 0.3 * joint as f64 - 0.1 * index as f64).collect();
            let mut moved = joints.clone();
            moved[joint] += turned;
            let shift = chain.end_point(&moved) - chain.end_point(&joints);
            let identified = [shift.x, shift.y, shift.z, 0.0, 0.0, 0.0];
            residuals.push(Residual { index, position_m: [0.0; 3], nominal: [0.0; 6], identified });
            let approach = (0..arm.joint_count()).map(|joint| [-1, 0, 1][(index + joint) % 3]).collect();
            measurements.push(Measurement { index, joints, approach, ..Measurement::default() });
            shifts.push(shift.norm());
        }
        let parts = parts(&arm, &measurements, &residuals);
        assert_eq!(parts[joint].len(), 20);
        for ((part, shift), row) in parts[joint].iter().zip(&shifts).zip(&measurements) {
            assert!((part.by - shift).abs() < 1e-5 * shift, "{} and {shift}", part.by);
            assert_eq!((part.at, part.approach as i8 - 1), (row.joints[joint], row.approach[joint]));
        }
        // No other joint can have made more of it.
        assert!(parts.iter().flatten().all(|part| part.by.abs() <= shifts.iter().copied().fold(0.0, f64::max)));
    }
}
