//! A gear train with a sector of worn teeth.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::WornSector;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, sector: WornSector) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.small("depth", sector.depth)?;
    checks.finite("centre", sector.centre)?;
    if !(sector.half_width > 0.0 && sector.half_width <= std::f64::consts::PI) {
        return checks.bad("half width", sector.half_width, "more than 0 and at most π");
    }
    parts.drives[joint].worn.push(sector);
    Ok(())
}
