//! One calibration of a simulated arm, judged on configurations that it has not seen.

use crate::design::search::split;
use crate::identification::identify_on;
use crate::identification::outcome::{Errors, Identification, Residual};
use crate::measurement::{Measurement, Role};
use crate::progress::Silent;
use crate::quality::subspace::Subspace;
use crate::scene::Scene;
use crate::seed::derive;
use crate::session::SessionError;
use crate::simulation::cell::measure;
use crate::simulation::cell::plan::plan;
use crate::simulation::injected::Injected;

/// A calibration: a true arm, its verification and its noise, all of the trial's own number. Calibrations of the same number with
/// different configurations are pairs: the same arm, the same verification, the same noise.
pub struct Trial<'a> {
    scene: Scene,
    injected: &'a Injected,
    structure: Subspace,
    verification: Verification,
}

enum Verification {
    /// Read by an exact reference: measured once, in a session of its own.
    Measured(Vec<Measurement>),
    /// Read by the sensor, among the others.
    Planned(Vec<Vec<f64>>),
}

/// How a calibration ended.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// Whether the fit converged.
    pub converged: bool,
    /// Errors of the calibrated model on the verification.
    pub after: Errors,
    /// Errors of the nominal model on it.
    pub before: Errors,
    /// Residuals of the verification, in the order in which the trial drew it.
    pub verification: Vec<Residual>,
    /// All the rest.
    pub identification: Identification,
}

impl<'a> Trial<'a> {
    /// Trial `number` of `scene`.
    ///
    /// # Errors
    /// If no verification configuration is within the rules, or it cannot be measured.
    pub fn new(scene: &Scene, injected: &'a Injected, number: usize) -> Result<Self, SessionError> {
        let mut scene = scene.clone();
        scene.seed = derive(scene.seed, number as u64);
        let held_out = crate::design::held_out(&scene.request(), scene.plan.held_out_count, scene.plan.held_out_exact)?;
        let verification = if scene.plan.held_out_exact {
            let planned = plan(&scene.cell(), &[], &held_out);
            Verification::Measured(measure(&scene.cell(), injected, &planned, planned.len(), &mut Silent)?.0)
        } else {
            Verification::Planned(held_out)
        };
        let structure = Subspace::of_structure(&scene.arm, scene.sensor.orientation_sigma_rad.is_some());
        Ok(Trial { scene, injected, structure, verification })
    }

    /// The trial's seed, for what is drawn in it.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.scene.seed
    }

    /// Measures `chosen` (configurations one after the other, rad or m), and the verification with it where that is not exact, and
    /// identifies.
    ///
    /// # Errors
    /// Whatever a step reports.
    pub fn calibrate(&self, chosen: &[f64]) -> Result<Calibrated, SessionError> {
        let chosen = split(chosen, self.scene.arm.joint_count());
        let (planned, verification) = match &self.verification {
            Verification::Measured(measured) => (plan(&self.scene.cell(), &chosen, &[]), measured.as_slice()),
            Verification::Planned(held_out) => (plan(&self.scene.cell(), &chosen, held_out), [].as_slice()),
        };
        let (mut measurements, _) = measure(&self.scene.cell(), self.injected, &planned, planned.len(), &mut Silent)?;
        measurements.extend_from_slice(verification);
        let (arm, sensor) = (&self.scene.arm, &self.scene.sensor);
        let identification = identify_on(&self.structure, arm, sensor, self.scene.weights, &measurements)?;
        let mut held_out: Vec<(usize, &Residual)> = measurements
            .iter()
            .zip(&identification.residuals)
            .filter(|(measurement, _)| measurement.role == Role::HeldOut)
            .map(|(measurement, residual)| (measurement.pose_id, residual))
            .collect();
        held_out.sort_by_key(|(pose_id, _)| *pose_id);
        let missing = || SessionError::NothingHeldOut;
        Ok(Calibrated {
            converged: identification.converged,
            after: identification.held_out.clone().ok_or_else(missing)?,
            before: identification.held_out_nominal.clone().ok_or_else(missing)?,
            verification: held_out.into_iter().map(|(_, residual)| residual.clone()).collect(),
            identification,
        })
    }
}
