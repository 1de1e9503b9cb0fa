//! The truth of one run: what was drawn from the scene's hidden part, and what the physics made of it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::arm::{JointKind, Quantity};
use crate::effects::{Level, Unit};
use crate::seed::{Stream, hidden_key, hidden_stream};
use crate::simulation::effect::{Described, Effect};
use crate::simulation::injected::Injected;
use crate::simulation::physics::{Seat, SeatedBy, Settled, Yield};

/// True parameters and the poses as they were before the sensor read them. Written to a file of its own, never to the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// True value of every parameter.
    pub parameters: Vec<TrueParameter>,
    /// What happens to the arm, its cell and its sensor besides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<TrueEffect>,
    /// True poses in the order of measuring.
    pub poses: Vec<TruePose>,
}

/// An effect by its kind, place and magnitudes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueEffect {
    /// Name of the kind; `clearance` may be radial and tilting in one.
    pub kind: String,
    /// What it belongs to.
    pub level: Level,
    /// Number of the joint or link, from 1; none for the whole arm and for what has no number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Its magnitude in the convention of [`crate::effects::Kind::unit`].
    pub magnitude: f64,
    /// Unit of the magnitude.
    pub unit: String,
    /// What else describes it, by name, SI.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub more: BTreeMap<String, f64>,
}

impl TrueEffect {
    fn new(arm: &Arm, effect: &Effect) -> Self {
        let location = effect.location();
        let Described { kinds, place, size, moves_joint, more, .. } = effect.described();
        let slides = place.and_then(|joint| arm.chain.joints.get(joint)).is_some_and(|joint| joint.kind != JointKind::Revolute);
        // Of a clearance, the play whose size it is; one along the axis alone has no kind.
        let unit = kinds.first().map_or(Unit::Metre, |kind| kind.descriptor().unit);
        let unit = match unit {
            Unit::Radian if moves_joint && slides => "m",
            Unit::RadianPerNewtonMetre if moves_joint && slides => "m/N",
            unit => unit.name(),
        };
        TrueEffect {
            kind: effect.name().to_owned(),
            level: location.level,
            number: location.index,
            magnitude: size,
            unit: unit.to_owned(),
            more: more.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
        }
    }
}

/// A parameter's true value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueParameter {
    /// As in the chain.
    pub name: String,
    /// Nominal value, SI.
    pub nominal: f64,
    /// True value, SI.
    pub true_value: f64,
    /// `m` or `rad`.
    pub unit: String,
}

/// A true pose and how it settled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruePose {
    /// Index of the measurement.
    pub index: usize,
    /// Origin of the tool in base, m.
    pub position_m: [f64; 3],
    /// Orientation as quaternion x, y, z, w.
    #[serde(rename = "attitude_xyzw")]
    pub orientation_xyzw: [f64; 4],
    /// Rise of each link over the reference temperature, K.
    pub rise_k: Vec<f64>,
    /// How far the origin may still be from rest, m.
    pub settling_error_m: f64,
    /// The same for the orientation, rad.
    pub settling_error_rad: f64,
    /// Simulated steps.
    pub settling_steps: usize,
    /// Simulated time, s.
    pub settling_time_s: f64,
    /// Whether it settled within the tolerances.
    pub settled: bool,
    /// Where each joint with clearance lies.
    pub seats: Vec<TrueSeat>,
    /// How far joints and links yield.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub yields: Vec<TrueYield>,
}

/// Where a coordinate in which a joint or its link yields came to rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueYield {
    /// Joint, from 1.
    pub joint: usize,
    /// Name of the effect. Bending has three at a place: half of what turns about the link's x, what turns about y, the
    /// other half.
    pub effect: String,
    /// rad, or m where the joint slides.
    pub value: f64,
    /// Whether no load decides it: friction holds it.
    pub by_friction: bool,
}

impl TrueYield {
    fn new(of: &Yield) -> Self {
        let by_friction = of.by == SeatedBy::Friction;
        TrueYield { joint: of.joint + 1, effect: of.effect.to_owned(), value: of.value, by_friction }
    }
}

/// Where a joint lies in its clearance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrueSeat {
    /// Joint, from 1.
    pub joint: usize,
    /// Across the axis, m.
    pub radial_m: [f64; 2],
    /// Along the axis, m.
    pub axial_m: f64,
    /// Tilt, rad.
    pub tilt_rad: [f64; 2],
    /// Which of `radial`, `axial`, `tilt` no load decides: friction holds these in the middle.
    pub undecided: Vec<String>,
}

impl TruePose {
    pub(super) fn new(index: usize, settled: &Settled, rise_k: Vec<f64>) -> Self {
        let q = settled.base_from_tool.rotation.quaternion();
        TruePose {
            index,
            position_m: settled.base_from_tool.translation.vector.into(),
            orientation_xyzw: [q.i, q.j, q.k, q.w],
            rise_k,
            settling_error_m: settled.settling_error_m,
            settling_error_rad: settled.settling_error_rad,
            settling_steps: settled.steps,
            settling_time_s: settled.simulated_time_s,
            settled: settled.converged,
            seats: settled.seats.iter().filter(|seat| has_play(seat)).map(TrueSeat::new).collect(),
            yields: settled.yields.iter().map(TrueYield::new).collect(),
        }
    }
}

fn has_play(seat: &Seat) -> bool {
    [seat.radial_by, seat.axial_by, seat.tilt_by].iter().any(|by| *by != SeatedBy::Fit)
}

impl TrueSeat {
    fn new(seat: &Seat) -> Self {
        let kinds = [("radial", seat.radial_by), ("axial", seat.axial_by), ("tilt", seat.tilt_by)];
        TrueSeat {
            joint: seat.joint + 1,
            radial_m: seat.radial_in_joint,
            axial_m: seat.axial_in_joint,
            tilt_rad: seat.tilt_in_joint,
            undecided: kinds.iter().filter(|(_, by)| *by == SeatedBy::Friction).map(|(kind, _)| (*kind).to_owned()).collect(),
        }
    }
}

/// Stream of everything hidden in a run: whoever knows the recording knows `public_seed`, but not the scene's hidden one.
#[must_use]
pub fn stream(injected: &Injected, public_seed: u64, label: &str) -> Stream {
    hidden_stream(&hidden_key(&injected.seed, public_seed), label)
}

/// True parameters: nominal plus errors drawn uniformly within the scene's ranges, or as the scene gives them by name.
#[must_use]
pub fn parameters(arm: &Arm, injected: &Injected, public_seed: u64) -> Vec<TrueParameter> {
    let mut stream = stream(injected, public_seed, "truth/parameters");
    arm.chain
        .parameters
        .iter()
        .map(|parameter| {
            let half_width = match parameter.quantity {
                Quantity::Length => injected.length_error_m,
                Quantity::Angle => injected.angle_error_rad,
            };
            // Drawn for every parameter, so that giving one by name does not shift the others.
            let drawn = stream.uniform(-half_width, half_width);
            let given = injected.parameter_errors.iter().find(|(name, _)| *name == parameter.name);
            TrueParameter {
                name: parameter.name.clone(),
                nominal: parameter.nominal,
                true_value: parameter.nominal + given.map_or(drawn, |(_, error)| *error),
                unit: parameter.quantity.unit().to_owned(),
            }
        })
        .collect()
}

/// What `effects` are, where, and how large.
#[must_use]
pub fn described(arm: &Arm, effects: &[Effect]) -> Vec<TrueEffect> {
    effects.iter().map(|effect| TrueEffect::new(arm, effect)).collect()
}
