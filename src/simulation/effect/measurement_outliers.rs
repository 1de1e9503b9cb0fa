//! What the sensor does is none of the arm's: `cell::sensor` does that.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::Checks;

pub(super) fn check(checks: &Checks<'_>, share: f64, factor: f64) -> Result<(), PhysicsError> {
    checks.share("share", share)?;
    checks.positive("factor", factor)
}
