//! A servo that adds what its torque sensor reads of the moment across, until both agree.

use super::{Checks, Mechanisms};
use crate::simulation::physics::PhysicsError;

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, gain: f64) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.small("gain", gain)?;
    parts.drives[joint].crosstalk += gain;
    Ok(())
}
