//! An output that follows each move with a delay: what is left of it fades with time.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::Fading;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    share: f64,
    time_constant_s: f64,
) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.small("share of the move", share)?;
    checks.require(time_constant_s >= 0.0, "time constant", time_constant_s, "zero or more")?;
    parts.drives[joint].fading.push(Fading { share, time_constant_s });
    Ok(())
}
