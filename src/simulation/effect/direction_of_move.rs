//! Friction that grows with the torque winds the output up against its last move, until load and lag agree.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::simulation::physics::true_arm::{Placement, TrueArm};
use crate::simulation::physics::world::World;

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, gain: f64) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.require((0.0..=0.1).contains(&gain), "gain", gain, "between 0 and 0.1")?;
    parts.reactions.windup[joint] += gain;
    Ok(())
}

/// Turns each joint back by half of what its torque winds it up.
pub(in crate::simulation) fn answer(gains: &[f64], arm: &TrueArm, world: &World, placement: &mut Placement) {
    for (joint, gain) in gains.iter().enumerate().filter(|(_, gain)| **gain != 0.0) {
        let base_from_joint = world.base_from_joint(joint);
        let moment = world.moment_about(arm, &base_from_joint.translation.vector, joint);
        let torque = moment.dot(&(base_from_joint.rotation * nalgebra::Vector3::z()));
        placement.joints[joint] -= 0.5 * gain * placement.directions[joint] * torque.abs();
    }
}
