//! Method × criterion × situation, judged by the held-out error of calibrations.
//!
//! In every situation each method chooses one set by each criterion, all with the same budget; random sets are drawn beside them.
//! Every set is then calibrated with over and over: trial t has the same true arm, verification and noise for every set, so that
//! sets are compared in pairs. Each criterion's value of each set is kept, to tell which of them predicts the error.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::situation::{Reach, Sees, Situation};
use super::statistics::{Mean, rank_correlation};
use super::trial::Trial;
use crate::design::bound::bound;
use crate::design::candidates::Rules;
use crate::design::objective::{Models, Objective};
use crate::design::search::{Task, search};
use crate::scene::{Criterion, Method, Scene};
use crate::seed::{derive, stream};
use crate::session::SessionError;

/// How large a bake-off is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Calibrations with every set.
    pub trials: usize,
    /// Values of the criterion that every search may compute.
    pub budget: u64,
    /// Random sets beside the chosen ones.
    pub random_sets: usize,
    /// Numbers of configurations.
    pub counts: Vec<usize>,
    /// Methods that choose.
    pub methods: Vec<Method>,
    /// What they choose for.
    pub criteria: Vec<Criterion>,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            trials: 100,
            budget: 2010,
            random_sets: 20,
            counts: vec![8, 12, 20, 40],
            methods: Method::ALL.into_iter().filter(|method| *method != Method::Random).collect(),
            criteria: Criterion::ALL.to_vec(),
        }
    }
}

/// Candidates of a method that chooses from a pool, so many that the budget lasts for some exchanges.
const POOL: usize = 100;
/// Candidates of the bound.
const BOUND_POOL: usize = 1000;

/// What came out in one situation.
#[derive(Clone, Debug, Serialize)]
pub struct SituationResult {
    /// The situation.
    pub situation: Situation,
    /// Mean held-out position error with random sets, m: a mean over the sets in every trial.
    pub random: Option<Mean>,
    /// Root of the mean squared position error that noise alone leaves: mean over the random sets that determine the parameters, m.
    pub random_predicted_m: Option<f64>,
    /// No set can leave less than this of noise, m.
    pub bound_m: f64,
    /// Every chosen set.
    pub choices: Vec<Choice>,
    /// How well each criterion orders sets by their error.
    pub correlations: Vec<Correlation>,
}

/// A chosen set and what it was worth.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// How it was chosen.
    pub method: Method,
    /// What for.
    pub criterion: Criterion,
    /// Mean held-out position error, m.
    pub error: Option<Mean>,
    /// By which share that is smaller than with random sets.
    pub gain: Option<Mean>,
    /// Root of the mean squared position error that noise alone leaves, m.
    pub predicted_m: Option<f64>,
    /// Calibrations that did not converge.
    pub not_converged: usize,
}

/// Spearman's rank correlation between a criterion (larger is better) and the mean held-out position error: −1 where the criterion
/// orders sets perfectly.
#[derive(Clone, Debug, Serialize)]
pub struct Correlation {
    /// The criterion.
    pub criterion: Criterion,
    /// Over the random sets.
    pub among_random: Option<f64>,
    /// Over all sets, chosen ones too.
    pub among_all: Option<f64>,
}

/// A set with the value of every criterion.
struct Contender {
    choice: Option<(Method, Criterion)>,
    configurations: Vec<f64>,
    values: Vec<f64>,
    predicted_m: Option<f64>,
}

/// The bake-off on the arm of `base`. `done` is called after every search and every trial, `total` tells how often that will be.
///
/// # Errors
/// Whatever a step reports.
pub fn run(base: &Scene, settings: &Settings, done: &(dyn Fn() + Sync)) -> Result<Vec<SituationResult>, SessionError> {
    let mut results = Vec::new();
    for cell in cells() {
        let scene = cell.scene(base);
        let models = Models::new(&scene)?;
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let limit = bound(&models, &rules, Criterion::IOptimality, BOUND_POOL).ok();
        for &count in &settings.counts {
            let cell = Situation { count, ..cell };
            if !determined(&models, count) {
                continue;
            }
            let contenders = contenders(&cell, base, &models, &rules, settings, done)?;
            for effects in [false, true] {
                let situation = Situation { effects, ..cell };
                let errors = errors(base, situation, &contenders, settings.trials, done)?;
                let bound_m = limit.as_ref().map_or(f64::NAN, |limit| limit.least_rms_m(count));
                results.push(judge(situation, &contenders, &errors, bound_m));
            }
        }
    }
    Ok(results)
}

