//! A joint is off by half a unit in the direction of its torque; an upright joint, which has none, in that of the torque that it would
//! have if its axis leant.

use std::num::NonZeroUsize;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::effects::signature::library::{Hypothesis, Site};
use crate::effects::signature::shape::{
    Coefficients, Displacement, Follows, Form, Named, Reading, Recorded, Shape, Size, across, from_one, little, seated,
};
use crate::effects::{Kind, Parameters, Values};

/// Shares of the load that friction may hold where only a lean seats the play: far more than where the load itself does.
const LEANING_HELD: [f64; 5] = [0.0, 0.08, 0.16, 0.24, 0.32];
/// Azimuths in which gravity may lean.
const LEANS: usize = 24;
/// Share of the largest torque below which nobody knows on which side a leaning joint's play is seated: the azimuth of the lean is
/// known to half a step between those that are tried.
const LEAN_EDGE: f64 = 0.1;

/// \[1\] A joint is off by half a unit in the direction of its torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TorqueSign {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
}

impl Follows for TorqueSign {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let joint = self.joint;
        let posture = &reading.posture;
        let effort = reading.effort(joint);
        let sigma = if reading.slides[joint] { posture.force_sigma(joint) } else { posture.moment_sigma(joint) };
        vec![reading.moved(joint, 0.5 * effort / libm::hypot(effort, sigma).max(1e-9))]
    }
}

impl Named for TorqueSign {
    fn undecided(&self, reading: &Reading) -> bool {
        let joint = self.joint;
        let posture = &reading.posture;
        let (sigma, all) = if reading.slides[joint] {
            (posture.force_sigma(joint), posture.forces[joint].norm())
        } else {
            (posture.moment_sigma(joint), posture.moments[joint].norm())
        };
        little(reading.effort(joint).abs(), sigma, all)
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, of: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Ok(vec![Values { width: of.at(0)?, ..Values::default() }])
    }
}

/// \[1\] As [`Shape::TorqueSign`], where gravity is not along the nominal direction but leans towards an azimuth about the joint's axis:
/// what decides the side that an upright joint's play is seated on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeaningTorqueSign {
    /// Joint, or the link that it moves.
    #[serde(with = "from_one")]
    #[schemars(with = "NonZeroUsize")]
    pub joint: usize,
    /// rad, from the first axis across ([`across`]).
    pub azimuth: f64,
    /// Friction holds the play in the middle where the lever towards which gravity leans carries less than this share of the force
    /// times the length of the arm outboard.
    pub held: f64,
}

impl Follows for LeaningTorqueSign {
    fn form(&self, _: bool) -> Form {
        Form { columns: 1, of_magnitude: 1, size: Size::Length, needs: Recorded::Pose, unnamed: None }
    }

    fn columns(&self, reading: &Reading, _: bool) -> Vec<Displacement> {
        let LeaningTorqueSign { joint, azimuth, held } = *self;
        let posture = &reading.posture;
        // First moment of the mass outboard, across gravity; where gravity leans towards `lean` the torque follows `lean · lever`.
        let gravity = reading.gravity;
        let lever = gravity.cross(&posture.moments[joint]) / gravity.norm().max(1e-12);
        let (x, y) = across(&posture.axes[joint]);
        let lean = x * libm::cos(azimuth) + y * libm::sin(azimuth);
        let all = posture.forces[joint].norm() * posture.reaches[joint];
        let seat = seated(lean * lean.dot(&lever), LEAN_EDGE * lever.norm(), held * all);
        vec![reading.moved(joint, 0.5 * lean.dot(&seat))]
    }
}

impl Named for LeaningTorqueSign {
    fn undecided(&self, reading: &Reading) -> bool {
        let [x, y, z, ..] = self.columns(reading, false)[0];
        let [a, b, c, ..] = reading.moved(self.joint, 0.5);
        Vector3::new(x, y, z).norm() < 0.9 * Vector3::new(a, b, c).norm()
    }

    fn parameters(&self, _: Coefficients<'_>) -> Parameters {
        Parameters::default()
    }

    fn values(&self, _: Coefficients<'_>) -> Result<Vec<Values>, String> {
        Err("an upright joint seated by an axis that leans: the arm is simulated as it stands in its file".to_owned())
    }
}

pub(in crate::effects) fn hypotheses(site: &Site<'_>, all: &mut Vec<Hypothesis>) {
    let Some(joint) = site.place else {
        return;
    };
    let seated = site.hypothesis(Kind::GravityLostMotion, Shape::TorqueSign(TorqueSign { joint }));
    all.push(seated.clone());
    if site.turns() && site.columns.upright[joint] {
        for (step, held) in (0..LEANS).flat_map(|step| LEANING_HELD.map(|held| (step, held))) {
            let azimuth = step as f64 * std::f64::consts::TAU / LEANS as f64;
            let shape = Shape::LeaningTorqueSign(LeaningTorqueSign { joint, azimuth, held });
            let detail = format!("seated as if the axis leant towards {:.0}°", azimuth.to_degrees());
            all.push(Hypothesis { shape, detail, ..seated.clone() });
        }
    }
}
