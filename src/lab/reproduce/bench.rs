//! What all experiments on an arm share: its models, the optimum of the paper's method, fits and their bookkeeping.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::findings::Tally;
use super::limits::Limits;
use crate::design::DesignError;
use crate::design::candidates::Rules;
use crate::design::objective::{Models, Objective};
use crate::design::problem::{Criterion, Method};
use crate::design::search::{Found, SearchReport, Task, search};
use crate::identification::outcome::{Errors, Residual, Summary};
use crate::lab::trial::Trial;
use crate::progress::Steps;
use crate::quality::JacobianScaling;
use crate::scene::Scene;
use crate::seed::stream;
use crate::session::SessionError;
use crate::simulation::injected::Injected;
use crate::statistics::Mean;

/// Millimetres per metre.
pub(super) const MM: f64 = 1e3;
/// Degrees per radian.
pub(super) const DEG: f64 = 180.0 / std::f64::consts::PI;

/// Every scaling of the Jacobian, with its name in scenes.
pub(super) const SCALINGS: [(JacobianScaling, &str); 3] =
    [(JacobianScaling::Si, "si"), (JacobianScaling::PerPose, "per_pose"), (JacobianScaling::Columns, "columns")];

/// An arm under experiment.
pub struct Bench<'a> {
    /// The scene: arm, sensor, plan and problem.
    pub scene: &'a Scene,
    /// What is injected.
    pub injected: &'a Injected,
    /// Is told how far the experiments are.
    pub progress: &'a Steps,
    /// What no choice can go beyond, for the scene as it is.
    pub limits: Limits,
    models: [OnceLock<Models>; 3],
    optimum: OnceLock<Found>,
}

impl<'a> Bench<'a> {
    /// Nothing is computed yet.
    #[must_use]
    pub fn new(scene: &'a Scene, injected: &'a Injected, progress: &'a Steps) -> Self {
        Bench { scene, injected, progress, limits: Limits::default(), models: Default::default(), optimum: OnceLock::new() }
    }

    /// Makes `count` trials of `what` side by side, as [`Bench::parts`] does.
    pub(super) fn trials<T: Send>(
        &self,
        what: &'static str,
        count: usize,
        trial: impl Fn(usize) -> Result<T, SessionError> + Sync,
    ) -> Result<Vec<T>, SessionError> {
        self.progress.begin(what, count)?;
        self.parts(count, trial)
    }

    /// Makes so many parts of what has begun side by side, each a function of its number alone; what came out in the order of the
    /// numbers.
    pub(super) fn parts<T: Send>(
        &self,
        count: usize,
        part: impl Fn(usize) -> Result<T, SessionError> + Sync,
    ) -> Result<Vec<T>, SessionError> {
        let told = |number| {
            let made = part(number)?;
            self.progress.done()?;
            Ok(made)
        };
        (0..count).into_par_iter().map(told).collect()
    }

    /// Models of the scene.
    ///
    /// # Errors
    /// If every configuration is refused.
    pub fn models(&self) -> Result<&Models, SessionError> {
        self.models_scaled(self.scene.design.jacobian_scaling)
    }

    /// Models of the scene with another scaling of the Jacobian.
    ///
    /// # Errors
    /// If every configuration is refused.
    pub fn models_scaled(&self, scaling: JacobianScaling) -> Result<&Models, SessionError> {
        let cell = &self.models[SCALINGS.iter().position(|(other, _)| *other == scaling).unwrap_or(0)];
        if let Some(models) = cell.get() {
            return Ok(models);
        }
        let mut scene = self.scene.clone();
        scene.design.jacobian_scaling = scaling;
        let models = Models::new(&scene.request())?;
        Ok(cell.get_or_init(|| models))
    }

    /// The set that the paper's method chooses: Table 5's swarm on O_C, with the scene's m and scaling.
    ///
    /// # Errors
    /// If every configuration is refused.
    pub fn optimum(&self) -> Result<&Found, SessionError> {
        if let Some(found) = self.optimum.get() {
            return Ok(found);
        }
        let found = self.swarm(self.scene.design.jacobian_scaling, 0)?;
        Ok(self.optimum.get_or_init(|| found))
    }

    /// Run `number` of Table 5's swarm on O_C.
    ///
    /// # Errors
    /// If every configuration is refused.
    pub fn swarm(&self, scaling: JacobianScaling, number: usize) -> Result<Found, SessionError> {
        let models = self.models_scaled(scaling)?;
        let label = format!("optimise/swarm/{number}");
        let budget = self.scene.design.swarm.evaluations();
        let choice = Choice { method: Method::Pso, criterion: Criterion::Comprehensive, count: self.scene.design.count, budget };
        Ok(choose(self.scene, models, choice, &label, &mut |_| {})?.0)
    }
}

