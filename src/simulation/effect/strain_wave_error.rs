//! A wave generator whose two lobes push the teeth a little too far or too little.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::WaveGenerator;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    wave_generator: WaveGenerator,
) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.small("amplitude", wave_generator.amplitude)?;
    checks.positive("ratio", wave_generator.ratio)?;
    checks.finite("phase", wave_generator.phase)?;
    parts.drives[joint].wave_generators.push(wave_generator);
    Ok(())
}
