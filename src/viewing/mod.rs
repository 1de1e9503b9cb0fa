//! Live view of a run in Rerun: the swarm or another search, the arm in its configurations, measured against predicted poses, residuals.
//!
//! A [`Viewer`] is one more listener of a run's events: it sees what is recorded and nothing else, so that a replay shows what
//! the run showed. [`open`] finds out where to ([`Target`]); a thread of its own does the logging, so that a viewer that hangs
//! or dies never holds up a run.
//!
//! Reading order: `target`, `viewer` (destination, thread), `picture` (what each event draws) with its parts `body` (arm),
//! `chart`, `diagnosis` and `summary`, and `layout` (the blueprint).

mod body;
mod by_joint;
mod chart;
mod diagnosis;
mod layout;
mod picture;
mod summary;
mod target;
mod viewer;

#[cfg(test)]
mod example;

pub use target::{Target, TargetError};
pub use viewer::{Viewer, ViewerError, open};
