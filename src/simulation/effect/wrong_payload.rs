//! A spring in every joint, relaxed where a servo that knows the believed payload would put it, and a payload that is another.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, excess: f64, stiffness: f64) -> Result<(), PhysicsError> {
    if !(-1000.0..=1000.0).contains(&excess) {
        return checks.bad("excess", excess, "between -1000 and 1000 (kg)");
    }
    checks.stiff("stiffness", stiffness)?;
    parts.excess_kg += excess;
    for joint in 0..checks.kinds.len() {
        parts.yields(joint, Direction::Joint, Law::Compensated { stiffness });
    }
    Ok(())
}
