//! The tool moves on its link at once.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};
use crate::simulation::physics::mechanism::{Shift, When};
use nalgebra::Vector3;

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    (translation, rotation): (Vector3<f64>, Vector3<f64>),
    after: f64,
) -> Result<(), PhysicsError> {
    checks.moved(&translation, &rotation)?;
    checks.share("share of the session", after)?;
    parts.tool_shifts.push(Shift { translation, rotation, when: When::At(after) });
    Ok(())
}
