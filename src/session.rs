//! The steps of a calibration chained: what the commands do, and what a replay does again.

use crate::arm::Arm;
use crate::arm::urdf::{self, UrdfError};
use crate::design::candidates::NothingMeasurable;
use crate::design::outcome::DesignOutcome;
use crate::design::search::SearchReport;
use crate::design::{self, DesignError};
use crate::diagnosis::outcome::{Diagnosis, NoiseSource};
use crate::diagnosis::rows::DiagnosisError;
use crate::diagnosis::settings::Settings;
use crate::diagnosis::{self, Options};
use crate::event::{Event, Listener, RealCell, Start, measurements};
use crate::identification::alignment::align;
use crate::identification::geometry::GeometryError;
use crate::identification::known::Known;
use crate::identification::ladder::Freedom;
use crate::identification::outcome::Identification;
use crate::identification::real::Wishes;
use crate::identification::{self, IdentificationError, identify};
use crate::measurement::{Measurement, Role, Sensor};
use crate::progress::Stopped;
use crate::report::wording;
use crate::scene::{self, Scene, SceneError};
use crate::simulation::cell::measure::MeasureError;
use crate::simulation::cell::plan::{Planned, as_measured, plan};
use crate::simulation::cell::{Truth, measure};
use crate::simulation::injected::Injected;

