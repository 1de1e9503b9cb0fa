//! A fitted geometry in the terms of an arm's joints, and in the parameters of its file.

use nalgebra::{DMatrix, SMatrix};

use super::alignment::six;
use super::geometry::Geometry;
use super::outcome::{Deviation, JointFrame};
use crate::arm::chain::FrameErrors;
use crate::arm::frames::Pose;
use crate::arm::urdf::rpy::rotation_from_rpy;
use crate::arm::{Arm, Axis, JointKind, Step};

/// Step of numerical derivatives of a pose's six parameters, m and rad.
const STEP: f64 = 1e-6;
/// A change of a parameter that is nothing, m or rad.
const ROUNDING: f64 = 1e-13;
/// A derivative of roll or yaw beyond which they say nothing of their own: near a pitch of a quarter turn only both together do.
const LOCKED: f64 = 1e3;

/// How far each joint's frame but the first's is off. `covariance`: of the geometry's parameters.
#[must_use]
pub fn joint_frames(arm: &Arm, geometry: &Geometry, covariance: &DMatrix<f64>) -> Vec<JointFrame> {
    let errors = geometry.frame_errors();
    let frames = geometry.frames();
    let of = |joint: usize| -> Option<JointFrame> {
        let zero = frames.zero_of(joint)?;
        let first = FrameErrors::PER_FRAME * (joint - 1);
        let deviation = |at: usize| {
            let column = geometry.first_of_frames() + at;
            Deviation { estimate: errors[at], standard_error: libm::sqrt(covariance[(column, column)].max(0.0)) }
        };
        let others = |from: usize, to: usize| (first + from..first + to).filter(move |at| *at != zero);
        let turns: Vec<Deviation> = others(3, 6).rev().map(deviation).collect();
        Some(JointFrame {
            joint: arm.chain.joints[joint].name.clone(),
            zero: deviation(zero),
            zero_unit: if arm.chain.joints[joint].kind == JointKind::Revolute { "rad" } else { "m" }.to_owned(),
            shift_m: others(0, 3).map(deviation).collect(),
            turn_rad: turns,
        })
    };
    (0..arm.joint_count()).filter_map(of).collect()
}

/// The values of all parameters of `aligned` (the arm in the measurement frame) with which it does what `geometry` does, and their standard
/// errors; `None` where its file does not give every joint an origin of six parameters. What stays nominal has no standard error.
#[must_use]
pub fn parameters(aligned: &Arm, geometry: &Geometry, covariance: &DMatrix<f64>) -> Option<(Vec<f64>, Vec<Option<f64>>)> {
    let origins = origins(aligned)?;
    let nominal = aligned.chain.nominal();
    let (mut values, mut errors) = (nominal.clone(), vec![None; nominal.len()]);
    let frame_errors = geometry.frame_errors();
    let per_frame = FrameErrors::PER_FRAME;
    let mut put = |first: usize, of: &dyn Fn(&[f64; 6]) -> Pose, column: usize, estimated: usize| {
        let before: [f64; 6] = std::array::from_fn(|at| nominal[first + at]);
        let at = near(&of(&[0.0; 6]), &before);
        let mut derivative = SMatrix::<f64, 6, 6>::zeros();
        for change in 0..estimated {
            let moved = |by: f64| {
                let mut change_of = [0.0; 6];
                change_of[change] = by;
                near(&of(&change_of), &at)
            };
            let (up, down) = (moved(STEP), moved(-STEP));
            (0..6).for_each(|row| derivative[(row, change)] = (up[row] - down[row]) / (2.0 * STEP));
        }
        let block = DMatrix::from_fn(6, 6, |row, other| {
            if row < estimated && other < estimated { covariance[(column + row, column + other)] } else { 0.0 }
        });
        let of_values = derivative * block * derivative.transpose();
        for row in 0..6 {
            values[first + row] = at[row];
            let locked = derivative.row(row).amax() > LOCKED;
            let variance = of_values[(row, row)];
            errors[first + row] = (variance > 0.0 && !locked).then(|| libm::sqrt(variance));
        }
    };
    let base = geometry.measurement_from_root()[0];
    if geometry.is_placed() {
        put(0, &|change| base * FrameErrors::pose(change), 0, per_frame);
    }
    for (joint, origin) in origins.iter().enumerate().skip(1) {
        let own = &frame_errors[per_frame * (joint - 1)..per_frame * joint];
        if own.iter().all(|error| *error == 0.0) {
            continue;
        }
        let before = pose_of(&std::array::from_fn(|at| nominal[origin.first + at]));
        let after = origin.to_joint;
        let moved = |change: &[f64; 6]| {
            let errors: Vec<f64> = own.iter().zip(change).map(|(error, change)| error + change).collect();
            before * after * FrameErrors::pose(&errors) * after.inverse()
        };
        put(origin.first, &moved, geometry.first_of_frames() + per_frame * (joint - 1), per_frame);
    }
    let target = geometry.tool_from_target()[0];
    let first_of_target = geometry.first_of_frames() + frame_errors.len();
    put(nominal.len() - per_frame, &|change| target * FrameErrors::pose(change), first_of_target, geometry.per_target());
    Some((values, errors))
}

