//! What a diagnosis says: the JSON object of `kincal diagnose --json`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::held_out::Block;
use super::settings::Settings;
pub use crate::effects::Parameters;
use crate::effects::signature::shape::{Displacement, Reading, Shape};
use crate::effects::{Kind, Level};

/// What causes what the calibration leaves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// In one word.
    pub verdict: Verdict,
    /// In one sentence.
    pub sentence: String,
    /// Noise of the sensor, one sigma per axis.
    pub noise_floor: NoiseFloor,
    /// 3-D position RMS on held-out poses.
    pub gap: Gap,
    /// What is named, in the order added.
    pub effects: Vec<Effect>,
    /// What cannot be told apart.
    pub confusion_sets: Vec<Vec<Candidate>>,
    /// What this data set would not show.
    pub undetectable: Vec<Undetectable>,
    /// Smallest magnitude that this data set would show, of everything else.
    pub detectable: Vec<Undetectable>,
    /// What no effect explains.
    pub unknown: Unknown,
    /// What remains over the workspace: by joint angle, the mean residual along the joint's motion.
    pub maps: Vec<Map>,
    /// What to measure next.
    pub next_measurements: Vec<String>,
    /// What was assumed, switched off, thinned out or left out.
    pub notes: Vec<String>,
    /// Gravity in the root frame, m/s², where the readings have told and not the robot's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity_m_s2: Option<[f64; 3]>,
    /// Number of readings used.
    pub readings: usize,
    /// Every number that decided, where they are not as usual or the version is another.
    #[serde(default)]
    pub settings: Settings,
    /// Reading by reading, what is left before and after the causes, and which cause took most of it.
    pub residuals: Vec<Residual>,
}

/// What is left of a reading once geometry is fitted to all of them, without the causes and with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Residual {
    /// Row of the input, from 0.
    pub row: usize,
    /// Measured position in the measurement frame, m.
    pub position_m: [f64; 3],
    /// Measured minus predicted by geometry alone, in the measurement frame, m.
    pub before_m: [f64; 3],
    /// The same with geometry and all causes (also those without a name) fitted together, m.
    pub after_m: [f64; 3],
    /// Position in `effects` of the cause that moves this reading most beyond what geometry absorbs; absent where it is none of them.
    pub cause: Option<usize>,
}

/// The answer in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Geometry explains everything, and what is realistic would have shown.
    NoGap,
    /// The effects named explain everything.
    Explained,
    /// Something is there, and several hypotheses explain it as well.
    Ambiguous,
    /// Something is there that no effect of the library explains.
    UnknownRemains,
    /// Nothing is seen, but little could have been.
    NotDetectable,
}

/// Noise of the sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NoiseFloor {
    /// Of a position, m.
    pub position_m: f64,
    /// Of an orientation, rad; absent where none are measured.
    pub rotation_rad: Option<f64>,
    /// Where it comes from.
    pub source: NoiseSource,
}

/// Where the noise floor comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSource {
    /// Readings of the same configuration under the same conditions.
    Repeats,
    /// A data sheet, or the command line.
    Declared,
    /// Nothing: a usual value.
    Assumed,
}

/// 3-D position RMS on held-out poses, m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gap {
    /// Base and tool fitted only, m.
    pub nominal_rms_m: f64,
    /// All geometry fitted, m.
    pub geometry_rms_m: f64,
    /// Geometry and what each fold uses of what was chosen for it, m.
    pub explained_rms_m: f64,
    /// Noise floor in 3-D, m.
    pub noise_rms_m: f64,
    /// Share of the gap between geometry and noise that the effects close.
    pub gap_closed: Option<f64>,
    /// Its 95 % interval, from the folds.
    pub gap_closed_ci95: Option<[f64; 2]>,
    /// Folds, blocked by region of the workspace.
    pub folds: usize,
    /// The same with whole payloads and whole sessions left out, where there are several.
    pub blocked: Vec<Blocked>,
}

/// 3-D position RMS on held-out poses in another way of leaving out, m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Blocked {
    /// What the rows of a fold share.
    pub by: Block,
    /// Folds.
    pub folds: usize,
    /// Base and tool fitted only, m.
    pub nominal_rms_m: f64,
    /// All geometry fitted, m.
    pub geometry_rms_m: f64,
    /// Geometry and what each fold uses of what was chosen for it, m.
    pub explained_rms_m: f64,
    /// Fold by fold.
    pub left_out: Vec<LeftOut>,
}

/// What was left out together, and how well the rest predicts it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOut {
    /// The payload or the session.
    pub name: String,
    /// Readings.
    pub readings: usize,
    /// 3-D position RMS with geometry from the rest, m.
    pub geometry_rms_m: f64,
    /// With geometry and what is used of what the rest chose, m.
    pub explained_rms_m: f64,
}

/// Where an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// What it belongs to.
    pub level: Level,
    /// Number of the joint or link, from 1; absent where there is none.
    #[schemars(range(min = 1))]
    pub index: Option<usize>,
    /// Change point, s (row of the input where that has no times).
    pub time_s: Option<f64>,
    /// Of a change, the first row of the input after it, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row: Option<usize>,
}

