//! A gear train from the motor to the output whose ratio is off, and from the motor of another joint.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    ratio_error: f64,
    (source, coupling): (usize, f64),
) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.exists("source", source)?;
    checks.small("ratio error", ratio_error)?;
    checks.small("coupling", coupling)?;
    parts.drives[joint].ratio_error += ratio_error;
    parts.drives[joint].leaks.push((source, coupling));
    Ok(())
}
