//! Closed-form signatures of un-modelled effects: what each does to the pose that is read, derived on their own (never from the
//! physics that makes them happen).

pub mod library;
pub mod posture;
pub mod shape;
