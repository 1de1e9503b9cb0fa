//! A graduation, or teeth, that are off here and there: the output stands where the table of its errors says.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::Graduation;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    angles: &[f64],
    errors: &[f64],
) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    for (angle, error) in angles.iter().zip(errors) {
        checks.finite("angle", *angle)?;
        checks.small("error", error.abs())?;
    }
    parts.drives[joint].graduations.push(Graduation { angles: angles.to_vec(), errors: errors.to_vec() });
    Ok(())
}
