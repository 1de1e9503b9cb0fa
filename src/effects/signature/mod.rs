//! Closed-form signatures of un-modelled effects: what each does to the pose that is read, derived on their own (never from the
//! physics that makes them happen). The columns and hypotheses of a kind are in its file ([`kind`](super::kind)); [`unnamed`] has the
//! shapes of no kind.

pub mod library;
pub mod posture;
pub mod shape;
pub mod unnamed;
