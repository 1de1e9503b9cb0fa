//! A base on an elastic footing: it leans about its origin under the moment of all that it carries, until lean and moment agree.

use nalgebra::{Translation3, Vector3};

use crate::arm::frames::{Pose, rotation_from_vector};
use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::simulation::physics::true_arm::{Placement, TrueArm};
use crate::simulation::physics::world::World;

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, compliance: f64) -> Result<(), PhysicsError> {
    checks.soft("compliance", compliance)?;
    parts.reactions.base_tilt += compliance;
    Ok(())
}

/// Leans the base, wherever it has moved to, under the moment across gravity.
pub(in crate::simulation) fn answer(
    compliance: f64,
    arm: &TrueArm,
    world: &World,
    unloaded: &Placement,
    placement: &mut Placement,
) {
    if compliance == 0.0 {
        return;
    }
    let moved = unloaded.base_shift.unwrap_or_else(Pose::identity);
    let origin = moved.translation.vector;
    let moment = world.moment_about(arm, &origin, 0);
    // Without gravity there is no moment, and nothing to be across of.
    let up = arm.gravity_in_base.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
    let lean = rotation_from_vector(&((moment - up * up.dot(&moment)) * compliance));
    let about_origin = Pose::from_parts(Translation3::from(origin - lean * origin), lean);
    placement.base_shift = Some(about_origin * moved);
}
