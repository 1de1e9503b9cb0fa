//! JSON forms of the source messages: those of the events themselves but where a viewer needs another.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::design::outcome::{Advice, DesignOutcome, EvennessDomains, RandomReference, SearchStep, StopReason, SwarmIteration};
use crate::diagnosis::outcome::Diagnosis;
use crate::event::Start;
use crate::identification::outcome::Identification;
use crate::measurement::Measurement;
use crate::quality::Indexes;

/// What a source message on a JSON topic holds.
pub(super) trait Source: PartialEq + Sized {
    /// Writes it as JSON.
    ///
    /// # Errors
    /// If JSON cannot hold it.
    fn to_json(&self) -> serde_json::Result<Vec<u8>>;

    /// Reads it back, without what is recorded elsewhere.
    ///
    /// # Errors
    /// If `data` is something else.
    fn from_json(data: &[u8]) -> serde_json::Result<Self>;

    /// Whether `restored` is what was written.
    fn is_same(&self, restored: &Self) -> bool {
        self == restored
    }
}

/// Events whose JSON is that of the `--json` option.
macro_rules! as_it_is {
    ($($event:ty),*) => {$(
        impl Source for $event {
            fn to_json(&self) -> serde_json::Result<Vec<u8>> {
                serde_json::to_vec(self)
            }

            fn from_json(data: &[u8]) -> serde_json::Result<Self> {
                serde_json::from_slice(data)
            }
        }
    )*};
}

/// Events whose JSON is that of a form below.
macro_rules! as_form {
    ($($event:ident, $form:ident { $($more:item)* })*) => {$(
        impl Source for $event {
            fn to_json(&self) -> serde_json::Result<Vec<u8>> {
                let mut data = Vec::new();
                $form::serialize(self, &mut serde_json::Serializer::new(&mut data))?;
                Ok(data)
            }

            fn from_json(data: &[u8]) -> serde_json::Result<Self> {
                let mut reader = serde_json::Deserializer::from_slice(data);
                let event = $form::deserialize(&mut reader)?;
                reader.end()?;
                Ok(event)
            }

            $($more)*
        }
    )*};
}

as_it_is!(Start, Measurement, Identification);
as_form! {
    SwarmIteration, SwarmForm {
        fn is_same(&self, restored: &Self) -> bool {
            // The end points are in a cloud of their own.
            *self == SwarmIteration { end_points: self.end_points.clone(), ..restored.clone() }
        }
    }
    SearchStep, SearchForm {}
    DesignOutcome, DesignForm {}
}

/// As `kincal diagnose --json`, but that what is absent is not written, and confusion sets are objects: Foxglove takes neither types
/// that may be null nor arrays of arrays.
impl Source for Diagnosis {
    fn to_json(&self) -> serde_json::Result<Vec<u8>> {
        let mut value = serde_json::to_value(self)?;
        drop_null(&mut value);
        if let Some(sets) = value.get_mut(SETS).and_then(Value::as_array_mut) {
            sets.iter_mut().for_each(|set| *set = json!({ CANDIDATES: set.take() }));
        }
        serde_json::to_vec(&value)
    }

    fn from_json(data: &[u8]) -> serde_json::Result<Self> {
        let mut value: Value = serde_json::from_slice(data)?;
        if let Some(sets) = value.get_mut(SETS).and_then(Value::as_array_mut) {
            sets.iter_mut().for_each(|set| *set = set.get_mut(CANDIDATES).map(Value::take).unwrap_or_default());
        }
        serde_json::from_value(value)
    }
}

pub(super) const SETS: &str = "confusion_sets";
pub(super) const CANDIDATES: &str = "candidates";

/// `value` as JSON without the members of objects that are null.
pub(super) fn without_null(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut value = serde_json::to_value(value)?;
    drop_null(&mut value);
    serde_json::to_vec(&value)
}

/// Takes out the members of objects that are null.
fn drop_null(value: &mut Value) {
    match value {
        Value::Object(members) => {
            members.retain(|_, member| !member.is_null());
            members.values_mut().for_each(drop_null);
        }
        Value::Array(items) => items.iter_mut().for_each(drop_null),
        _ => {}
    }
}

/// Configurations as objects: Foxglove shows no arrays of arrays.
mod configurations {
    use std::borrow::Cow;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Configuration<'a> {
        joints: Cow<'a, [f64]>,
    }

    pub(super) fn serialize<S: Serializer>(configurations: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(configurations.iter().map(|joints| Configuration { joints: Cow::Borrowed(joints) }))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
        let configurations = Vec::<Configuration<'static>>::deserialize(deserializer)?;
        Ok(configurations.into_iter().map(|configuration| configuration.joints.into_owned()).collect())
    }
}

/// [`SwarmIteration`] without its end points.
#[derive(Serialize, Deserialize)]
#[serde(remote = "SwarmIteration")]
struct SwarmForm {
    iteration: usize,
    iterations: usize,
    fitness: Vec<f64>,
    personal_best: Vec<f64>,
    best_particle: usize,
    best: Indexes,
    inertia: f64,
    c1: f64,
    c2: f64,
    evaluations: u64,
    rejections: u64,
    #[serde(skip)]
    end_points: Vec<Vec<[f32; 3]>>,
    #[serde(with = "configurations")]
    best_configurations: Vec<Vec<f64>>,
}

/// [`SearchStep`].
#[derive(Serialize, Deserialize)]
#[serde(remote = "SearchStep")]
struct SearchForm {
    step: usize,
    evaluations: u64,
    budget: u64,
    rejections: u64,
    value: f64,
    best: f64,
    #[serde(with = "configurations")]
    best_configurations: Vec<Vec<f64>>,
}

/// [`DesignOutcome`].
#[derive(Serialize, Deserialize)]
#[serde(remote = "DesignOutcome")]
struct DesignForm {
    method: String,
    criterion: String,
    value: f64,
    #[serde(with = "configurations")]
    configurations: Vec<Vec<f64>>,
    indexes: Indexes,
    indexes_all_parameters: Indexes,
    evenness_domains: EvennessDomains,
    random: RandomReference,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    advice: Option<Advice>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    no_advice: Option<String>,
    dropped_parameters: Vec<String>,
    evaluations: u64,
    rejections: u64,
    stop: StopReason,
}
