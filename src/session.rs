//! The steps of a calibration chained: what the commands do, and what a replay does again.

use crate::cell::measure::{MeasureError, plan};
use crate::cell::{Truth, measure};
use crate::design::candidates::AlwaysColliding;
use crate::design::outcome::DesignOutcome;
use crate::design::{self, DesignError};
use crate::identification::outcome::Identification;
use crate::identification::{IdentificationError, identify};
use crate::measurement::Measurement;
use crate::recording::event::{Event, Listener, ListenerError, Start};
use crate::scene::{Injected, Scene};

/// A step failed.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// Choosing.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// Drawing held-out configurations.
    #[error(transparent)]
    HeldOut(#[from] AlwaysColliding),
    /// Measuring.
    #[error(transparent)]
    Measure(#[from] MeasureError),
    /// Identifying.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// Recording or showing.
    #[error(transparent)]
    Listener(#[from] ListenerError),
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
    /// What was hidden.
    pub truth: Truth,
}

/// The whole chain: design, measurement, identification. `scene_toml` is the public part of the scene, for the recording.
///
/// # Errors
/// Whatever a step reports.
pub fn run(scene: &Scene, scene_toml: &str, injected: &Injected, listener: &mut dyn Listener) -> Result<Run, SessionError> {
    start("run", scene_toml, listener)?;
    let design = design::design(scene, listener)?;
    let (measurements, truth) = measure_design(scene, injected, &design.configurations, listener)?;
    let identification = identify_and_tell(scene, &measurements, listener)?;
    Ok(Run { design, measurements, identification, truth })
}

/// The first event of every recording.
///
/// # Errors
/// If the listener fails.
pub fn start(command: &str, scene_toml: &str, listener: &mut dyn Listener) -> Result<(), ListenerError> {
    listener.take(&Event::Start(Start {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: command.to_owned(),
        scene: scene_toml.to_owned(),
    }))
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
    let held_out = design::held_out(scene)?;
    Ok(measure(scene, injected, &plan(scene, chosen, &held_out), listener)?)
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
    let identification = identify(&scene.arm, &scene.sensor, scene.weights, measurements)?;
    listener.take(&Event::Identified(identification.clone()))?;
    Ok(identification)
}

/// Recomputes what a recording holds and tells it to `listener` in the recorded order: the design from the scene, the
/// measurements from the physics where `injected` is given (else they are taken as recorded), the identification from these.
///
/// # Errors
/// Whatever a step reports.
pub fn replay(
    scene: &Scene,
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
            Event::Start(start) => listener.take(&Event::Start(Start {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                command: start.command.clone(),
                scene: start.scene.clone(),
            }))?,
            Event::Swarm(_) | Event::Designed(_) => {
                // Once: the design tells all its events itself.
                if !designed {
                    designed = true;
                    chosen = Some(design::design(scene, listener)?.configurations);
                }
            }
            Event::Measured(measurement) => match injected {
                None => {
                    listener.take(event)?;
                    measured.get_or_insert_default().push(measurement.clone());
                }
                Some(injected) if measured.is_none() => {
                    let planned = match &chosen {
                        Some(chosen) => plan(scene, chosen, &design::held_out(scene)?),
                        None => planned_as_recorded(recorded),
                    };
                    let (measurements, new_truth) = measure(scene, injected, &planned, listener)?;
                    measured = Some(measurements);
                    truth = Some(new_truth);
                }
                Some(_) => {}
            },
            Event::Identified(_) => {
                identify_and_tell(scene, measured.as_deref().unwrap_or_default(), listener)?;
            }
            Event::Note(_) => listener.take(event)?,
        }
    }
    Ok(truth)
}

/// The plan that a recording without a design was measured by.
fn planned_as_recorded(recorded: &[Event]) -> Vec<crate::cell::measure::Planned> {
    recorded
        .iter()
        .filter_map(|event| match event {
            Event::Measured(measurement) => Some(crate::cell::measure::Planned {
                pose_id: measurement.pose_id,
                role: measurement.role,
                joints: measurement.joints.clone(),
            }),
            _ => None,
        })
        .collect()
}
