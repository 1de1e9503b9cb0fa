//! What the sensor does is none of the arm's: `cell::sensor` does that.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::Checks;

pub(super) fn check(checks: &Checks<'_>, scale: f64) -> Result<(), PhysicsError> {
    checks.small("scale", scale)
}
