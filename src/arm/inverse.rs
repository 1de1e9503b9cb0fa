//! Joint coordinates at which a chain reaches a pose: damped least squares within the joints' limits, from several starts.

use nalgebra::{DMatrix, DVector, Vector6};

use super::chain::{ChainAt, Joint, JointKind};
use super::frames::{Pose, pose_error};
use crate::seed::stream;

/// Steps from one start.
const STEPS: usize = 200;
/// Starts: where it is told to begin, the middle of the limits, and drawn ones.
const STARTS: usize = 24;
/// Off by less than this (m and rad) it is there.
const REACHED: f64 = 1e-10;

/// Where a pose was looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Joint coordinates, rad or m, within the limits.
    pub joints: Vec<f64>,
    /// How far the pose is off there: position (m) and orientation (rad).
    pub off: [f64; 2],
}

impl Reached {
    /// Whether the pose is reached.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.off[0] < 1e3 * REACHED && self.off[1] < 1e3 * REACHED
    }
}

/// The coordinates of `chain` nearest to `start` at which its tool is at `wanted` (its orientation, too, where `oriented`), within the limits
/// of `joints`; where there are none, those at which it is off least.
#[must_use]
pub fn reach(chain: &ChainAt, joints: &[Joint], wanted: &Pose, oriented: bool, start: &[f64]) -> Reached {
    let mut draws = stream(0, "arm/inverse");
    let middle: Vec<f64> = joints.iter().map(|joint| 0.5 * (joint.lower + joint.upper)).collect();
    let drawn = (2..STARTS).map(|_| joints.iter().map(|joint| draws.uniform(joint.lower, joint.upper)).collect::<Vec<f64>>());
    let mut best: Option<Reached> = None;
    let away = |of: &[f64]| of.iter().zip(start).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    for (number, from) in [start.to_vec(), middle].into_iter().chain(drawn).enumerate() {
        let found = descend(chain, joints, wanted, oriented, from);
        let better = match &best {
            None => true,
            Some(best) if best.is_there() => found.is_there() && away(&found.joints) < away(&best.joints),
            Some(best) => found.is_there() || found.off[0] + found.off[1] < best.off[0] + best.off[1],
        };
        if better {
            best = Some(found);
        }
        // The nearest to the start is the one that is found from there.
        if number == 0 && best.as_ref().is_some_and(Reached::is_there) {
            break;
        }
    }
    best.unwrap_or_else(|| Reached { joints: start.to_vec(), off: [f64::INFINITY; 2] })
}

fn within(joints: &[Joint], at: &mut [f64]) {
    for (value, joint) in at.iter_mut().zip(joints) {
        if joint.kind == JointKind::Revolute && joint.upper - joint.lower > 2.0 * std::f64::consts::PI {
            continue;
        }
        *value = value.clamp(joint.lower, joint.upper);
    }
}

fn descend(chain: &ChainAt, joints: &[Joint], wanted: &Pose, oriented: bool, mut at: Vec<f64>) -> Reached {
    let error = |at: &[f64]| -> Vector6<f64> {
        let mut error = pose_error(wanted, &chain.forward(at));
        if !oriented {
            error.fixed_rows_mut::<3>(3).fill(0.0);
        }
        error
    };
    within(joints, &mut at);
    let mut left = error(&at);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        if left.norm() < REACHED || damping > 1e8 {
            break;
        }
        let rows = if oriented { 6 } else { 3 };
        let columns = chain.joint_jacobian(&at);
        let jacobian = DMatrix::from_fn(rows, columns.len(), |row, column| columns[column][row]);
        let right = DVector::from_fn(rows, |row, _| left[row]);
        let mut normal = jacobian.tr_mul(&jacobian);
        (0..normal.nrows()).for_each(|joint| normal[(joint, joint)] += damping * (1e-3 + left.norm_squared()));
        let Some(step) = normal.cholesky().map(|factor| factor.solve(&jacobian.tr_mul(&right))) else {
            break;
        };
        // A turn of more than half a radian is beyond what is linear.
        let scale = (0.5 / step.amax().max(1e-300)).min(1.0);
        let mut trial: Vec<f64> = at.iter().zip(step.iter()).map(|(value, change)| value + scale * change).collect();
        within(joints, &mut trial);
        let there = error(&trial);
        if there.norm() < left.norm() {
            (at, left) = (trial, there);
            damping = (damping * 0.2).max(1e-12);
        } else {
            damping *= 5.0;
        }
    }
    let off = [left.fixed_rows::<3>(0).norm(), left.fixed_rows::<3>(3).norm()];
    Reached { joints: at, off }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reproduce::arms::arms;

    #[test]
    fn poses_of_an_arm_are_reached_again_within_the_limits() {
        let mut draws = stream(1, "test/inverse");
        for file in arms().unwrap() {
            let arm = file.scene.arm;
            let chain = arm.chain.at_nominal();
            let mut missed = 0;
            for _ in 0..20 {
                let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| draws.uniform(joint.lower, joint.upper)).collect();
                let near: Vec<f64> = joints.iter().map(|value| value + draws.uniform(-0.05, 0.05)).collect();
                let wanted = chain.forward(&joints);
                let found = reach(&chain, &arm.chain.joints, &wanted, true, &near);
                assert!(found.is_there(), "{:?}", found.off);
                assert!(pose_error(&chain.forward(&found.joints), &wanted).amax() < 1e-8);
                let inside = found.joints.iter().zip(&arm.chain.joints);
                assert!(inside.into_iter().all(|(value, joint)| *value >= joint.lower - 1e-12 && *value <= joint.upper + 1e-12));
                // From anywhere, too, mostly.
                let middle: Vec<f64> = arm.chain.joints.iter().map(|joint| 0.5 * (joint.lower + joint.upper)).collect();
                missed += usize::from(!reach(&chain, &arm.chain.joints, &wanted, true, &middle).is_there());
            }
            assert!(missed <= 2, "{missed} of 20 poses were not reached from the middle");
        }
        // Out of reach is said.
        let arm = arms().unwrap().remove(0).scene.arm;
        let far = Pose::translation(30.0, 0.0, 0.0);
        let found = reach(&arm.chain.at_nominal(), &arm.chain.joints, &far, false, &vec![0.0; arm.joint_count()]);
        assert!(!found.is_there() && found.off[0] > 20.0);
    }
}
