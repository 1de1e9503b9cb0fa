//! From measurements to parameters, with what can be known about them.

pub mod alignment;
mod feature;
pub mod frames;
pub mod geometry;
pub mod known;
pub mod ladder;
pub mod least_squares;
pub mod mistake;
pub mod outcome;
pub mod prior;
pub mod real;
pub mod standing;

pub use alignment::align;
pub use least_squares::{IdentificationError, fit_some, identify, identify_on};
pub use real::{identify_real, identify_real_without_noise};
