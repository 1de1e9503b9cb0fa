//! A free coordinate about the joint's axis with rapier's passive spring.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, stiffness: f64) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.stiff("stiffness", stiffness)?;
    parts.yields(joint, Direction::Joint, Law::Spring { stiffness });
    Ok(())
}
