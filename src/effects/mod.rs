//! The vocabulary of un-modelled effects: what they are called and where they sit. Shared by the simulated cell, which makes them
//! happen in the physics, and by the analyser, which looks for their signatures; neither knows how the other does it.

pub mod kind;
pub mod signature;

pub use kind::{Kind, Level, Location};
