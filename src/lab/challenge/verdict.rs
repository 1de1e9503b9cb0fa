//! A diagnosis as the scorer sees it: what of `kincal diagnose --json` it needs. Any tool that writes this can be scored.

use serde::{Deserialize, Serialize};

use super::case::{CaseTruth, TrueEffect};
use super::folder::Case;

/// A diagnosis. Unknown fields are left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// `no_gap`, `explained`, `ambiguous`, `unknown_remains`, `not_detectable`.
    pub verdict: String,
    /// Effects that are named.
    #[serde(default)]
    pub effects: Vec<NamedEffect>,
    /// Hypotheses that cannot be told apart.
    #[serde(default)]
    pub confusion_sets: Vec<Vec<Candidate>>,
    /// Whether something is left that no effect explains.
    #[serde(default)]
    pub unknown: Unknown,
    /// Errors on held-out poses.
    #[serde(default)]
    pub gap: Option<Gap>,
}

/// 3-D position RMS on held-out poses, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Geometry fitted.
    pub geometry_rms_m: f64,
    /// Geometry and effects.
    pub explained_rms_m: f64,
    /// What noise alone would leave.
    #[serde(default)]
    pub noise_rms_m: Option<f64>,
}

/// An effect that is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedEffect {
    /// Its kind.
    pub kind: String,
    /// Where.
    pub location: Place,
    /// That it is there; one where the tool says nothing.
    #[serde(default = "certain")]
    pub probability: f64,
    /// How large it is.
    #[serde(default)]
    pub magnitude: Option<Magnitude>,
}

fn certain() -> f64 {
    1.0
}

/// A place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// `joint`, `link`, `base`, `tool`, `sensor`.
    pub level: String,
    /// From 1.
    #[serde(default)]
    pub index: Option<usize>,
    /// Of a step, s since the first reading's clock began.
    #[serde(default)]
    pub time_s: Option<f64>,
}

/// A magnitude with its interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Magnitude {
    /// In `unit`.
    #[serde(default)]
    pub value: Option<f64>,
    /// As in `effects.md`.
    #[serde(default)]
    pub unit: Option<String>,
    /// 95 % interval.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
}

/// A hypothesis of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Its kind; may be `unknown`.
    pub kind: String,
    /// Where.
    #[serde(default)]
    pub location: Option<Place>,
    /// That it is this one.
    #[serde(default)]
    pub probability: f64,
}

/// Whether something is left.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unknown {
    /// Something is.
    #[serde(default)]
    pub present: bool,
}

/// Diagnoses a case: what `kincal diagnose --json` prints, of which a [`Verdict`] is read; why it could not, in words, where it could
/// not. Kinds in [`Case::withheld`] must not be used.
pub type Diagnose = fn(&Case) -> Result<serde_json::Value, String>;

/// The trivial baseline: nothing is ever wrong.
///
/// # Errors
/// None that a verdict could cause.
pub fn nothing(_: &Case) -> Result<serde_json::Value, String> {
    serde_json::to_value(nothing_at_all()).map_err(|error| error.to_string())
}

/// The verdict that nothing is wrong.
#[must_use]
pub fn nothing_at_all() -> Verdict {
    Verdict {
        verdict: "no_gap".to_owned(),
        effects: Vec::new(),
        confusion_sets: Vec::new(),
        unknown: Unknown::default(),
        gap: None,
    }
}

/// What whoever knows the truth would say: every known effect at its place with its magnitude, and that the others are unknown.
#[must_use]
pub fn oracle(truth: &CaseTruth, withheld: &[String]) -> Verdict {
    let named = truth.effects.iter().filter(|effect| effect.known && !withheld.contains(&effect.kind));
    let effects: Vec<NamedEffect> = named
        .map(|effect| NamedEffect {
            kind: effect.kind.clone(),
            location: Place { level: level(effect.location.level), index: effect.location.index, time_s: change(effect, truth) },
            probability: 1.0,
            magnitude: Some(Magnitude {
                value: Some(effect.magnitude),
                unit: Some(effect.unit.clone()),
                ci95: Some([0.99 * effect.magnitude, 1.01 * effect.magnitude]),
            }),
        })
        .collect();
    let present = effects.len() < truth.effects.len();
    let verdict = match (present, effects.is_empty()) {
        (true, _) => "unknown_remains",
        (false, true) => "no_gap",
        (false, false) => "explained",
    };
    Verdict { verdict: verdict.to_owned(), effects, confusion_sets: Vec::new(), unknown: Unknown { present }, gap: None }
}

/// When a step happens, s.
fn change(effect: &TrueEffect, truth: &CaseTruth) -> Option<f64> {
    Some(effect.after? * truth.session_s?)
}

/// The name of a level.
pub(super) fn level(level: crate::effects::Level) -> String {
    serde_json::to_value(level).ok().and_then(|level| level.as_str().map(str::to_owned)).unwrap_or_default()
}
