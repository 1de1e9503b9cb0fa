//! What happens in a run, in order. Live views, the recording and its replay all see this one type, and
//! nothing that computes knows of them: steps report what they do ([`Progress`]), the session tells it as events.

use crate::design::outcome::{DesignOutcome, SearchStep, SwarmIteration};
use crate::diagnosis::outcome::Diagnosis;
use crate::identification::known::Known;
use crate::identification::ladder::Freedom;
use crate::identification::outcome::Identification;
use crate::measurement::Distance;
use crate::measurement::Measurement;
use crate::progress::Progress;

/// One event of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// First in every recording.
    Start(Start),
    /// An iteration of the swarm.
    Swarm(SwarmIteration),
    /// A step of a search by any other method.
    Search(SearchStep),
    /// The configurations have been chosen.
    Designed(DesignOutcome),
    /// A configuration has been measured.
    Measured(Measurement),
    /// The parameters have been identified.
    Identified(Identification),
    /// What causes the rest has been looked for in all readings.
    Diagnosed(Box<Diagnosis>),
    /// Why the causes could not be looked for.
    NotDiagnosed(String),
    /// Something worth telling.
    Note(String),
}

/// The measurements among `events`, in their order.
#[must_use]
pub fn measurements(events: &[Event]) -> Vec<Measurement> {
    let measured = |event: &Event| match event {
        Event::Measured(measurement) => Some(measurement.clone()),
        _ => None,
    };
    events.iter().filter_map(measured).collect()
}

/// What the run was: what a recording begins with.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct Start {
    /// Version of kincal.
    pub version: String,
    /// The command whose run this is: `run`, `design`, `measure`, `identify`.
    pub command: String,
    /// Public part of the scene, as TOML: whatever is needed to repeat the run but the truth. Empty where a real arm was measured and
    /// its URDF is all there is.
    pub scene: String,
    /// Number of poses to be measured, where the scene alone does not tell (a design from elsewhere).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<usize>,
    /// The real cell, where measurements come from a table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real: Option<RealCell>,
}

/// What is known of a real cell besides its measurements.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub struct RealCell {
    /// Nominal robot as URDF; absent where it is the scene's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// Link of the URDF at which the arm begins, if not its root.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_link: Option<String>,
    /// Link of the URDF that carries the target, if not its only leaf.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_link: Option<String>,
    /// Declared position noise, one sigma per axis, m; what is usual where nobody declared any.
    pub position_sigma_m: f64,
    /// Whether nobody declared it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub noise_assumed: bool,
    /// Declared orientation noise, one sigma per axis, rad; unused where only positions were measured.
    #[serde(rename = "attitude_sigma_rad")]
    pub orientation_sigma_rad: f64,
    /// What alone is let loose of the arm, where somebody said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub only: Option<Freedom>,
    /// Where each joint's zero is looked for, rad or m; empty for nominal.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zeros: Vec<f64>,
    /// What somebody knows of the arm beforehand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub known: Vec<Known>,
    /// Known distances of fixed points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distances: Vec<Distance>,
    /// What was to be known of the table when it was read, and what was said on the command line.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// Whoever listens to a run: takes its events in order.
pub trait Listener: for<'e> Progress<&'e Event> {}

impl<L: for<'e> Progress<&'e Event> + ?Sized> Listener for L {}