/// A step failed.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Choosing.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// Drawing held-out configurations.
    #[error(transparent)]
    HeldOut(#[from] NothingMeasurable),
    /// Measuring.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// Nothing that could verify a calibration was measured.
    #[error("nothing is held out: set plan.held_out_count = 1 or more")]
    NothingHeldOut,
    /// Identifying.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// Placing a real arm.
    #[error(transparent)]
    Alignment(#[from] GeometryError),
    /// Reading a robot.
    #[error(transparent)]
    Urdf(#[from] UrdfError),
    /// Reading a scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Recording or showing.
    #[error(transparent)]
    Listener(#[from] Stopped),
}

/// What a whole run yields.
#[derive(Clone, Debug)]
pub struct Run {
    /// The choice.
    pub design: DesignOutcome,
    /// The readings.
    pub measurements: Vec<Measurement>,
    /// The parameters.
    pub identification: Identification,
    /// What causes the rest, looked for in all readings; why not, where it cannot be said.
    pub diagnosis: Result<Diagnosis, DiagnosisError>,
    /// What was hidden.
    pub truth: Truth,
}

/// The whole chain: design, measurement, identification, diagnosis. `scene_toml` is the public part of the scene, for the recording.
///
/// # Errors
/// Whatever a step reports.
pub fn run(scene: &Scene, scene_toml: &str, injected: &Injected, listener: &mut dyn Listener) -> Result<Run, SessionError> {
    start("run", scene_toml, listener)?;
    let design = design_and_tell(scene, listener)?;
    let (measurements, truth) = measure_design(scene, injected, &design.configurations, listener)?;
    let identification = identify_and_tell(scene, &measurements, listener)?;
    let diagnosis = diagnose_and_tell(scene, &measurements, listener)?;
    Ok(Run { design, measurements, identification, diagnosis, truth })
}

/// Chooses the configurations of `scene`, telling the listener every step and the outcome.
///
/// # Errors
/// If no configuration may be measured, or the listener fails.
pub fn design_and_tell(scene: &Scene, listener: &mut dyn Listener) -> Result<DesignOutcome, DesignError> {
    let mut watch = |report: SearchReport| {
        listener.report(&match report {
            SearchReport::Swarm(iteration) => Event::Swarm(iteration),
            SearchReport::Step(step) => Event::Search(step),
        })
    };
    let outcome = design::design(&scene.request(), &mut watch)?;
    listener.report(&Event::Designed(outcome.clone()))?;
    Ok(outcome)
}

/// The configurations that verify a calibration of `scene`.
///
/// # Errors
/// If none may be measured.
pub fn held_out(scene: &Scene) -> Result<Vec<Vec<f64>>, NothingMeasurable> {
    design::held_out(&scene.request(), scene.plan.held_out_count, scene.plan.held_out_exact)
}

/// Measures `planned` in the cell of `scene` (see [`measure()`]), telling the listener every measurement.
///
/// # Errors
/// If the arm cannot be simulated, or the listener fails.
pub fn measure_and_tell(
    scene: &Scene,
    injected: &Injected,
    planned: &[Planned],
    session_poses: usize,
    listener: &mut dyn Listener,
) -> Result<(Vec<Measurement>, Truth), MeasureError> {
    let mut tell = |measurement: &Measurement| listener.report(&Event::Measured(measurement.clone()));
    measure(&scene.cell(), injected, planned, session_poses, &mut tell)
}

/// The first event of every recording.
///
/// # Errors
/// If the listener fails.
pub fn start(command: &str, scene_toml: &str, listener: &mut dyn Listener) -> Result<(), Stopped> {
    listener.report(&Event::Start(start_event(command, scene_toml)))
}

/// What a recording of this version begins with.
#[must_use]
pub fn start_event(command: &str, scene_toml: &str) -> Start {
    Start {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: command.to_owned(),
        scene: scene_toml.to_owned(),
        poses: None,
        real: None,
    }
}

/// The result, then its notes one by one.
fn tell(identification: &Identification, listener: &mut dyn Listener) -> Result<(), Stopped> {
    listener.report(&Event::Identified(identification.clone()))?;
    identification.notes.iter().try_for_each(|note| listener.report(&Event::Note(note.clone())))
}

/// A real arm in the frame in which it was measured, and its sensor.
#[derive(Clone, Debug)]
pub struct RealArm {
    /// The nominal arm as its file says, from its root to its tool.
    pub robot: Arm,
    /// The nominal arm, its base in the measurement frame and the target on its tool fitted.
    pub arm: Arm,
    /// Declared accuracy.
    pub sensor: Sensor,
    /// Whether nobody declared it.
    pub noise_assumed: bool,
    /// What is to be let loose, where somebody said so.
    pub only: Option<Freedom>,
    /// Where each joint's zero is looked for, rad or m; empty for nominal.
    pub zeros: Vec<f64>,
    /// What somebody knows of the arm beforehand.
    pub known: Vec<Known>,
    /// What was left out of the robot's file.
    pub notes: Vec<String>,
}

/// The nominal robot of a real cell, as its recording's first event describes it, and what is to be known of its file and of the table.
///
/// # Errors
/// If its URDF or scene cannot be used.
pub fn real_robot(start: &Start, real: &RealCell) -> Result<(Arm, Vec<String>), SessionError> {
    match &real.urdf {
        Some(text) => {
            let imported = urdf::import(text, "robot", real.base_link.as_deref(), real.tip_link.as_deref())?;
            Ok((imported.arm, [imported.notes, real.notes.clone()].concat()))
        }
        None => {
            let scene = scene::parse(&start.scene, "robot")?.scene;
            Ok((scene.arm, [scene.urdf_notes, real.notes.clone()].concat()))
        }
    }
}

/// The sensor of a real cell: as declared, orientations where all rows have them.
#[must_use]
pub fn real_sensor(real: &RealCell, measurements: &[Measurement]) -> Sensor {
    let orientation = measurements.iter().all(|measurement| measurement.orientation_xyzw.is_some());
    let sensor = Sensor::uniform(real.position_sigma_m, orientation.then_some(real.orientation_sigma_rad));
    Sensor { distances: real.distances.clone(), ..sensor }
}

/// Places the nominal robot `robot` in the measurement frame of `measurements`.
///
/// # Errors
/// If the measurements do not tell where it stands.
pub fn real_arm(real: &RealCell, robot: (Arm, Vec<String>), measurements: &[Measurement]) -> Result<RealArm, SessionError> {
    let sensor = real_sensor(real, measurements);
    let fit: Vec<&Measurement> = measurements.iter().filter(|measurement| measurement.role == Role::Fit).collect();
    let (nominal, notes) = robot;
    let arm = align(&nominal, &sensor, &fit)?;
    Ok(RealArm {
        robot: nominal,
        arm,
        sensor,
        noise_assumed: real.noise_assumed,
        only: real.only,
        zeros: real.zeros.clone(),
        known: real.known.clone(),
        notes,
    })
}

/// Identifies a real arm and tells the listener.
///
/// # Errors
/// If the measurements do not suffice, or the listener fails.
pub fn identify_real(
    real: &RealArm,
    measurements: &[Measurement],
    listener: &mut dyn Listener,
) -> Result<Identification, SessionError> {
    let wishes = Wishes { only: real.only, zeros: &real.zeros, known: &real.known };
    let mut identification = if real.noise_assumed {
        identification::identify_real_without_noise(&real.robot, &real.sensor, measurements, wishes)?
    } else {
        identification::identify_real(&real.robot, &real.sensor, measurements, wishes)?
    };
    let frames = "nominal means: the measurement frame and the target fitted, the robot as its file says";
    identification.notes.push(frames.to_owned());
    identification.notes.extend(real.notes.iter().cloned());
    tell(&identification, listener)?;
    Ok(identification)
}

/// Measures `chosen` and the scene's held-out configurations.
///
/// # Errors
/// If no held-out configuration is free of collisions, or measuring fails.
pub fn measure_design(
    scene: &Scene,
    injected: &Injected,
    chosen: &[Vec<f64>],
    listener: &mut dyn Listener,
) -> Result<(Vec<Measurement>, Truth), SessionError> {
    let planned = plan(&scene.cell(), chosen, &held_out(scene)?);
    Ok(measure_and_tell(scene, injected, &planned, planned.len(), listener)?)
}

/// Identifies the scene's arm and tells the listener.
///
/// # Errors
/// If the measurements do not suffice, or the listener fails.
pub fn identify_and_tell(
    scene: &Scene,
    measurements: &[Measurement],
    listener: &mut dyn Listener,
) -> Result<Identification, SessionError> {
    let mut identification = identify(&scene.arm, &scene.sensor, scene.weights, measurements)?;
    identification.notes.extend(scene.urdf_notes.iter().cloned());
    tell(&identification, listener)?;
    Ok(identification)
}

/// Diagnoses what was measured of the scene's arm, fitted or held out, as `kincal diagnose` does with the recording.
///
/// # Errors
/// If the measurements do not suffice.
pub fn diagnose(scene: &Scene, measurements: &[Measurement]) -> Result<Diagnosis, DiagnosisError> {
    diagnose_with(scene, measurements, &scene.diagnosis)
}

fn diagnose_with(scene: &Scene, measurements: &[Measurement], settings: &Settings) -> Result<Diagnosis, DiagnosisError> {
    let rows: Vec<&Measurement> = measurements.iter().collect();
    let options = Options { settings: settings.clone(), ..Options::new(NoiseSource::Declared) };
    let mut diagnosis = wording::diagnosis(diagnosis::diagnose(&scene.arm, &scene.sensor, &rows, &options)?);
    diagnosis.notes.extend(scene.urdf_notes.iter().cloned());
    Ok(diagnosis)
}

/// Diagnoses and tells the listener. That it cannot be done is a note: the calibration stands without.
///
/// # Errors
/// If the listener fails.
pub fn diagnose_and_tell(
    scene: &Scene,
    measurements: &[Measurement],
    listener: &mut dyn Listener,
) -> Result<Result<Diagnosis, DiagnosisError>, Stopped> {
    tell_diagnosis(diagnose(scene, measurements), listener)
}

fn tell_diagnosis(
    diagnosis: Result<Diagnosis, DiagnosisError>,
    listener: &mut dyn Listener,
) -> Result<Result<Diagnosis, DiagnosisError>, Stopped> {
    listener.report(&match &diagnosis {
        Ok(diagnosis) => Event::Diagnosed(Box::new(diagnosis.clone())),
        Err(error) => Event::NotDiagnosed(error.to_string()),
    })?;
    Ok(diagnosis)
}

/// Whose recording is replayed.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// A scene's.
    Scene(&'a Scene),
    /// A real arm's.
    Real(&'a RealArm),
}

/// Recomputes what a recording holds and tells it to `listener` in the recorded order: the design from the scene, the
/// measurements from the physics where `injected` is given (else they are taken as recorded), identification and diagnosis from these.
///
/// # Errors
/// Whatever a step reports.
pub fn replay(
    subject: Subject<'_>,
    recorded: &[Event],
    injected: Option<&Injected>,
    listener: &mut dyn Listener,
) -> Result<Option<Truth>, SessionError> {
    let mut truth = None;
    let mut chosen: Option<Vec<Vec<f64>>> = None;
    let mut designed = false;
    let mut measured: Option<Vec<Measurement>> = None;
    for event in recorded {
        match event {
            Event::Start(start) => {
                // What another version recorded is compared as far as that is possible.
                let version = start.version.clone();
                let repeated = start_event(&start.command, &start.scene);
                listener.report(&Event::Start(Start { version, poses: start.poses, real: start.real.clone(), ..repeated }))?;
            }
            Event::Swarm(_) | Event::Search(_) | Event::Designed(_) => {
                // Once: the design tells all its events itself.
                if let (false, Subject::Scene(scene)) = (designed, subject) {
                    designed = true;
                    chosen = Some(design_and_tell(scene, listener)?.configurations);
                }
            }
            Event::Measured(measurement) => match (injected, subject) {
                (None, _) | (_, Subject::Real(_)) => {
                    listener.report(event)?;
                    measured.get_or_insert_default().push(measurement.clone());
                }
                (Some(injected), Subject::Scene(scene)) if measured.is_none() => {
                    let planned = match &chosen {
                        Some(chosen) => plan(&scene.cell(), chosen, &held_out(scene)?),
                        None => as_measured(&scene.cell(), &measurements(recorded)),
                    };
                    // A recording that was cut off holds fewer poses than the session had.
                    let session = recorded.iter().find_map(|event| match event {
                        Event::Start(start) => start.poses,
                        _ => None,
                    });
                    let session = session.unwrap_or(planned.len());
                    let (measurements, new_truth) = measure_and_tell(scene, injected, &planned, session, listener)?;
                    measured = Some(measurements);
                    truth = Some(new_truth);
                }
                (Some(_), Subject::Scene(_)) => {}
            },
            Event::Identified(_) => {
                let measured = measured.as_deref().unwrap_or_default();
                match subject {
                    Subject::Scene(scene) => identify_and_tell(scene, measured, listener)?,
                    Subject::Real(real) => identify_real(real, measured, listener)?,
                };
            }
            Event::Diagnosed(diagnosis) => replay_diagnosis(subject, measured.as_deref(), Some(&diagnosis.settings), listener)?,
            Event::NotDiagnosed(_) => replay_diagnosis(subject, measured.as_deref(), None, listener)?,
            // Told again by the step that they are about.
            Event::Note(_) => {}
        }
    }
    Ok(truth)
}

/// The diagnosis again, with the settings that were recorded. Those of real arms are not recorded; where one is, it cannot be recomputed
/// and counts as different.
fn replay_diagnosis(
    subject: Subject<'_>,
    measured: Option<&[Measurement]>,
    settings: Option<&Settings>,
    listener: &mut dyn Listener,
) -> Result<(), Stopped> {
    match subject {
        Subject::Scene(scene) => {
            let settings = settings.unwrap_or(&scene.diagnosis);
            tell_diagnosis(diagnose_with(scene, measured.unwrap_or_default(), settings), listener).map(|_| ())
        }
        Subject::Real(_) => Ok(()),
    }
}
