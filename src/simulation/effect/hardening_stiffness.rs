//! The tangent of a spring that hardens, renewed every step.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    stiffness: f64,
    cubic: f64,
) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.stiff("stiffness", stiffness)?;
    if !(0.0..=1e15).contains(&cubic) {
        return checks.bad("cubic", cubic, "between 0 and 1e15 (N·m/rad³)");
    }
    parts.yields(joint, Direction::Joint, Law::Hardening { stiffness, cubic });
    Ok(())
}
