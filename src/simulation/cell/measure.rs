//! Measuring: every configuration settles in the physics, then the sensor reads it.

use rayon::prelude::*;

use super::Cell;
use super::plan::Planned;
use super::sensor::SimulatedSensor;
use super::temperature;
use super::truth::{self, TruePose, Truth};
use crate::measurement::{Measurement, Role};
use crate::progress::{Progress, Stopped};
use crate::simulation::injected::Injected;
use crate::simulation::physics::{Conditions, PhysicalArm, PhysicsError, Settled, Settling, Stop};

/// Configurations that settle side by side before they are told: bounds memory, and what a killed run loses.
const BATCH: usize = 64;

/// Whoever takes the measurements as they are made.
pub type Reports<'r> = dyn for<'m> Progress<&'m Measurement> + 'r;

/// Measuring failed.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The true arm cannot be simulated.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    /// Whoever records or shows the run failed.
    #[error(transparent)]
    Listener(#[from] Stopped),
}

/// Whether the cell's true arm can be simulated: to be asked before anything is written.
///
/// # Errors
/// If a link has no mass, or an effect cannot be.
pub fn check(cell: &Cell<'_>, injected: &Injected) -> Result<(), PhysicsError> {
    let parameters = truth::parameters(cell.arm, injected, cell.seed);
    let values: Vec<f64> = parameters.iter().map(|parameter| parameter.true_value).collect();
    PhysicalArm::new(cell.arm, &values, &injected.effects, Settling::default()).map(drop)
}

