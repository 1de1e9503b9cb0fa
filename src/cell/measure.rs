//! Measuring: every configuration settles in the physics, then the sensor reads it.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::plan::Planned;
use super::truth::{self, TruePose, Truth};
use crate::frames::{Pose, rotation_from_vector};
use crate::measurement::{Measurement, Role, Sensor};
use crate::physics::{PhysicalArm, PhysicsError, Settled, Settling};
use crate::recording::event::{Event, Listener, ListenerError};
use crate::scene::{Injected, Noise, Scene};
use crate::seed::Stream;

/// Configurations that settle side by side before they are told: bounds memory, and what a killed run loses.
const BATCH: usize = 64;

/// Measuring failed.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The true arm cannot be simulated.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    /// Whoever records or shows the run failed.
    #[error(transparent)]
    Listener(#[from] ListenerError),
}

/// Whether the scene's true arm can be simulated: to be asked before anything is written.
///
/// # Errors
/// If a link has no mass, or a clearance is none.
pub fn check(scene: &Scene, injected: &Injected) -> Result<(), PhysicsError> {
    let parameters = truth::parameters(&scene.arm, injected, scene.seed);
    let values: Vec<f64> = parameters.iter().map(|parameter| parameter.true_value).collect();
    let clearances = truth::clearances(&scene.arm, injected);
    PhysicalArm::new(&scene.arm, &values, &clearances, Settling::default()).map(drop)
}

/// Measures `planned` on the true arm that `injected` makes of the scene's, telling `listener` every measurement.
///
/// Noise is drawn from streams of the hidden seed, in the order of measuring; the physics of a pose depends on nothing but the pose.
/// Neither depends on the number of threads.
///
/// `session_poses` is the number of poses of the whole session, over which the temperature takes its course: that of `planned`,
/// unless only the beginning of a session is repeated.
///
/// # Errors
/// If the arm cannot be simulated (links without mass), or the listener fails.
pub fn measure(
    scene: &Scene,
    injected: &Injected,
    planned: &[Planned],
    session_poses: usize,
    listener: &mut dyn Listener,
) -> Result<(Vec<Measurement>, Truth), MeasureError> {
    let arm = &scene.arm;
    let parameters = truth::parameters(arm, injected, scene.seed);
    let values: Vec<f64> = parameters.iter().map(|parameter| parameter.true_value).collect();
    let clearances = truth::clearances(arm, injected);
    let new_arm = || PhysicalArm::new(arm, &values, &clearances, Settling::default());
    let mut sensor = SimulatedSensor::new(&scene.sensor, injected, scene.seed);

    let mut measurements = Vec::with_capacity(planned.len());
    let mut poses = Vec::with_capacity(planned.len());
    let last = session_poses.saturating_sub(1).max(1) as f64;
    for (batch, chunk) in planned.chunks(BATCH).enumerate() {
        let settled: Vec<(Settled, Vec<f64>)> = chunk
            .par_iter()
            .enumerate()
            .map_init(new_arm, |physical, (offset, planned)| {
                let rise = truth::temperature_rise(arm, injected, (batch * BATCH + offset) as f64 / last);
                match physical {
                    Ok(physical) => Ok((physical.settle(&planned.joints, &truth::growth(injected, &rise)), rise)),
                    Err(error) => Err(error.clone()),
                }
            })
            .collect::<Result<_, _>>()?;
        for (offset, ((settled, rise), planned)) in settled.into_iter().zip(chunk).enumerate() {
            let index = batch * BATCH + offset;
            let exact = planned.role == Role::HeldOut && scene.plan.held_out_exact;
            let (pose, temperatures_c) = sensor.read(&settled.base_from_tool, exact, &rise, scene.plan.reference_temperature_c);
            let q = pose.rotation.quaternion();
            let measurement = Measurement {
                index,
                pose_id: planned.pose_id,
                role: planned.role,
                time_s: planned.time_s,
                joints: planned.joints.clone(),
                temperatures_c,
                position_m: pose.translation.vector.into(),
                attitude_xyzw: scene.sensor.attitude_sigma_rad.map(|_| [q.i, q.j, q.k, q.w]),
                ..Measurement::default()
            };
            listener.take(&Event::Measured(measurement.clone()))?;
            measurements.push(measurement);
            poses.push(TruePose::new(index, &settled, rise));
        }
    }
    Ok((measurements, Truth { parameters, poses }))
}

/// The sensor with the noise that it really has.
struct SimulatedSensor<'a> {
    declared: &'a Sensor,
    noise: Noise,
    position: Stream,
    attitude: Stream,
    temperature: Stream,
}

impl<'a> SimulatedSensor<'a> {
    fn new(declared: &'a Sensor, injected: &Injected, public_seed: u64) -> Self {
        SimulatedSensor {
            declared,
            noise: injected.noise,
            position: truth::stream(injected, public_seed, "noise/position"),
            attitude: truth::stream(injected, public_seed, "noise/attitude"),
            temperature: truth::stream(injected, public_seed, "noise/temperature"),
        }
    }

    fn read(&mut self, truth: &Pose, exact: bool, rise_k: &[f64], reference_c: f64) -> (Pose, Vec<f64>) {
        let mut normal = || Vector3::from_fn(|_, _| self.position.normal());
        let position = match self.noise {
            Noise::Declared { factor } => normal() * (factor * self.declared.position_sigma_at(&truth.translation.vector)),
            Noise::Uniform { position_m, .. } => Vector3::from_fn(|_, _| self.position.uniform(-position_m, position_m)),
            Noise::Off => Vector3::zeros(),
        };
        let attitude = match self.noise {
            Noise::Declared { factor } => {
                Vector3::from_fn(|_, _| self.attitude.normal()) * (factor * self.declared.attitude_sigma_rad.unwrap_or(0.0))
            }
            Noise::Uniform { attitude_rad, .. } => Vector3::from_fn(|_, _| self.attitude.uniform(-attitude_rad, attitude_rad)),
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
        let mut read = *truth;
        read.translation.vector += position;
        read.rotation = rotation_from_vector(&attitude) * read.rotation;
        (read, temperatures)
    }
}