impl Place {
    /// A place at which nothing changes.
    #[must_use]
    pub const fn of(level: Level, index: Option<usize>) -> Place {
        Place { level, index, time_s: None, row: None }
    }

    /// When it changes, in words: by rows where the input has no times.
    #[must_use]
    pub fn when(&self) -> Option<String> {
        match (self.time_s, self.row) {
            (Some(time), Some(row)) if time == row as f64 => Some(format!("reading {}", row + 1)),
            (Some(time), _) => Some(format!("{time:.0} s")),
            (None, _) => None,
        }
    }
}

/// A magnitude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Magnitude {
    /// Positive where the kind has no sign.
    pub value: f64,
    /// SI.
    pub unit: String,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// What a named effect was diagnosed to follow: true = reading + sum of coefficient times column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Signature {
    /// The shape that won, of all variants of its kind.
    #[serde(flatten)]
    pub shape: Shape,
    /// Of each of its columns, SI.
    pub coefficients: Vec<f64>,
}

impl Signature {
    /// What it does to the target of `reading`: shift (m) and turn (rad), in root. `None` where the reading lacks what it follows.
    /// `orientation`: whether orientations are measured.
    #[must_use]
    pub fn displacement(&self, reading: &Reading, orientation: bool) -> Option<Displacement> {
        if !self.shape.can_be_read(reading) {
            return None;
        }
        let columns = self.shape.columns(reading, orientation);
        let of = |axis: usize| columns.iter().zip(&self.coefficients).map(|(column, value)| column[axis] * value).sum();
        Some(std::array::from_fn(of))
    }
}

/// A kind, or `unknown` for what has no name.
mod kind_or_unknown {
    use schemars::{Schema, SchemaGenerator, json_schema};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::effects::Kind;

    pub(super) const UNKNOWN: &str = "unknown";

    pub(super) fn schema(_: &mut SchemaGenerator) -> Schema {
        let names: Vec<&str> = Kind::ALL.into_iter().map(Kind::name).chain([UNKNOWN]).collect();
        json_schema!({ "type": "string", "enum": names })
    }

    pub(super) fn serialize<S: Serializer>(kind: &Option<Kind>, serializer: S) -> Result<S::Ok, S::Error> {
        kind.map_or(UNKNOWN, Kind::name).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Kind>, D::Error> {
        let name = String::deserialize(deserializer)?;
        if name == UNKNOWN {
            return Ok(None);
        }
        Kind::from_name(&name).map(Some).ok_or_else(|| serde::de::Error::custom(format!("no kind {name:?}")))
    }
}

/// An effect that is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Effect {
    /// Kind.
    pub kind: Kind,
    /// Where.
    pub location: Place,
    /// That it is there.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probability: f64,
    /// How large.
    pub magnitude: Magnitude,
    /// What else it takes to make it happen.
    pub parameters: Parameters,
    /// What it follows; absent for outliers, and in recordings that were made before it was kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signature: Option<Signature>,
    /// 3-D RMS on held-out poses before it was added, m.
    pub held_out_rms_before_m: f64,
    /// And after, m.
    pub held_out_rms_after_m: f64,
    /// Share of the gap to the noise that it closes: 1 − (after² − σ²)/(before² − σ²).
    pub gap_closed: Option<f64>,
    /// How many folds chose it, of how many.
    pub folds: [usize; 2],
    /// What else it has.
    pub detail: String,
}

/// A hypothesis of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Candidate {
    /// Kind; `None` (written `unknown`) for a shape without a name.
    #[serde(with = "kind_or_unknown")]
    #[schemars(schema_with = "kind_or_unknown::schema")]
    pub kind: Option<Kind>,
    /// Where.
    pub location: Place,
    /// That it is this one.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probability: f64,
    /// What it is, for a shape without a name.
    pub detail: String,
}

impl Candidate {
    /// Its kind's name, or `unknown`.
    #[must_use]
    pub fn kind_name(&self) -> &'static str {
        self.kind.map_or(kind_or_unknown::UNKNOWN, Kind::name)
    }
}

/// A hypothesis that this data set would show from some magnitude on, or not at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Undetectable {
    /// Kind.
    pub kind: Kind,
    /// Where.
    pub location: Place,
    /// Smallest magnitude that would be named in four cases of five.
    pub minimum_detectable: MinimumDetectable,
    /// Why; empty where it is detectable.
    pub reason: String,
}

/// A least magnitude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MinimumDetectable {
    /// Absent where no magnitude would show.
    pub value: Option<f64>,
    /// SI.
    pub unit: String,
}

/// What no effect explains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unknown {
    /// Something is left.
    pub present: bool,
    /// Of the residual having no structure, all tests together.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub p_value: f64,
    /// Where it shows.
    pub r#where: Option<String>,
}

/// Mean residual along a joint's motion, by its angle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Map {
    /// Number of the joint, from 1.
    #[schemars(range(min = 1))]
    pub joint: usize,
    /// Middle of each bin, rad (m).
    pub angle: Vec<f64>,
    /// Mean of the residual, as an angle of the joint, rad (m).
    pub mean: Vec<f64>,
    /// Its standard error.
    pub standard_error: Vec<f64>,
}
