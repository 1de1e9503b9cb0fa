//! What is hidden becomes a true arm in the physics, and a sensor reads its poses.
//!
//! This and [`physics`](crate::simulation::physics) are the only places that see the truth.

pub mod measure;
pub mod plan;
mod sensor;
pub mod temperature;
pub mod truth;

use super::plan::Plan;
use crate::arm::Arm;
use crate::measurement::Sensor;

pub use measure::{MeasureError, measure};
pub use truth::{TrueEffect, TruePose, Truth};

/// What is public of a cell that measures.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    /// Nominal arm.
    pub arm: &'a Arm,
    /// Sensor as declared.
    pub sensor: &'a Sensor,
    /// How the measuring is organised.
    pub plan: &'a Plan,
    /// Public seed.
    pub seed: u64,
}
