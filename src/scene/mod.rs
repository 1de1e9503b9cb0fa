//! A scene: the arm, the sensor, the problem, and apart from them what is injected and hidden.

mod convert;
pub mod effect_file;
mod error;
pub mod file;
mod magnitude;
mod reader;
#[cfg(test)]
mod tests;
mod urdf;

pub use error::{Problem, SceneError};
pub use reader::{SceneFile, parse, parse_injected, read};

use crate::arm::Arm;
use crate::design::problem::{DesignProblem, Request};
use crate::diagnosis::settings::Settings;
use crate::measurement::{Sensor, Weights};
#[cfg(feature = "simulator")]
use crate::simulation::cell::Cell;
use crate::simulation::plan::Plan;

/// Everything but the truth: what the analyser may know. This, and only this, goes into a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name; the stem of output files.
    pub name: String,
    /// What the scene is for.
    pub description: String,
    /// Where the arm's numbers come from; belongs into every report.
    pub arm_note: String,
    /// What of the arm's URDF could not be taken over as it stands; empty for other arms.
    pub urdf_notes: Vec<String>,
    /// What the sensor is.
    pub sensor_name: String,
    /// Public seed: of the design, the held-out configurations and the order of measuring.
    pub seed: u64,
    /// Nominal arm and cell.
    pub arm: Arm,
    /// Declared accuracy.
    pub sensor: Sensor,
    /// The design problem.
    pub design: DesignProblem,
    /// How the measuring is organised.
    pub plan: Plan,
    /// How the residuals are weighted.
    pub weights: Weights,
    /// Every number that decides what a diagnosis says.
    pub diagnosis: Settings,
}

impl Scene {
    /// What is to be designed.
    #[must_use]
    pub fn request(&self) -> Request<'_> {
        Request { arm: &self.arm, sensor: &self.sensor, weights: self.weights, seed: self.seed, problem: &self.design }
    }

    /// The cell that measures.
    #[cfg(feature = "simulator")]
    #[must_use]
    pub fn cell(&self) -> Cell<'_> {
        Cell { arm: &self.arm, sensor: &self.sensor, plan: &self.plan, seed: self.seed }
    }
}
