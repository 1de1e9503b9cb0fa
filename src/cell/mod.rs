//! The simulated cell: what is hidden becomes a true arm in the physics, and a sensor reads its poses.
//!
//! This and [`physics`](crate::physics) are the only places that see the truth.

pub mod measure;
pub mod plan;
mod sensor;
pub mod temperature;
pub mod truth;

pub use measure::{MeasureError, measure};
pub use truth::{TrueEffect, TruePose, Truth};
