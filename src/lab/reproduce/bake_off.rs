//! Method × criterion × situation, judged by the held-out error of calibrations.
//!
//! In every situation each method chooses one set by each criterion, all with the same budget; random sets are drawn beside them.
//! Every set is then calibrated with over and over: trial t has the same true arm, verification and noise for every set, so that
//! sets are compared in pairs. Each criterion's value of each set is kept, to tell which of them predicts the error.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::Experiment;
use super::bench::Bench;
use super::findings::{Claim, Data, Found, Tally, with_ends};
use super::situation::{Reach, Sees, Situation};
use crate::design::DesignError;
use crate::design::bound::bound;
use crate::design::candidates::Rules;
use crate::design::objective::{Models, Objective};
use crate::design::problem::{Criterion, Method};
use crate::design::search::{Task, search};
use crate::figure::{Axis, Colour, Estimate, Figure, Kind, Panel, Series, Shade};
use crate::lab::trial::Trial;
use crate::progress::Silent;
use crate::scene::Scene;
use crate::seed::{derive, stream};
use crate::session::SessionError;
use crate::statistics::{Mean, rank_correlation};

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
            budget: 1005,
            random_sets: 20,
            counts: vec![8, 12, 20, 40],
            methods: METHODS.to_vec(),
            criteria: Criterion::ALL.to_vec(),
        }
    }
}

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    name: "bake-off",
    place: "beyond the paper",
    about: "method × criterion × situation, judged by held-out error (a quarter of an hour per arm)",
    trials: 100,
    work: experiment,
};

/// Methods that choose, the paper's first.
const METHODS: [Method; 8] = [
    Method::Pso,
    Method::ImprovedPso,
    Method::Genetic,
    Method::Annealing,
    Method::Detmax,
    Method::Perturbation,
    Method::CoordinateExchange,
    Method::BestOfRandom,
];

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
    /// Calibrations with random sets that did not converge.
    pub random_not_converged: usize,
    /// Calibrations that held combinations at nominal because the set does not show them.
    pub held: usize,
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

/// The bake-off on the arm of `bench`. Every search and every trial is told; [`steps`] says how many there will be.
fn run(bench: &Bench<'_>, settings: &Settings) -> Result<Vec<SituationResult>, SessionError> {
    let base = bench.scene;
    let mut results = Vec::new();
    for cell in cells() {
        let scene = cell.scene(base);
        let models = Models::new(&scene.request())?;
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let limit = bound(&models, &rules, Criterion::IOptimality, BOUND_POOL).ok();
        for &count in &settings.counts {
            let cell = Situation { count, ..cell };
            if !determined(&models, count) {
                continue;
            }
            let contenders = contenders(bench, &cell, &models, &rules, settings)?;
            for effects in [false, true] {
                let situation = Situation { effects, ..cell };
                let (errors, held) = errors(bench, situation, &contenders, &models, settings.trials)?;
                let bound_m = limit.as_ref().map_or(f64::NAN, |limit| limit.least_rms_m(count));
                results.push(judge(situation, &contenders, &errors, held, bound_m));
            }
        }
    }
    Ok(results)
}

