//! What the sensor does is none of the arm's: `cell::sensor` does that.

use super::Checks;
use crate::simulation::physics::PhysicsError;

pub(super) fn check(checks: &Checks<'_>, scale: f64) -> Result<(), PhysicsError> {
    checks.small("scale", scale)
}