/// The origin of a joint: its first parameter, and what is between it and the frame in which the joint moves.
struct Origin {
    first: usize,
    to_joint: Pose,
}

/// The origins of all joints, where every one has six parameters in the order of a URDF, with nothing but known transforms behind.
fn origins(aligned: &Arm) -> Option<Vec<Origin>> {
    let wanted = [Axis::X, Axis::Y, Axis::Z, Axis::Z, Axis::Y, Axis::X];
    let mut origins = Vec::new();
    let mut open: Option<Origin> = None;
    let mut in_row = 0;
    for step in &aligned.chain.steps {
        match step {
            Step::Translate { axis, parameter } | Step::Rotate { axis, parameter } => {
                let turns = matches!(step, Step::Rotate { .. });
                in_row = if in_row >= 6 { 0 } else { in_row };
                if *axis != wanted[in_row] || turns != (in_row >= 3) {
                    return None;
                }
                if in_row == 0 {
                    open = Some(Origin { first: *parameter, to_joint: Pose::identity() });
                }
                in_row += 1;
            }
            Step::Fixed(pose) => {
                if let Some(origin) = &mut open {
                    origin.to_joint *= pose;
                }
            }
            Step::Frame { .. } => {}
            Step::Joint { .. } => {
                origins.push(open.take().filter(|_| in_row == 6)?);
                in_row = 0;
            }
        }
    }
    Some(origins)
}

fn pose_of([x, y, z, yaw, pitch, roll]: &[f64; 6]) -> Pose {
    Pose::from_parts(nalgebra::Translation3::new(*x, *y, *z), rotation_from_rpy([*roll, *pitch, *yaw]))
}

/// The six parameters of `pose` that are nearest to `wanted`: angles have more than one form.
fn near(pose: &Pose, wanted: &[f64; 6]) -> [f64; 6] {
    let [x, y, z, yaw, pitch, roll] = six(pose);
    let half = std::f64::consts::PI;
    let whole = |angle: f64, wanted: f64| angle - 2.0 * half * ((angle - wanted) / (2.0 * half)).round();
    let form =
        |yaw: f64, pitch: f64, roll: f64| [x, y, z, whole(yaw, wanted[3]), whole(pitch, wanted[4]), whole(roll, wanted[5])];
    let mut forms = vec![form(yaw, pitch, roll), form(yaw + half, half - pitch, roll + half)];
    if (half / 2.0 - pitch.abs()).abs() < 1e-9 {
        // Only the sum or the difference of yaw and roll counts: yaw stays.
        let sign = pitch.signum();
        let kept = wanted[3];
        forms.push(form(kept, pitch, roll + sign * (kept - yaw)));
    }
    let away = |form: &[f64; 6]| (3..6).map(|at| (form[at] - wanted[at]).powi(2)).sum::<f64>();
    let nearest = forms.into_iter().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or([x, y, z, yaw, pitch, roll]);
    // What only rounding changes stays as it was written.
    std::array::from_fn(|at| if (nearest[at] - wanted[at]).abs() < ROUNDING { wanted[at] } else { nearest[at] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::pose_error;
    use crate::seed::stream;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_nearest_form_of_a_pose_is_the_pose_and_stays_where_it_was() {
        let mut draws = stream(1, "test/frames");
        for pitch in [0.0, 0.7, 2.5, FRAC_PI_2, -FRAC_PI_2] {
            for _ in 0..50 {
                let wanted = [0.1, -0.2, 0.3, draws.uniform(-3.0, 3.0), pitch, draws.uniform(-3.0, 3.0)];
                let pose = pose_of(&wanted);
                let found = near(&pose, &wanted);
                assert!(pose_error(&pose_of(&found), &pose).amax() < 1e-9, "{wanted:?} {found:?}");
                assert!(wanted.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-6), "{wanted:?} {found:?}");
            }
        }
    }
}