/// Steps that [`run`] tells of, on an arm on which `feasible` cells can be calibrated.
#[must_use]
pub fn steps(base: &Scene, settings: &Settings) -> u64 {
    let sets = settings.methods.len() * settings.criteria.len();
    let of = |cell: Situation| -> usize {
        let scene = cell.scene(base);
        let information = crate::quality::information::InformationModel::new(&scene.arm, &scene.sensor, scene.weights);
        let feasible = |count: &&usize| **count * information.rows_per_pose() >= information.rank();
        settings.counts.iter().filter(feasible).count()
    };
    cells().map(|cell| of(cell) * (sets + 2 * settings.trials)).sum::<usize>() as u64
}

/// Every combination of sensor and reach, without effects.
fn cells() -> impl Iterator<Item = Situation> {
    let reaches = [Reach::Free, Reach::Limited, Reach::Cone];
    [Sees::Pose, Sees::Position]
        .into_iter()
        .flat_map(move |sees| reaches.map(|reach| Situation { sees, reach, effects: false, count: 0 }))
}

/// Whether `count` configurations can determine the parameters.
fn determined(models: &Models, count: usize) -> bool {
    count * models.information.rows_per_pose() >= models.information.rank()
}

fn contenders(
    cell: &Situation,
    base: &Scene,
    models: &Models,
    rules: &Rules<'_>,
    settings: &Settings,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Contender>, SessionError> {
    let joints = base.arm.joint_count();
    let label = |what: &str| format!("bake_off/{}/{}/{what}", cell.words(), cell.count);
    let pairs: Vec<(Method, Criterion)> =
        settings.methods.iter().flat_map(|method| settings.criteria.iter().map(|criterion| (*method, *criterion))).collect();
    let chosen: Vec<(Option<(Method, Criterion)>, Vec<f64>)> = pairs
        .into_par_iter()
        .map(|(method, criterion)| {
            let objective = Objective::new(models, criterion, joints);
            let task = Task::new(rules, &objective, cell.count, settings.budget, POOL);
            let mut stream = stream(base.seed, &label(&format!("{}/{}", method.name(), criterion.name())));
            let found = search(method, &task, &base.design.swarm, &mut stream, &mut |_| Ok(()));
            done();
            found.map(|found| (Some((method, criterion)), found.configurations))
        })
        .collect::<Result<_, _>>()
        .map_err(crate::design::DesignError::from)?;
    let mut sampler = crate::design::candidates::Sampler::new(rules);
    let mut stream = stream(base.seed, &label("random"));
    let random = (0..settings.random_sets)
        .map(|_| sampler.draw(&mut stream, cell.count).map(|set| (None, set)))
        .collect::<Result<Vec<_>, _>>()?;
    let objectives: Vec<Objective<'_>> =
        Criterion::ALL.into_iter().map(|criterion| Objective::new(models, criterion, joints)).collect();
    Ok(random
        .into_iter()
        .chain(chosen)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(choice, configurations)| {
            let values = objectives.iter().map(|objective| objective.value(&configurations, &mut Default::default())).collect();
            let predicted_m = models.predict(&configurations, joints).map(|prediction| prediction.position_rms_m);
            Contender { choice, configurations, values, predicted_m }
        })
        .collect())
}

