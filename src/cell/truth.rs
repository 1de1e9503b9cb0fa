//! The truth of one run: what was drawn from the scene's hidden part, and what the physics made of it.

use serde::{Deserialize, Serialize};

use crate::arm::Arm;
use crate::kinematics::Quantity;
use crate::physics::{Clearance, Seat, SeatedBy, Settled};
use crate::scene::{Injected, ThermalProfile};
use crate::seed::{Stream, hidden_key, hidden_stream};

/// True parameters and the poses as they were before the sensor read them. Written to a file of its own, never to the recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// True value of every parameter.
    pub parameters: Vec<TrueParameter>,
    /// True poses in the order of measuring.
    pub poses: Vec<TruePose>,
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
    /// Attitude as quaternion x, y, z, w.
    pub attitude_xyzw: [f64; 4],
    /// Rise of each link over the reference temperature, K.
    pub rise_k: Vec<f64>,
    /// How far the origin may still be from rest, m.
    pub settling_error_m: f64,
    /// The same for the attitude, rad.
    pub settling_error_rad: f64,
    /// Simulated steps.
    pub settling_steps: usize,
    /// Simulated time, s.
    pub settling_time_s: f64,
    /// Whether it settled within the tolerances.
    pub settled: bool,
    /// Where each joint with clearance lies.
    pub seats: Vec<TrueSeat>,
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
            attitude_xyzw: [q.i, q.j, q.k, q.w],
            rise_k,
            settling_error_m: settled.settling_error_m,
            settling_error_rad: settled.settling_error_rad,
            settling_steps: settled.steps,
            settling_time_s: settled.simulated_time_s,
            settled: settled.converged,
            seats: settled.seats.iter().filter(|seat| has_play(seat)).map(TrueSeat::new).collect(),
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

/// Clearance of every joint.
#[must_use]
pub fn clearances(arm: &Arm, injected: &Injected) -> Vec<Clearance> {
    let mut clearances = vec![Clearance::NONE; arm.joint_count()];
    for clearance in &injected.clearances {
        clearances[clearance.joint] =
            Clearance { radial_m: clearance.radial_m, axial_m: clearance.axial_m, tilt_rad: clearance.tilt_rad };
    }
    clearances
}

/// Rise of every link (base first) over the reference temperature, K, at `share` (0 to 1) of the session.
#[must_use]
pub fn temperature_rise(arm: &Arm, injected: &Injected, share: f64) -> Vec<f64> {
    let Some(thermal) = &injected.thermal else {
        return vec![0.0; arm.links.len()];
    };
    let course = match thermal.profile {
        ThermalProfile::Constant => 1.0,
        ThermalProfile::WarmUp => share,
        ThermalProfile::HeatAndCool => libm::sin(std::f64::consts::PI * share),
    };
    thermal.rise_k.iter().map(|rise| rise * course).collect()
}

/// Growth of every link: 1 + expansion × rise.
#[must_use]
pub fn growth(injected: &Injected, rise_k: &[f64]) -> Vec<f64> {
    match &injected.thermal {
        Some(thermal) => thermal.expansion_per_k.iter().zip(rise_k).map(|(expansion, rise)| 1.0 + expansion * rise).collect(),
        None => vec![1.0; rise_k.len()],
    }
}
