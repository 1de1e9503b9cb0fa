//! What happens in a run, in order. Live views, the recording and its replay all see this one type.

use crate::design::outcome::{DesignOutcome, SwarmIteration};
use crate::identification::outcome::Identification;
use crate::measurement::Measurement;

/// One event of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// First in every recording.
    Start(Start),
    /// An iteration of the swarm.
    Swarm(SwarmIteration),
    /// The configurations have been chosen.
    Designed(DesignOutcome),
    /// A configuration has been measured.
    Measured(Measurement),
    /// The parameters have been identified.
    Identified(Identification),
    /// Something worth telling.
    Note(String),
}

/// What a recording begins with.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Start {
    /// Version of kincal.
    pub version: String,
    /// The command whose run this is: `run`, `design`, `measure`, `identify`.
    pub command: String,
    /// Public part of the scene, as TOML: whatever is needed to repeat the run but the truth.
    pub scene: String,
}

/// Whoever listens to a run.
pub trait Listener {
    /// Takes the next event.
    ///
    /// # Errors
    /// If it could not be written; the run stops then.
    fn take(&mut self, event: &Event) -> Result<(), ListenerError>;
}

/// A listener could not take an event.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ListenerError(pub String);
