//! Experiments that know the truth and the answer: the only place that holds both.

pub mod bake_off;
pub mod count_error;
pub mod situation;
pub mod statistics;
pub mod trial;