/// Measures `planned` on the true arm that `injected` makes of the cell's, telling `progress` every measurement.
///
/// Noise is drawn from streams of the hidden seed, in the order of measuring; the physics of a pose depends on nothing but the pose.
/// Neither depends on the number of threads.
///
/// `session_poses` is the number of poses of the whole session, over which the temperature takes its course: that of `planned`,
/// unless only the beginning of a session is repeated.
///
/// # Errors
/// If the arm cannot be simulated (links without mass), or `progress` stops it.
pub fn measure(
    cell: &Cell<'_>,
    injected: &Injected,
    planned: &[Planned],
    session_poses: usize,
    progress: &mut Reports<'_>,
) -> Result<(Vec<Measurement>, Truth), MeasureError> {
    let arm = cell.arm;
    let parameters = truth::parameters(arm, injected, cell.seed);
    let values: Vec<f64> = parameters.iter().map(|parameter| parameter.true_value).collect();
    let new_arm = || PhysicalArm::new(arm, &values, &injected.effects, Settling::default());
    let stops: Vec<Stop> = planned.iter().map(stop).collect();
    let session_s = session_s(cell, planned, session_poses);
    let mut sensor = SimulatedSensor::new(cell.sensor, injected, cell.seed);

    let mut measurements = Vec::with_capacity(planned.len());
    let mut poses = Vec::with_capacity(planned.len());
    for (batch, chunk) in planned.chunks(BATCH).enumerate() {
        let settled: Vec<(Settled, Vec<f64>)> = chunk
            .par_iter()
            .enumerate()
            .map_init(new_arm, |physical, (offset, planned)| {
                let index = batch * BATCH + offset;
                let rise = temperature::rises(cell.plan, arm.links.len(), planned.time_s, session_s);
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
            let exact = planned.role == Role::HeldOut && cell.plan.held_out_exact;
            let share = if session_s > 0.0 { (planned.time_s / session_s).clamp(0.0, 1.0) } else { 0.0 };
            let reference_c = cell.plan.reference_temperature_c;
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
                orientation_xyzw: cell.sensor.orientation_sigma_rad.map(|_| [q.i, q.j, q.k, q.w]),
                approach: planned.approach(),
                ambient_c: sensor.read_ambient(reference_c + temperature::ambient_rise(cell.plan, planned.time_s, session_s)),
                payload_kg: Some(planned.payload_kg),
                dwell_s: Some(planned.dwell_s),
                ..Measurement::default()
            };
            progress.report(&measurement)?;
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

/// Length of a session of `poses` readings of which `planned` are the first: to the last reading, as the plan has it, so that the
/// beginning of a session is repeated to the last bit.
fn session_s(cell: &Cell<'_>, planned: &[Planned], poses: usize) -> f64 {
    let known = planned.last().map_or(0.0, |planned| planned.time_s);
    if poses <= planned.len() { known } else { known.max((poses - 1) as f64 * cell.plan.seconds_per_pose) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Level;
    use crate::lab::effect_validation::session;
    use crate::progress::Silent;
    use crate::scene::Scene;
    use crate::simulation::effect::{Effect, Moves};
    use crate::simulation::injected::Noise;
    use nalgebra::Vector3;

    fn injected(effects: Vec<Effect>) -> (Scene, Injected) {
        let file = crate::scene::read(std::path::Path::new("scenes/arm8.toml")).unwrap();
        let injected = Injected { effects, ..file.injected.unwrap() };
        (file.scene, injected)
    }

    fn remembering() -> Vec<Effect> {
        let shift = Vector3::new(3e-5, 0.0, -2e-5);
        vec![
            Effect::JointCompliance { joint: 1, stiffness: 2e4 },
            Effect::Backlash { joint: 2, width: 3e-4 },
            Effect::CreepAfterMotion { joint: 3, compliance: 1e-5, time_constant: 50.0 },
            Effect::MemoryHysteresis { joint: 4, amplitude: 3e-4, travel: 0.2 },
            Effect::BaseStep { moves: Moves::Sensor, translation: shift, rotation: shift, after: 0.5 },
            Effect::MeasurementOutliers { share: 0.1, factor: 8.0 },
        ]
    }

    #[test]
    fn rows_carry_their_conditions_and_the_truth_its_effects() {
        let (scene, injected) = injected(remembering());
        let planned = session(&scene.arm, 20, 3);
        let (measurements, truth) = measure(&scene.cell(), &injected, &planned, planned.len(), &mut Silent).unwrap();
        for (measurement, planned) in measurements.iter().zip(&planned) {
            assert_eq!(measurement.approach, planned.approach());
            assert!(measurement.approach.iter().all(|direction| *direction != 0));
            assert_eq!((measurement.payload_kg, measurement.dwell_s), (Some(planned.payload_kg), Some(planned.dwell_s)));
        }
        let backlash = truth.effects.iter().find(|effect| effect.kind == "backlash").unwrap();
        assert_eq!((backlash.level, backlash.number, backlash.magnitude), (Level::Joint, Some(3), 3e-4));
        assert_eq!(backlash.unit, "rad");
        let compliance = truth.effects.iter().find(|effect| effect.kind == "joint_compliance").unwrap();
        assert_eq!((compliance.magnitude, compliance.unit.as_str()), (1.0 / 2e4, "rad/(N·m)"));
        assert!(truth.poses.iter().all(|pose| pose.settled && pose.yields.len() == 3));
    }

    /// More rows than a batch: what a row remembers is its session's, however many rows settle side by side, and the beginning of a
    /// session is the same whether or not it goes on.
    #[test]
    fn a_row_depends_on_those_before_it_and_on_nothing_else() {
        let (mut scene, injected) = injected(remembering());
        // No multiple of it in binary is exact.
        scene.plan.seconds_per_pose = 0.1;
        let mut planned = session(&scene.arm, BATCH + 20, 4);
        planned.iter_mut().enumerate().for_each(|(index, row)| row.time_s = index as f64 * 0.1);
        let run = |threads, rows: &[Planned]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measure(&scene.cell(), &injected, rows, planned.len(), &mut Silent).unwrap())
        };
        let (whole, truth) = run(3, &planned);
        assert_eq!(run(1, &planned), (whole.clone(), truth.clone()));
        let cut = BATCH + 7;
        let (beginning, its_truth) = run(2, &planned[..cut]);
        assert_eq!(beginning[..], whole[..cut]);
        assert_eq!(its_truth.poses[..], truth.poses[..cut]);
    }

    /// The streams of noise have their labels from before there were effects.
    #[test]
    fn effects_of_the_arm_leave_the_noise_as_it_is() {
        let (scene, plain) = injected(Vec::new());
        let planned = session(&scene.arm, 10, 5);
        let arm = Injected { effects: vec![Effect::JointCompliance { joint: 1, stiffness: 2e4 }], ..plain.clone() };
        let noise = |injected: &Injected| {
            let read = measure(&scene.cell(), injected, &planned, planned.len(), &mut Silent).unwrap().0;
            let silent = Injected { noise: Noise::Off, ..injected.clone() };
            let still = measure(&scene.cell(), &silent, &planned, planned.len(), &mut Silent).unwrap().0;
            read.iter().zip(still).map(|(read, still)| read.position() - still.position()).collect::<Vec<_>>()
        };
        for (with, without) in noise(&arm).iter().zip(noise(&plain)) {
            // The noise grows with the distance, which has changed by a millimetre in two metres.
            assert!((with - without).norm() < 1e-3 * without.norm(), "{with} instead of {without}");
        }
    }
}