/// Mean held-out position error of every contender (rows) in every trial, m; NaN where the fit did not converge.
fn errors(
    base: &Scene,
    situation: Situation,
    contenders: &[Contender],
    trials: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Vec<f64>>, SessionError> {
    let mut scene = situation.scene(base);
    scene.seed = derive(base.seed, situation.count as u64);
    let injected = situation.injected(base);
    let by_trial: Vec<Vec<f64>> = (0..trials)
        .into_par_iter()
        .map(|number| {
            let trial = Trial::new(&scene, &injected, number)?;
            let errors = contenders
                .iter()
                .map(|contender| {
                    let result = trial.calibrate(&contender.configurations)?;
                    Ok(if result.converged { result.after.position_m.mean } else { f64::NAN })
                })
                .collect::<Result<Vec<f64>, SessionError>>();
            done();
            errors
        })
        .collect::<Result<_, _>>()?;
    Ok((0..contenders.len()).map(|contender| by_trial.iter().map(|errors| errors[contender]).collect()).collect())
}

fn judge(situation: Situation, contenders: &[Contender], errors: &[Vec<f64>], bound_m: f64) -> SituationResult {
    let random: Vec<usize> = (0..contenders.len()).filter(|index| contenders[*index].choice.is_none()).collect();
    let trials = errors.first().map_or(0, Vec::len);
    // Of the random sets that converged in the trial.
    let random_errors: Vec<f64> = (0..trials).map(|trial| finite_mean(random.iter().map(|set| errors[*set][trial]))).collect();
    let pairs = |errors: &[f64]| -> (Vec<f64>, Vec<f64>) {
        errors.iter().zip(&random_errors).filter(|(a, b)| a.is_finite() && b.is_finite()).map(|(a, b)| (*a, *b)).unzip()
    };
    let choices = contenders
        .iter()
        .zip(errors)
        .filter_map(|(contender, errors)| {
            let (method, criterion) = contender.choice?;
            let (ours, theirs) = pairs(errors);
            Some(Choice {
                method,
                criterion,
                error: Mean::of(&ours),
                gain: Mean::gain(&ours, &theirs),
                predicted_m: contender.predicted_m,
                not_converged: errors.iter().filter(|error| error.is_nan()).count(),
            })
        })
        .collect();
    let mean_errors: Vec<f64> = errors.iter().map(|errors| finite_mean(errors.iter().copied())).collect();
    let correlate = |of: &[usize], criterion: usize| {
        let usable: Vec<usize> = of.iter().copied().filter(|index| mean_errors[*index].is_finite()).collect();
        let values: Vec<f64> = usable.iter().map(|index| contenders[*index].values[criterion]).collect();
        let errors: Vec<f64> = usable.iter().map(|index| mean_errors[*index]).collect();
        rank_correlation(&values, &errors)
    };
    let all: Vec<usize> = (0..contenders.len()).collect();
    let correlations = Criterion::ALL
        .into_iter()
        .enumerate()
        .map(|(index, criterion)| Correlation {
            criterion,
            among_random: correlate(&random, index),
            among_all: correlate(&all, index),
        })
        .collect();
    let predicted: Vec<f64> = random.iter().filter_map(|index| contenders[*index].predicted_m).collect();
    SituationResult {
        situation,
        random: Mean::of(&random_errors.iter().copied().filter(|error| error.is_finite()).collect::<Vec<_>>()),
        random_predicted_m: Mean::of(&predicted).map(|mean| mean.mean),
        bound_m,
        choices,
        correlations,
    }
}

/// Mean of the finite values; NaN where there are none.
fn finite_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|value| value.is_finite()).fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    if count == 0 { f64::NAN } else { sum / f64::from(count) }
}

/// Mean gain of every method and criterion over the situations that `of` picks.
#[must_use]
pub fn mean_gains(results: &[SituationResult], of: impl Fn(&Situation) -> bool) -> BTreeMap<(Method, Criterion), f64> {
    let mut gains: BTreeMap<(Method, Criterion), Vec<f64>> = BTreeMap::new();
    for result in results.iter().filter(|result| of(&result.situation)) {
        for choice in &result.choices {
            if let Some(gain) = choice.gain {
                gains.entry((choice.method, choice.criterion)).or_default().push(gain.mean);
            }
        }
    }
    gains.into_iter().map(|(key, gains)| (key, finite_mean(gains.into_iter()))).collect()
}
