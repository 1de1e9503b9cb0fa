//! What knows the truth and the answer: the only place that holds both. Sweeps of injected effects, sealed cases and their scores, the
//! validation of every effect, a diagnosis put back into the physics, and the paper's experiments ([`reproduce`]).

pub mod challenge;
pub mod conditions;
pub mod confirm;
pub mod detectability;
pub mod effect_validation;
pub mod injection;
pub mod report;
pub mod reproduce;
#[cfg(test)]
mod signature_check;
pub mod sweep;
pub mod trial;
