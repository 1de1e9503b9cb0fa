//! An encoder disc off its axis, or behind a Hooke joint; the servo turns until the head reads the command.

use crate::simulation::physics::PhysicsError;
use crate::simulation::physics::drive_train::Encoder;
use crate::simulation::physics::mechanism::{Checks, Mechanisms};

pub(super) fn add(
    parts: &mut Mechanisms,
    checks: &Checks<'_>,
    joint: usize,
    amplitude: f64,
    order: u8,
    phase: f64,
) -> Result<(), PhysicsError> {
    checks.turns(joint)?;
    checks.small("amplitude", amplitude)?;
    checks.finite("phase", phase)?;
    if !(1..=2).contains(&order) {
        return checks.bad("order", f64::from(order), "1 or 2");
    }
    parts.drives[joint].encoders.push(Encoder::new(amplitude, order, phase));
    Ok(())
}
