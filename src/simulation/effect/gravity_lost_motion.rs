//! A free, limited coordinate about the joint's axis that gravity seats.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, width: f64) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.width(width)?;
    parts.yields(joint, Direction::Joint, Law::LostMotion { half_width: width / 2.0 });
    Ok(())
}
