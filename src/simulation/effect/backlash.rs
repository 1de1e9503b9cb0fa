//! Output between two stops of the motor's, held by rapier's friction; the last of the move is driven.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, width: f64) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.width(width)?;
    parts.yields(joint, Direction::Joint, Law::Backlash { half_width: width / 2.0 });
    Ok(())
}
