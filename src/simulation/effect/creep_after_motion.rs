//! A spring and a damper beside it, stepped exactly over each stop of the session.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::coordinate::{Direction, Law};
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    compliance: f64,
    time_constant: f64,
) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.soft("compliance", compliance)?;
    checks.positive("time constant", time_constant)?;
    parts.yields(joint, Direction::Joint, Law::Creep { compliance, time_constant });
    Ok(())
}
