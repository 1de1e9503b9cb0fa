//! One calibration of a simulated arm, judged on configurations that it has not seen.

use crate::cell::measure;
use crate::cell::measure::{Planned, plan};
use crate::design::search::split;
use crate::identification::identify;
use crate::identification::outcome::{Errors, Identification, Residual};
use crate::measurement::Role;
use crate::recording::event::Nobody;
use crate::scene::{Injected, Scene};
use crate::seed::derive;
use crate::session::SessionError;

/// A calibration: a true arm, its verification and its noise, all of the trial's own number. Calibrations of the same number with
/// different configurations are pairs: the same arm, the same verification, the same noise.
pub struct Trial<'a> {
    scene: Scene,
    injected: &'a Injected,
    held_out: Vec<Vec<f64>>,
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
    /// If no verification configuration is within the rules.
    pub fn new(scene: &Scene, injected: &'a Injected, number: usize) -> Result<Self, SessionError> {
        let mut scene = scene.clone();
        scene.seed = derive(scene.seed, number as u64);
        let held_out = crate::design::held_out(&scene)?;
        Ok(Trial { scene, injected, held_out })
    }

    /// The trial's seed, for what is drawn in it.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.scene.seed
    }

    /// Measures `chosen` (configurations one after the other, rad or m) and the verification, and identifies.
    ///
    /// # Errors
    /// Whatever a step reports.
    pub fn calibrate(&self, chosen: &[f64]) -> Result<Calibrated, SessionError> {
        let planned: Vec<Planned> = plan(&self.scene, &split(chosen, self.scene.arm.joint_count()), &self.held_out);
        let (measurements, _) = measure(&self.scene, self.injected, &planned, planned.len(), &mut Nobody)?;
        let identification = identify(&self.scene.arm, &self.scene.sensor, self.scene.weights, &measurements)?;
        let missing = || SessionError::NothingHeldOut;
        let held_out = identification.residuals.iter().filter(|residual| planned[residual.index].role == Role::HeldOut);
        let mut verification: Vec<Residual> = held_out.cloned().collect();
        verification.sort_by_key(|residual| planned[residual.index].pose_id);
        Ok(Calibrated {
            converged: identification.converged,
            after: identification.held_out.clone().ok_or_else(missing)?,
            before: identification.held_out_nominal.clone().ok_or_else(missing)?,
            verification,
            identification,
        })
    }
}