/// Steps that [`run`] tells of.
fn steps(base: &Scene, settings: &Settings) -> usize {
    let sets = settings.methods.len() * settings.criteria.len();
    let of = |cell: Situation| -> usize {
        let scene = cell.scene(base);
        let information = crate::quality::information::InformationModel::new(&scene.arm, &scene.sensor, scene.weights);
        let feasible = |count: &&usize| **count * information.rows_per_pose() >= information.rank();
        settings.counts.iter().filter(feasible).count()
    };
    cells().map(|cell| of(cell) * (sets + 2 * settings.trials)).sum()
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
    bench: &Bench<'_>,
    cell: &Situation,
    models: &Models,
    rules: &Rules<'_>,
    settings: &Settings,
) -> Result<Vec<Contender>, SessionError> {
    let base = bench.scene;
    let joints = base.arm.joint_count();
    let label = |what: &str| format!("bake_off/{}/{}/{what}", cell.words(), cell.count);
    let pairs: Vec<(Method, Criterion)> =
        settings.methods.iter().flat_map(|method| settings.criteria.iter().map(|criterion| (*method, *criterion))).collect();
    type Chosen = (Option<(Method, Criterion)>, Vec<f64>);
    let chosen: Vec<Chosen> = bench.parts(pairs.len(), |number| {
        let (method, criterion) = pairs[number];
        let objective = Objective::new(models, criterion, joints);
        // A swarm makes as many iterations as the budget lets it.
        let mut swarm = base.design.swarm.clone();
        swarm.iterations = usize::try_from(settings.budget).unwrap_or(usize::MAX) / swarm.particles.max(1);
        let task = Task::new(rules, &objective, cell.count, settings.budget, POOL);
        let mut stream = stream(base.seed, &label(&format!("{}/{}", method.name(), criterion.name())));
        let found = search(method, &task, &swarm, &mut stream, &mut Silent).map_err(DesignError::from)?;
        Ok((Some((method, criterion)), found.configurations))
    })?;
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

/// Mean held-out position error of every contender (rows) in every trial, m; NaN where the fit did not converge. And how many fits
/// held combinations at nominal.
fn errors(
    bench: &Bench<'_>,
    situation: Situation,
    contenders: &[Contender],
    models: &Models,
    trials: usize,
) -> Result<(Vec<Vec<f64>>, usize), SessionError> {
    let base = bench.scene;
    let mut scene = situation.scene(base);
    scene.seed = derive(base.seed, situation.count as u64);
    let injected = situation.injected(base);
    let by_trial: Vec<Vec<(f64, bool)>> = bench.parts(trials, |number| {
        let trial = Trial::new(&scene, &injected, number)?;
        let errors = contenders.iter().map(|contender| {
            let result = trial.calibrate(&contender.configurations)?;
            let held = result.identification.rank < models.information.rank();
            Ok((if result.converged { result.after.position_m.mean } else { f64::NAN }, held))
        });
        errors.collect()
    })?;
    let held = by_trial.iter().flatten().filter(|(_, held)| *held).count();
    let of = |contender: usize| by_trial.iter().map(|errors| errors[contender].0).collect();
    Ok(((0..contenders.len()).map(of).collect(), held))
}

fn judge(situation: Situation, contenders: &[Contender], errors: &[Vec<f64>], held: usize, bound_m: f64) -> SituationResult {
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
        random_not_converged: random.iter().flat_map(|set| &errors[*set]).filter(|error| error.is_nan()).count(),
        held,
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
fn mean_gains(results: &[SituationResult], of: impl Fn(&Situation) -> bool) -> BTreeMap<(Method, Criterion), f64> {
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

/// Of several gains the largest, with who has it.
fn best(gains: &BTreeMap<(Method, Criterion), f64>) -> Option<((Method, Criterion), f64)> {
    gains.iter().filter(|(_, gain)| gain.is_finite()).max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(key, gain)| (*key, *gain))
}

impl SituationResult {
    /// The choice of `method` by `criterion`.
    fn choice(&self, method: Method, criterion: Criterion) -> Option<&Choice> {
        self.choices.iter().find(|choice| choice.method == method && choice.criterion == criterion)
    }

    /// The choice of the largest gain.
    fn best(&self) -> Option<&Choice> {
        let gain = |choice: &&Choice| choice.gain.map(|gain| gain.mean);
        self.choices.iter().filter(|choice| gain(choice).is_some_and(f64::is_finite)).max_by(|a, b| {
            let [a, b] = [a, b].map(|choice| gain(choice).unwrap_or(f64::NEG_INFINITY));
            a.total_cmp(&b)
        })
    }

    /// Largest share by which any set can leave less than random ones of the noise's error.
    fn largest_gain(&self) -> Option<f64> {
        self.random_predicted_m.map(|random| 1.0 - self.bound_m / random).filter(|gain| gain.is_finite())
    }
}

/// Smallest gain that a table's shade tells from others, %.
const WORST_PERCENT: f64 = -50.0;

/// What the paper chooses by.
const PAPER: (Method, Criterion) = (Method::Pso, Criterion::Comprehensive);

fn experiment(bench: &Bench<'_>, trials: usize) -> Result<Found, SessionError> {
    let settings = Settings { trials, ..Settings::default() };
    bench.progress.begin("bake-off", steps(bench.scene, &settings))?;
    let results = run(bench, &settings)?;
    let ours = (Method::default(), Criterion::default());
    let everywhere = mean_gains(&results, |_| true);
    let gain_of = |gains: &BTreeMap<(Method, Criterion), f64>, key| 100.0 * gains.get(&key).copied().unwrap_or(f64::NAN);
    let (winner, _) = best(&everywhere).unwrap_or((ours, f64::NAN));
    let correlation = |criterion: Criterion, effects: bool| {
        finite_mean(results.iter().filter(|result| result.situation.effects == effects).flat_map(|result| {
            result.correlations.iter().filter(|other| other.criterion == criterion).filter_map(|other| other.among_random)
        }))
    };
    let verdict = format!(
        "Over {} situations the largest mean gain over random sets is that of {} on {}: {:.1} %; {} on {} gains {:.1} %, the paper's \
         {} on {} {:.1} %. Among random sets, the rank correlation with the held-out error (−1 is best) is {:.2} for i_optimality, \
         {:.2} for d_optimality, {:.2} for comprehensive, {:.2} for dispersion and {:.2} for evenness where nothing is un-modelled, and \
         {:.2}, {:.2}, {:.2}, {:.2}, {:.2} with play and warming.",
        results.len(),
        winner.0.name(),
        winner.1.name(),
        gain_of(&everywhere, winner),
        ours.0.name(),
        ours.1.name(),
        gain_of(&everywhere, ours),
        PAPER.0.name(),
        PAPER.1.name(),
        gain_of(&everywhere, PAPER),
        correlation(Criterion::IOptimality, false),
        correlation(Criterion::DOptimality, false),
        correlation(Criterion::Comprehensive, false),
        correlation(Criterion::Dispersion, false),
        correlation(Criterion::Evenness, false),
        correlation(Criterion::IOptimality, true),
        correlation(Criterion::DOptimality, true),
        correlation(Criterion::Comprehensive, true),
        correlation(Criterion::Dispersion, true),
        correlation(Criterion::Evenness, true),
    );
    let notes = vec![
        format!(
            "Every search may compute {} values of its criterion; {} random sets beside; {trials} calibrations with every set, paired. \
             A gain is of the mean held-out position error; the bound is of the RMS that noise leaves, so that with effects on it is \
             beyond reach. Every pair of method and criterion made one search in each situation, and the largest of {} mean gains is \
             flattered a little.",
            settings.budget,
            settings.random_sets,
            settings.methods.len() * settings.criteria.len(),
        ),
        "Laser tracker of 15 µm + 6 µm/m, orientation 0.003°; errors of ±1 mm and ±0.2°; effects: play of 30 µm and 100 µrad in the \
         second and the fourth joint, links that warm by up to 10 K and cool."
            .to_owned(),
    ];
    let fits = Tally {
        fits: results.iter().map(|result| (result.choices.len() + settings.random_sets) * trials).sum(),
        not_converged: results
            .iter()
            .map(|result| result.random_not_converged + result.choices.iter().map(|choice| choice.not_converged).sum::<usize>())
            .sum(),
        held: results.iter().map(|result| result.held).sum(),
    };
    Ok(Found {
        claims: claims(&results, ours),
        verdict,
        notes,
        fits,
        data: data(&results),
        figures: figures(&results, &settings, ours),
    })
}

/// Random error, and the gains of the paper's choice, of ours and of the best, situation by situation.
fn claims(results: &[SituationResult], ours: (Method, Criterion)) -> Vec<Claim> {
    let mut claims = Vec::new();
    for result in results {
        let situation = format!("{}, m = {}", result.situation.words(), result.situation.count);
        let bound = result.largest_gain().map(|gain| 100.0 * gain);
        claims.push(Claim::new(format!("{situation}: random (mm)"), None, result.random.map(|random| random.times(1e3))));
        let named = [PAPER, ours].map(|(method, criterion)| result.choice(method, criterion));
        for choice in named.into_iter().chain([result.best()]).flatten() {
            let what = format!("  gain of {} on {} (%)", choice.method.name(), choice.criterion.name());
            claims.push(Claim::new(what, None, choice.gain.map(|gain| gain.times(100.0))).bounded(bound));
        }
    }
    claims
}

fn data(results: &[SituationResult]) -> Vec<Data> {
    let name = |situation: &Situation| vec![situation.words(), situation.count.to_string()];
    let missing = |mean: Option<Mean>, factor: f64| with_ends(mean.map(|mean| mean.times(factor)));
    let mut choices = Vec::new();
    let mut correlations = Vec::new();
    for result in results {
        let mut row = |who: [&str; 2], error: Option<Mean>, gain: Option<Mean>, predicted: Option<f64>, failed: usize| {
            let labels = [name(&result.situation), who.map(str::to_owned).to_vec()].concat();
            let predicted = predicted.map_or(f64::NAN, |predicted| 1e3 * predicted);
            let last = [predicted, 1e3 * result.bound_m, failed as f64];
            choices.push((labels, [missing(error, 1e3), missing(gain, 100.0), last].concat()));
        };
        row(["random", ""], result.random, None, result.random_predicted_m, 0);
        for choice in &result.choices {
            let who = [choice.method.name(), choice.criterion.name()];
            row(who, choice.error, choice.gain, choice.predicted_m, choice.not_converged);
        }
        for correlation in &result.correlations {
            let labels = [name(&result.situation), vec![correlation.criterion.name().to_owned()]].concat();
            let numbers = [correlation.among_random, correlation.among_all].map(|rho| rho.unwrap_or(f64::NAN));
            correlations.push((labels, numbers.to_vec()));
        }
    }
    let choice_columns = [
        "situation",
        "count",
        "method",
        "criterion",
        "error_mm",
        "error_low95_mm",
        "error_high95_mm",
        "gain_percent",
        "gain_low95_percent",
        "gain_high95_percent",
        "predicted_rms_mm",
        "bound_rms_mm",
        "not_converged",
    ];
    let correlation_columns = ["situation", "count", "criterion", "rank_correlation_random_sets", "rank_correlation_all_sets"];
    vec![
        Data::labelled("bake-off", &choice_columns, choices),
        Data::labelled("bake-off-correlations", &correlation_columns, correlations),
    ]
}

fn figures(results: &[SituationResult], settings: &Settings, ours: (Method, Criterion)) -> Vec<(String, Figure)> {
    let cells = |title: &str, of: &dyn Fn(&Situation) -> bool| {
        let gains = mean_gains(results, of);
        let values = settings.methods.iter().map(|method| {
            // Disasters would take all the shades.
            let of_criterion = |criterion: &Criterion| {
                gains.get(&(*method, *criterion)).map_or(f64::NAN, |gain| (100.0 * gain).max(WORST_PERCENT))
            };
            settings.criteria.iter().map(of_criterion).collect()
        });
        let cells = Kind::Cells { values: values.collect(), digits: 2, shade: Shade::Table };
        let names = |names: Vec<&'static str>| names.into_iter().map(|name| name.replace('_', " ")).collect::<Vec<_>>();
        let criteria = names(settings.criteria.iter().map(|criterion| criterion.name()).collect());
        let methods = names(settings.methods.iter().map(|method| method.name()).collect());
        Panel::new(Axis::categories("criterion", criteria), Axis::categories("method", methods))
            .titled(title)
            .with(Series::new("", cells))
    };
    let gains = Figure::new("Mean gain over random sets, held-out position error (%; losses cut at −50)", 1)
        .with(cells("full poses, effects off", &|s| s.sees == Sees::Pose && !s.effects))
        .with(cells("full poses, effects on", &|s| s.sees == Sees::Pose && s.effects))
        .with(cells("positions only, effects off", &|s| s.sees == Sees::Position && !s.effects))
        .with(cells("positions only, effects on", &|s| s.sees == Sees::Position && s.effects));

    let groups: [(&str, Sees, bool); 4] = [
        ("poses", Sees::Pose, false),
        ("poses, effects", Sees::Pose, true),
        ("positions", Sees::Position, false),
        ("positions, effects", Sees::Position, true),
    ];
    let correlation = |title: &str, get: fn(&Correlation) -> Option<f64>| {
        let values = groups.iter().map(|(_, sees, effects)| {
            let of = results.iter().filter(|result| result.situation.sees == *sees && result.situation.effects == *effects);
            let results: Vec<_> = of.collect();
            (0..Criterion::ALL.len())
                .map(|index| finite_mean(results.iter().filter_map(|result| get(&result.correlations[index]))))
                .collect()
        });
        let cells = Kind::Cells { values: values.collect(), digits: 2, shade: Shade::Table };
        let criteria = Criterion::ALL.map(|criterion| criterion.name().replace('_', " "));
        Panel::new(Axis::categories("criterion", criteria), Axis::categories("", groups.map(|(name, _, _)| name)))
            .titled(title)
            .with(Series::new("", cells))
    };
    let correlations = Figure::new("Rank correlation of criterion and held-out error (−1 predicts perfectly)", 1)
        .with(correlation("among random sets", |correlation| correlation.among_random))
        .with(correlation("among all sets", |correlation| correlation.among_all));

    let mut panel = Panel::new(
        Axis::linear("largest gain that the bound allows (%)"),
        Axis::linear("measured gain, mean held-out position error (%)"),
    );
    for (effects, name) in [(false, "effects off"), (true, "effects on")] {
        for (key, who) in [(ours, "I-optimality"), (PAPER, "the paper's choice")] {
            let points = results.iter().filter(|result| result.situation.effects == effects).filter_map(|result| {
                let gain = result.choice(key.0, key.1)?.gain?.times(100.0);
                Some(Estimate { x: 100.0 * result.largest_gain()?, y: gain.mean, x_interval: None, y_interval: gain.interval95 })
            });
            panel = panel.with(Series::new(format!("{who}, {name}"), Kind::Estimates(points.collect())));
        }
    }
    let against_bound = Figure::new("Measured gain against the bound", 1)
        .with(panel.with(Series::new("as much as the bound", Kind::Diagonal).colour(Colour::Dark)));
    vec![
        ("bake-off-gains".to_owned(), gains),
        ("bake-off-correlations".to_owned(), correlations),
        ("bake-off-bound".to_owned(), against_bound),
    ]
}
