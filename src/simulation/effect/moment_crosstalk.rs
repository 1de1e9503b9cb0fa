//! A servo that adds what its torque sensor reads of the moment across, until both agree.

use nalgebra::Vector3;

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::simulation::physics::true_arm::{Placement, TrueArm};
use crate::simulation::physics::world::World;

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, gain: f64) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.small("gain", gain)?;
    parts.reactions.crosstalk[joint] += gain;
    Ok(())
}

/// Turns each joint further by what its servo takes for a torque error: the moment of gravity on what it carries, about the x axis of its
/// frame.
pub(in crate::simulation) fn answer(gains: &[f64], arm: &TrueArm, world: &World, placement: &mut Placement) {
    for (joint, gain) in gains.iter().enumerate().filter(|(_, gain)| **gain != 0.0) {
        let base_from_joint = world.base_from_joint(joint);
        let moment = world.moment_about(arm, &base_from_joint.translation.vector, joint);
        let across = moment.dot(&(base_from_joint.rotation * Vector3::x()));
        placement.joints[joint] += gain * across;
    }
}
