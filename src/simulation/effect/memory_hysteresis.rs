//! Dahl's friction, exact for each straight move of the session.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::Memory;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(parts: &mut Mechanisms, checks: &Checks<'_>, joint: usize, memory: Memory) -> Result<(), PhysicsError> {
    checks.exists("joint", joint)?;
    checks.small("amplitude", memory.amplitude)?;
    checks.positive("travel", memory.travel)?;
    parts.drives[joint].memories.push(memory);
    Ok(())
}
