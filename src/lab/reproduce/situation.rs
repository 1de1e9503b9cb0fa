//! Cells in which a calibration may find itself: what the sensor sees, how far the joints may turn, what is not modelled.
//!
//! The cell around an arm is that of a laser tracker: 15 µm + 6 µm/m, with a probe for the orientation of 0.003°. Every length of the
//! true arm is wrong by up to ±1 mm, every angle by up to ±0.2°.

use nalgebra::Point3;
use serde::Serialize;

use super::arms::cut;
use crate::measurement::Weights;
use crate::measurement::{Sensor, View};
use crate::scene::Scene;
use crate::simulation::effect::{Effect, Foot, Growing};
use crate::simulation::injected::{Injected, Noise};
use crate::simulation::plan::{Temperature, ThermalProfile};

/// Half of what a joint may turn about the middle of its range where joints are limited, rad.
const LIMITED_RAD: f64 = std::f64::consts::FRAC_PI_3;
/// Half angle of the cone that a tracker sees, rad.
const CONE_RAD: f64 = 12.0 * std::f64::consts::PI / 180.0;

/// What the sensor reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sees {
    /// Position and orientation.
    Pose,
    /// Position only.
    Position,
}

/// Which configurations may be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// All that the arm can take.
    Free,
    /// Joints within ±60° of the middle of their ranges, for the verification too.
    Limited,
    /// Those whose end point the tracker sees: a cone of ±12°. The verification is everywhere.
    Cone,
}

/// A situation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Situation {
    /// What the sensor reads.
    pub sees: Sees,
    /// Which configurations may be measured.
    pub reach: Reach,
    /// Whether joints have play (30 µm and 100 µrad in the second and the fourth) and links warm and cool by up to 10 K, which the model
    /// does not know.
    pub effects: bool,
    /// Configurations that are measured.
    pub count: usize,
}

impl Situation {
    /// The scene of this situation with the arm of `base`.
    #[must_use]
    pub fn scene(self, base: &Scene) -> Scene {
        let mut scene = base.clone();
        let position = Point3::new(2.2, 0.6, 0.4);
        scene.sensor = Sensor {
            position_in_base: position,
            position_sigma_m: 15e-6,
            position_sigma_per_m: 6e-6,
            orientation_sigma_rad: (self.sees == Sees::Pose).then_some(0.003 * std::f64::consts::PI / 180.0),
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: (self.reach == Reach::Cone)
                .then(|| View { towards_in_base: Point3::new(0.4, 0.0, 0.5), half_angle_rad: CONE_RAD }),
        };
        if self.reach == Reach::Limited {
            scene.arm = cut(&scene.arm, LIMITED_RAD);
        }
        scene.weights = Weights::Noise;
        scene.design.count = self.count;
        scene.plan.held_out_count = 30;
        scene.plan.held_out_exact = true;
        scene.plan.temperature = self.effects.then(|| warmth(scene.arm.joint_count()));
        scene
    }

    /// What is hidden in it.
    #[must_use]
    pub fn injected(self, base: &Scene) -> Injected {
        let joints = base.arm.joint_count();
        let clearance = |joint| Effect::Clearance { joint, radial: 30e-6, axial: 10e-6, tilt: 100e-6, held: None };
        // The foot is of steel, the links of aluminium.
        let foot = Effect::LinkThermalGrowth { of: Growing::Arm(Foot::Own), expansion: 12e-6 };
        let links = (0..joints).map(|link| Effect::LinkThermalGrowth { of: Growing::Link(link), expansion: 11e-6 });
        let play = [1, 3].into_iter().filter(|joint| *joint < joints).map(clearance);
        Injected {
            seed: "0f4d1c6be28a73955b1e90d7c3a64f82".to_owned(),
            length_error_m: 1e-3,
            angle_error_rad: 0.2 * std::f64::consts::PI / 180.0,
            parameter_errors: Vec::new(),
            effects: if self.effects { play.chain([foot]).chain(links).collect() } else { Vec::new() },
            noise: Noise::Declared { factor: 1.0 },
        }
    }

    /// In words, without the count.
    #[must_use]
    pub fn words(self) -> String {
        let sees = match self.sees {
            Sees::Pose => "pose",
            Sees::Position => "position",
        };
        let reach = match self.reach {
            Reach::Free => "joints free",
            Reach::Limited => "joints ±60°",
            Reach::Cone => "cone ±12°",
        };
        format!("{sees}, {reach}, effects {}", if self.effects { "on" } else { "off" })
    }
}

/// Links that warm and cool: most where the large motors are, least at the base and the tool.
fn warmth(joints: usize) -> Temperature {
    let along = |link: usize| link as f64 / (joints + 1) as f64;
    Temperature {
        profile: ThermalProfile::HeatAndCool,
        rise_k: (0..=joints).map(|link| 3.0 + 7.0 * libm::sin(std::f64::consts::PI * along(link))).collect(),
        lag_s: vec![0.0; joints + 1],
        ambient_rise_k: 0.0,
    }
}
