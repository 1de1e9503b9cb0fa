//! Choosing the configurations to measure.

pub mod outcome;
