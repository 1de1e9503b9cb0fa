//! The sensor with the noise and the faults that it really has.

use nalgebra::{Translation3, Vector3};

use super::truth;
use crate::arm::frames::{Pose, rotation_from_vector};
use crate::measurement::Sensor;
use crate::seed::Stream;
use crate::simulation::effect::{Effect, Moves};
use crate::simulation::injected::{Injected, Noise};

/// A sensor that reads true poses.
pub(super) struct SimulatedSensor<'a> {
    declared: &'a Sensor,
    effects: &'a [Effect],
    noise: Noise,
    position: Stream,
    orientation: Stream,
    temperature: Stream,
    ambient: Stream,
    outlier: Stream,
}

impl<'a> SimulatedSensor<'a> {
    pub(super) fn new(declared: &'a Sensor, injected: &'a Injected, public_seed: u64) -> Self {
        SimulatedSensor {
            declared,
            effects: &injected.effects,
            noise: injected.noise,
            position: truth::stream(injected, public_seed, "noise/position"),
            orientation: truth::stream(injected, public_seed, "noise/attitude"),
            temperature: truth::stream(injected, public_seed, "noise/temperature"),
            ambient: truth::stream(injected, public_seed, "noise/ambient"),
            outlier: truth::stream(injected, public_seed, "noise/outlier"),
        }
    }

    /// The pose and the temperatures (°C, of the moving links) that it reads when `share` of the session has passed. An `exact`
    /// reading is another instrument's, without any fault.
    pub(super) fn read(&mut self, truth: &Pose, exact: bool, share: f64, rise_k: &[f64], reference_c: f64) -> (Pose, Vec<f64>) {
        let seen = self.seen(truth, share);
        // Drawn for every reading, so that one more outlier does not shift the noise of the others.
        let widened = self.widened();
        let mut normal = || Vector3::from_fn(|_, _| self.position.normal());
        let position = match self.noise {
            Noise::Declared { factor } => normal() * (factor * self.declared.position_sigma_at(&truth.translation.vector)),
            Noise::Uniform { position_m, .. } => Vector3::from_fn(|_, _| self.position.uniform(-position_m, position_m)),
            Noise::Off => Vector3::zeros(),
        };
        let orientation = match self.noise {
            Noise::Declared { factor } => {
                Vector3::from_fn(|_, _| self.orientation.normal()) * (factor * self.declared.orientation_sigma_rad.unwrap_or(0.0))
            }
            Noise::Uniform { orientation_rad, .. } => {
                Vector3::from_fn(|_, _| self.orientation.uniform(-orientation_rad, orientation_rad))
            }
            Noise::Off => Vector3::zeros(),
        };
        // The base link has no sensor. Whether there are others is public: nothing is told by their absence.
        let temperatures = match self.declared.temperature_sigma_k {
            Some(sigma_k) => rise_k.iter().skip(1).map(|rise| reference_c + rise + sigma_k * self.temperature.normal()).collect(),
            None => Vec::new(),
        };
        if exact {
            return (*truth, temperatures);
        }
        let mut read = seen;
        read.translation.vector += position * widened;
        read.rotation = rotation_from_vector(&(orientation * widened)) * read.rotation;
        (read, temperatures)
    }

    /// The temperature of the air as read, °C; `None` where there are no temperature sensors.
    pub(super) fn read_ambient(&mut self, truth_c: f64) -> Option<f64> {
        self.declared.temperature_sigma_k.map(|sigma_k| truth_c + sigma_k * self.ambient.normal())
    }

    /// How many times as wide as it should be the noise of the next reading is.
    fn widened(&mut self) -> f64 {
        let mut widened = 1.0;
        for effect in self.effects {
            if let Effect::MeasurementOutliers { share, factor } = effect
                && self.outlier.unit() < *share
            {
                widened *= factor;
            }
        }
        widened
    }

    /// The pose `base_from_tool` in the frame that the sensor takes for the base, by its own scale, without noise.
    fn seen(&self, base_from_tool: &Pose, share: f64) -> Pose {
        let stand = self.declared.position_in_base.coords;
        let mut seen = *base_from_tool;
        for effect in self.effects {
            let (translation, rotation) = match effect {
                Effect::BaseDrift { moves: Moves::Sensor, translation, rotation } => (translation * share, rotation * share),
                Effect::BaseStep { moves: Moves::Sensor, translation, rotation, after } if share >= *after => {
                    (*translation, *rotation)
                }
                _ => continue,
            };
            // The sensor turns where it stands and is carried along; its frame goes with it.
            let turn = rotation_from_vector(&rotation);
            let believed_from_true = Pose::from_parts(Translation3::from(stand + translation - turn * stand), turn).inverse();
            seen = believed_from_true * seen;
        }
        for effect in self.effects {
            if let Effect::MeasurementScale { scale } = effect {
                // Distances are measured along the beam, from where the sensor believes that it stands.
                seen.translation.vector = stand + (seen.translation.vector - stand) * (1.0 + scale);
            }
        }
        seen
    }
}
