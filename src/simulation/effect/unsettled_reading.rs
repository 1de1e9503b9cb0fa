//! Every output is behind by a share of the last move when it is read.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::Fading;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, share: f64) -> Result<(), PhysicsError> {
    checks.small("share of the move", share)?;
    parts.drives.iter_mut().for_each(|drive| drive.fading.push(Fading { share, time_constant_s: 0.0 }));
    Ok(())
}
