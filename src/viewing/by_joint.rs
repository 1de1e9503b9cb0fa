//! What is left of the error, joint by joint: how far each joint would have to turn for the end point to fall where it was measured,
//! over that joint's angle. Play, ripple and lost motion show here as a shape.

use nalgebra::Vector3;
use rerun::{LineStrips2D, Points2D, Radius, RecordingStream, RecordingStreamResult};

use super::summary::significant;
use crate::arm::Arm;
use crate::identification::outcome::Residual;
use crate::kinematics::JointKind;
use crate::measurement::Measurement;

/// Size of a panel, and from one to the next.
const WIDTH: f64 = 60.0;
const HEIGHT: f64 = 32.0;
const STEP: [f64; 2] = [WIDTH + 14.0, HEIGHT + 16.0];
const COLUMNS: usize = 4;
const GRID: [u8; 3] = [70, 74, 82];
const TEXT: [u8; 3] = [190, 194, 202];
/// Where the joint came from: from above, not known or no move, from below.
const APPROACHES: [(&str, [u8; 3]); 3] =
    [("came_down", [110, 170, 230]), ("no_move", [170, 180, 120]), ("came_up", [255, 184, 56])];
/// A lever shorter than this share of the arm's longest tells nothing of its joint.
const SHORTEST: f64 = 0.1;

/// x and y ranges of the whole drawing for an arm of `joints` joints.
pub(super) fn bounds(joints: usize) -> [[f64; 2]; 2] {
    let (columns, rows) = (joints.clamp(1, COLUMNS), joints.max(1).div_ceil(COLUMNS));
    [[-8.0, STEP[0] * columns as f64], [-14.0, STEP[1] * rows as f64 - 8.0]]
}

/// A residual as a turn of one joint.
struct Turn {
    /// Joint coordinate, rad or m.
    at: f64,
    /// rad or m.
    by: f64,
    /// Index into [`APPROACHES`].
    approach: usize,
}

/// The residuals as turns of each joint: of each, the part along the way on which the joint would move the end point.
fn turns(arm: &Arm, measurements: &[Measurement], residuals: &[Residual]) -> Vec<Vec<Turn>> {
    let at = arm.chain.at_nominal();
    let mut turns: Vec<Vec<Turn>> = (0..arm.joint_count()).map(|_| Vec::new()).collect();
    let rows: Vec<(&Measurement, Vector3<f64>, Vec<Vector3<f64>>)> = residuals
        .iter()
        .filter_map(|residual| {
            let measurement = measurements.iter().find(|measurement| measurement.index == residual.index)?;
            let [x, y, z, ..] = residual.identified;
            let levers = at.joint_jacobian(&measurement.joints).iter().map(|column| column.fixed_rows::<3>(0).into()).collect();
            Some((measurement, Vector3::new(x, y, z), levers))
        })
        .collect();
    let longest = rows.iter().flat_map(|(_, _, levers)| levers).map(Vector3::norm).fold(0.0, f64::max);
    for (measurement, residual, levers) in rows {
        for (joint, lever) in levers.iter().enumerate().filter(|(_, lever)| lever.norm() > SHORTEST * longest) {
            let approach = match measurement.approach.get(joint) {
                Some(..=-1) => 0,
                Some(1..) => 2,
                _ => 1,
            };
            turns[joint].push(Turn { at: measurement.joints[joint], by: lever.dot(&residual) / lever.norm_squared(), approach });
        }
    }
    turns
}

/// Logs one panel per joint under `path`, of the identified model's residuals.
pub(super) fn log(
    stream: &RecordingStream,
    path: &str,
    arm: &Arm,
    measurements: &[Measurement],
    residuals: &[Residual],
) -> RecordingStreamResult<()> {
    let turns = turns(arm, measurements, residuals);
    // One scale for all, so that the joint that errs stands out: three times the mean square takes in nearly all.
    let square = |joint: &Vec<Turn>| joint.iter().map(|turn| turn.by * turn.by).sum::<f64>() / joint.len().max(1) as f64;
    let scale = 3.0 * turns.iter().map(square).fold(0.0, f64::max).sqrt();
    if !(scale > 0.0 && scale.is_finite()) {
        return Ok(());
    }
    let (mut frames, mut places, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    let mut points: [Vec<[f32; 2]>; 3] = Default::default();
    for (joint, (turns, of)) in turns.iter().zip(&arm.chain.joints).enumerate() {
        let (x0, y0) = (STEP[0] * (joint % COLUMNS) as f64, STEP[1] * (joint / COLUMNS) as f64);
        let [left, right, top, middle, bottom] = [x0, x0 + WIDTH, y0, y0 + HEIGHT / 2.0, y0 + HEIGHT].map(|value| value as f32);
        frames.push(vec![[left, top], [right, top], [right, bottom], [left, bottom], [left, top]]);
        frames.push(vec![[left, middle], [right, middle]]);
        let turning = of.kind == JointKind::Revolute;
        let (low, high) =
            turns.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), turn| (low.min(turn.at), high.max(turn.at)));
        let (low, high) = if low < high { (low, high) } else { (of.lower, of.upper) };
        let range = if turning {
            format!("{:.0} … {:.0}°", low.to_degrees(), high.to_degrees())
        } else {
            format!("{:.0} … {:.0} mm", low * 1e3, high * 1e3)
        };
        let unit = if turning { "µrad" } else { "µm" };
        places.push([(left + right) / 2.0, top - 8.0]);
        labels.push(format!("{}, {range}: ±{} {unit}", of.name, significant(scale * 1e6, 2)));
        for turn in turns {
            let x = x0 + WIDTH * (turn.at - low) / (high - low);
            let y = y0 + HEIGHT * (0.5 - 0.5 * (turn.by / scale).clamp(-1.0, 1.0));
            points[turn.approach].push([x as f32, y as f32]);
        }
    }
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
    fn a_turn_of_one_joint_shows_as_that_turn_on_that_joint() {
        let arm = crate::experiments::arms::arms().unwrap().swap_remove(0).scene.arm;
        let (chain, joint, turned) = (arm.chain.at_nominal(), 2, 1e-6);
        let mut measurements = Vec::new();
        let mut residuals = Vec::new();
        for index in 0..20 {
            let joints: Vec<f64> = (0..arm.joint_count()).map(|joint| 0.3 * joint as f64 - 0.1 * index as f64).collect();
            let mut moved = joints.clone();
            moved[joint] += turned;
            let shift = chain.end_point(&moved) - chain.end_point(&joints);
            residuals.push(Residual {
                index,
                position_m: [0.0; 3],
                nominal: [0.0; 6],
                identified: [shift.x, shift.y, shift.z, 0.0, 0.0, 0.0],
            });
            let approach = (0..arm.joint_count()).map(|joint| [-1, 0, 1][(index + joint) % 3]).collect();
            measurements.push(Measurement { index, joints, approach, ..Measurement::default() });
        }
        let turns = turns(&arm, &measurements, &residuals);
        assert!(turns[joint].len() > 10);
        for turn in &turns[joint] {
            assert!((turn.by - turned).abs() < 1e-10, "{}", turn.by);
            let row = measurements.iter().find(|row| row.joints[joint] == turn.at).unwrap();
            assert_eq!(turn.approach as i8 - 1, row.approach[joint]);
        }
        assert!(turns.iter().flatten().all(|turn| turn.by.abs() < 10.0 * turned));
    }
}
