//! What the laboratory found, as tables and figures for people. It stands here and not in [`crate::report`] because the steps of a session
//! need the words of that one, and the laboratory runs sessions.

pub mod challenge;
pub mod confirm;
pub mod effects;
pub mod findings;
pub mod power;
pub mod sweep;
