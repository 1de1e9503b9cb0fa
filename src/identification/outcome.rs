//! The result of an identification: what `kincal identify --json` prints and what is recorded.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ladder::Rung;

/// The identified arm and how well it predicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identification {
    /// Whether the fit converged; the parameters mean nothing where it did not.
    pub converged: bool,
    /// Why the iterations ended, in words.
    pub reason: String,
    /// Gauss–Newton / Levenberg–Marquardt steps.
    pub iterations: usize,
    /// Dimension of the identifiable subspace.
    pub rank: usize,
    /// Residual components fitted.
    pub equations: usize,
    /// Root of the sum of squared residuals, each over its declared sigma, over the degrees of freedom: 1 where the declared noise
    /// explains the residuals. Absent where a noise is declared as zero, or nothing is left over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_scale: Option<f64>,
    /// Every parameter of the model, in column order.
    pub parameters: Vec<ParameterEstimate>,
    /// What is identifiable, one per independent parameter.
    pub combinations: Vec<Combination>,
    /// Errors of the nominal model on the fitted configurations.
    pub nominal: Errors,
    /// Errors of the identified model on the fitted configurations.
    pub fitted: Errors,
    /// Errors of the identified model on held-out configurations; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<Errors>,
    /// Errors of the nominal model on held-out configurations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out_nominal: Option<Errors>,
    /// How far a single reading of an exactly known pose would be off: the floor under every error above.
    pub declared_noise: DeclaredNoise,
    /// Whether nobody declared it, so that it is estimated from what is left.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub noise_estimated: bool,
    /// How far the joint frames of a real arm are off its file, in the terms of the joints themselves; empty for the arm of a scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_frames: Vec<JointFrame>,
    /// How much of the arm was let loose, and how good that is on readings that were left out; empty for the arm of a scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ladder: Vec<Rung>,
    /// Readings that are far off from what the others say, and were not used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// Residuals of every configuration, in the order of measuring.
    pub residuals: Vec<Residual>,
    /// What was assumed or left out.
    pub notes: Vec<String>,
}

/// How far the frame in which a joint moves is off its file. Of errors that the readings cannot tell apart these are the likeliest, given
/// how far frames are off by machining; standard errors say so, too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointFrame {
    /// Name of the joint.
    pub joint: String,
    /// Error of its zero: what must be added to the reading; rad, or m where it slides.
    pub zero: Deviation,
    /// `rad` or `m`.
    pub zero_unit: String,
    /// Shifts of the axis, m: along x and y of the joint's frame (whose z is the axis), and along the axis where the joint turns.
    pub shift_m: Vec<Deviation>,
    /// Turns of the axis about x and y of the joint's frame, rad; about the axis, too, where the joint slides.
    pub turn_rad: Vec<Deviation>,
}

/// A reading that was not used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOut {
    /// Index of the measurement.
    pub index: usize,
    /// How far its position is off, m.
    pub off_m: f64,
}

/// An estimate with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Deviation {
    /// Estimate, SI.
    pub estimate: f64,
    /// Standard error, SI.
    pub standard_error: f64,
}

/// One parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterEstimate {
    /// As in the chain: `alpha3`.
    pub name: String,
    /// Nominal value, SI.
    pub nominal: f64,
    /// Identified value, SI; the nominal one where the parameter was dropped.
    pub identified: f64,
    /// Standard error, SI; of the combination it stands for ([`Combination`]); absent where it was dropped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
    /// `m` or `rad`.
    pub unit: String,
    /// Whether it is held at its nominal value because other parameters stand in for it.
    pub dropped: bool,
}

/// An identifiable combination: an independent parameter together with the share of each dropped one that it takes up.
///
/// What is estimated, and what the interval is about, is the value that the independent parameters take while the dropped ones
/// stand at their nominal values and the arm's poses stay the same. To first order, at the solution, that is the expression.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Combination {
    /// Name of the independent parameter.
    pub name: String,
    /// `name + factor · other + …`, in words; factors at the solution.
    pub expression: String,
    /// Estimated change from nominal, SI.
    pub estimate: f64,
    /// Standard error, SI.
    pub standard_error: f64,
    /// 95 % confidence interval of the change, SI.
    pub interval95: [f64; 2],
    /// `m` or `rad`.
    pub unit: String,
}

/// Root of the mean squared length of the declared noise of the fitted configurations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeclaredNoise {
    /// Of a position (three axes), m.
    pub position_m: f64,
    /// Of an orientation (three axes), rad; absent where no orientation was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_rad: Option<f64>,
}

/// Errors over a set of configurations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Errors {
    /// Number of configurations.
    pub count: usize,
    /// Distance between measured and predicted origin, m.
    pub position_m: Summary,
    /// Angle between measured and predicted orientation, rad; absent where no orientation was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_rad: Option<Summary>,
}

/// Four numbers about a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Smallest.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// Largest.
    pub max: f64,
}

/// Measured minus predicted pose of one configuration, before and after.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Residual {
    /// Index of the measurement.
    pub index: usize,
    /// Measured origin, m.
    pub position_m: [f64; 3],
    /// Origin and rotation vector, measured minus nominal model (m, rad).
    pub nominal: [f64; 6],
    /// Origin and rotation vector, measured minus identified model (m, rad).
    pub identified: [f64; 6],
}