/// What is to be searched, and how.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub(super) method: Method,
    pub(super) criterion: Criterion,
    /// Configurations of the set.
    pub(super) count: usize,
    /// Values of the criterion.
    pub(super) budget: u64,
}

/// Searches under the scene's rules; what was found and the values of the criterion that it took.
pub(super) fn choose(
    scene: &Scene,
    models: &Models,
    choice: Choice,
    label: &str,
    watch: &mut dyn FnMut(SearchReport),
) -> Result<(Found, u64), SessionError> {
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let objective = Objective::new(models, choice.criterion, scene.arm.joint_count());
    let task = Task::new(&rules, &objective, choice.count, choice.budget, scene.design.pool);
    let mut stream = stream(scene.seed, label);
    let mut watch = |told: SearchReport| {
        watch(told);
        Ok(())
    };
    // A swarm makes as many iterations as it may.
    let mut swarm = scene.design.swarm.clone();
    swarm.iterations = (usize::try_from(choice.budget).unwrap_or(usize::MAX) / swarm.particles.max(1)).saturating_sub(1);
    let found = search(choice.method, &task, &swarm, &mut stream, &mut watch).map_err(DesignError::from)?;
    Ok((found, task.evaluations()))
}

/// Fewest configurations that give as many equations as there are parameters to tell apart.
pub(super) fn fewest(models: &Models) -> usize {
    models.information.rank().div_ceil(models.information.rows_per_pose())
}

/// One fit, without its details.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) converged: bool,
    /// Whether it held combinations that the arm's structure would let be told.
    pub(super) held: bool,
    pub(super) after: Errors,
    pub(super) before: Errors,
    /// Of the verification.
    pub(super) residuals: Vec<Residual>,
}

impl Fit {
    /// Fits `set` in `trial`; `rank` is what the arm's structure lets be told.
    pub(super) fn new(trial: &Trial<'_>, set: &[f64], rank: usize) -> Result<Fit, SessionError> {
        let calibrated = trial.calibrate(set)?;
        Ok(Fit {
            converged: calibrated.converged,
            held: calibrated.identification.rank < rank,
            after: calibrated.after,
            before: calibrated.before,
            residuals: calibrated.verification,
        })
    }

    /// Mean position error after calibration, mm.
    pub(super) fn position_mm(&self) -> f64 {
        MM * self.after.position_m.mean
    }

    /// Mean orientation error after calibration, °; NaN where no orientation is measured.
    pub(super) fn orientation_deg(&self) -> f64 {
        orientation(&self.after, |summary| summary.mean)
    }
}

/// A number of the orientation errors in °; NaN where there are none.
pub(super) fn orientation(errors: &Errors, get: impl Fn(&Summary) -> f64) -> f64 {
    errors.rotation_rad.as_ref().map_or(f64::NAN, |summary| DEG * get(summary))
}

/// Counts how fits ended.
pub(super) fn tally<'f>(fits: impl IntoIterator<Item = &'f Fit>) -> Tally {
    let one = |fit: &Fit| Tally { fits: 1, not_converged: usize::from(!fit.converged), held: usize::from(fit.held) };
    fits.into_iter().map(one).sum()
}

/// Mean over the fits that converged; `None` where there is none, or nothing to be had from them.
pub(super) fn mean<'f>(fits: impl IntoIterator<Item = &'f Fit>, get: impl Fn(&Fit) -> f64) -> Option<Mean> {
    mean_of(fits.into_iter().filter(|fit| fit.converged).map(get))
}

/// Mean of the values that are numbers.
pub(super) fn mean_of(values: impl IntoIterator<Item = f64>) -> Option<Mean> {
    Mean::of(&values.into_iter().filter(|value| value.is_finite()).collect::<Vec<_>>())
}

/// `12.3 % (10.0 … 14.5)` of a share.
pub(super) fn percent(share: Option<Mean>) -> String {
    let Some(share) = share else { return "–".to_owned() };
    match share.interval95 {
        Some([low, high]) => format!("{:.1} % ({:.1} … {:.1})", 100.0 * share.mean, 100.0 * low, 100.0 * high),
        None => format!("{:.1} %", 100.0 * share.mean),
    }
}

/// A mean with `digits` decimals.
pub(super) fn plain(mean: Option<Mean>, digits: usize) -> String {
    mean.map_or_else(|| "–".to_owned(), |mean| format!("{:.digits$}", mean.mean))
}
