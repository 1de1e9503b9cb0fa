//! From measurements to parameters, with what can be known about them.

pub mod outcome;
