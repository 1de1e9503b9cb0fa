//! An encoder whose zero moves with the temperature of the link that the joint moves.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, drift: f64) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.small("drift", drift)?;
    parts.drives[joint].zero_drift += drift;
    Ok(())
}
