//! Measuring: every configuration settles in the physics, then the sensor reads it.

use rayon::prelude::*;

use super::plan::Planned;
use super::sensor::SimulatedSensor;
use super::temperature;
use super::truth::{self, TruePose, Truth};
use crate::measurement::{Measurement, Role};
use crate::physics::{Conditions, PhysicalArm, PhysicsError, Settled, Settling, Stop};
use crate::recording::event::{Event, Listener, ListenerError};
use crate::scene::{Injected, Scene};

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
/// If a link has no mass, or an effect cannot be.
pub fn check(scene: &Scene, injected: &Injected) -> Result<(), PhysicsError> {
    let parameters = truth::parameters(&scene.arm, injected, scene.seed);
    let values: Vec<f64> = parameters.iter().map(|parameter| parameter.true_value).collect();
    PhysicalArm::new(&scene.arm, &values, &injected.effects, Settling::default()).map(drop)
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
    let new_arm = || PhysicalArm::new(arm, &values, &injected.effects, Settling::default());
    let stops: Vec<Stop> = planned.iter().map(stop).collect();
    let session_s = session_s(scene, planned, session_poses);
    let mut sensor = SimulatedSensor::new(&scene.sensor, injected, scene.seed);

    let mut measurements = Vec::with_capacity(planned.len());
    let mut poses = Vec::with_capacity(planned.len());
    for (batch, chunk) in planned.chunks(BATCH).enumerate() {
        let settled: Vec<(Settled, Vec<f64>)> = chunk
            .par_iter()
            .enumerate()
            .map_init(new_arm, |physical, (offset, planned)| {
                let index = batch * BATCH + offset;
                let rise = temperature::rises(&scene.plan, arm.links.len(), planned.time_s, session_s);
                let conditions = Conditions {
                    joints: &planned.joints,
                    from: &planned.from,
                    rise_k: &rise,
                    payload_kg: planned.payload_kg,
                    time_s: planned.time_s,
                    session_s,
                    dwell_s: planned.dwell_s,
                    history: &stops[..index],
                };
                match physical {
                    Ok(physical) => Ok((physical.settle(&conditions), rise)),
                    Err(error) => Err(error.clone()),
                }
            })
            .collect::<Result<_, _>>()?;
        for (offset, ((settled, rise), planned)) in settled.into_iter().zip(chunk).enumerate() {
            let index = batch * BATCH + offset;
            let exact = planned.role == Role::HeldOut && scene.plan.held_out_exact;
            let share = if session_s > 0.0 { (planned.time_s / session_s).clamp(0.0, 1.0) } else { 0.0 };
            let reference_c = scene.plan.reference_temperature_c;
            let (pose, temperatures_c) = sensor.read(&settled.base_from_tool, exact, share, &rise, reference_c);
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
                approach: planned.approach(),
                ambient_c: sensor.read_ambient(reference_c + temperature::ambient_rise(&scene.plan, planned.time_s, session_s)),
                payload_kg: Some(planned.payload_kg),
                dwell_s: Some(planned.dwell_s),
                ..Measurement::default()
            };
            listener.take(&Event::Measured(measurement.clone()))?;
            measurements.push(measurement);
            poses.push(TruePose::new(index, &settled, rise));
        }
    }
    Ok((measurements, Truth { parameters, effects: truth::described(arm, &injected.effects), poses }))
}

fn stop(planned: &Planned) -> Stop<'_> {
    Stop {
        joints: &planned.joints,
        from: &planned.from,
        payload_kg: planned.payload_kg,
        time_s: planned.time_s,
        dwell_s: planned.dwell_s,
    }
}

/// Length of a session of `poses` readings of which `planned` are the first: to the last reading.
fn session_s(scene: &Scene, planned: &[Planned], poses: usize) -> f64 {
    let known = planned.last().map_or(0.0, |planned| planned.time_s);
    known + poses.saturating_sub(planned.len()) as f64 * scene.plan.seconds_per_pose
}
