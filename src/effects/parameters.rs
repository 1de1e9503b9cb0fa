//! What a diagnosis says of an effect besides kind, place and magnitude.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a simulation of an effect needs besides kind, place and magnitude; absent where the kind has no such thing. As fitted to all
/// readings: true = reading + effect. Root is the arm's first frame, where its base stands nominally.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameters {
    /// Of a backlash: −1 where the output lags behind the last move, as play makes it; 1 where it leads.
    pub sign: Option<f64>,
    /// Of a harmonic: the error is magnitude · cos(order · q + phase), rad.
    pub phase_rad: Option<f64>,
    /// Of a harmonic: periods per turn of the joint.
    pub order: Option<f64>,
    /// Of a coupling: the joint whose angle counts, from 1; the joint itself where its ratio is off.
    #[schemars(range(min = 1))]
    pub source: Option<usize>,
    /// Of base (in root; of a drift, over the whole session) or tool (in the tool frame), m. The magnitude is its length, less what
    /// noise adds to a length.
    pub translation_m: Option<[f64; 3]>,
    /// With it: rotation vector about the origin of the same frame, rad; zero where only positions of a tool are measured.
    pub rotation_rad: Option<[f64; 3]>,
    /// Of a step: share of the session (0 to 1) after which it happens, midway between two readings.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub after: Option<f64>,
    /// Of a step: place in the order of time, from 0, of the first reading after it.
    pub row: Option<usize>,
    /// Of outliers: their noise over that of the others.
    pub factor: Option<f64>,
    /// Of what goes on after a move: time over which it fades, s; zero where it is gone by the next reading.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_constant_s: Option<f64>,
    /// Of a map: the angles of the joint at which errors are given, rad; straight between them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles_rad: Option<Vec<f64>>,
    /// With them: what is to be added to the joint reading there, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub errors_rad: Option<Vec<f64>>,
    /// With them: one sigma of each; as large as is thought likely beforehand where no reading was near.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigmas_rad: Option<Vec<f64>>,
    /// Of a clearance: the share of the load (of the moment: over weight times length of the arm outboard) up to which friction holds
    /// the play in its middle.
    pub held: Option<f64>,
}
