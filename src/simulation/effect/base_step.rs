//! The root frame moves at once in the world (gravity does not). Of a sensor: see `cell::sensor`.

use crate::simulation::effect::Moves;
use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::simulation::physics::mechanism::{Shift, When};
use nalgebra::Vector3;

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    moves: Moves,
    (translation, rotation): (Vector3<f64>, Vector3<f64>),
    after: f64,
) -> Result<(), PhysicsError> {
    checks.moved(&translation, &rotation)?;
    checks.share("share of the session", after)?;
    if moves == Moves::Base {
        parts.base_shifts.push(Shift { translation, rotation, when: When::At(after) });
    }
    Ok(())
}
