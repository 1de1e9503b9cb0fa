//! Choosing the configurations to measure.

pub mod advice;
pub mod annealing;
pub mod approximate;
pub mod best_of_random;
pub mod bound;
pub mod candidates;
pub mod coordinate_exchange;
pub mod detmax;
pub mod genetic;
pub mod genetic_repeated;
pub mod improved_swarm;
mod moves;
pub mod objective;
pub mod outcome;
pub mod perturbation;
mod pool;
pub mod problem;
pub mod route;
pub mod search;
pub mod swarm;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::progress::Stopped;
use crate::quality::EvennessDomain;
use crate::quality::Indexes;
use crate::quality::evaluator::{Evaluator, Scratch};
use crate::quality::globality::WorkspaceGrid;
use crate::seed::stream;
use candidates::{NothingMeasurable, Rules, Sampler};
use objective::{Models, Objective};
use outcome::{DesignOutcome, EvennessDomains, RandomReference};
use problem::{Method, Request};
use search::{SearchError, Task, Watch, finite, search, split};

/// A design could not be made.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// No configuration may be measured.
    #[error(transparent)]
    NothingMeasurable(#[from] NothingMeasurable),
    /// Whoever records or shows the run failed.
    #[error(transparent)]
    Listener(#[from] Stopped),
}

impl From<SearchError> for DesignError {
    fn from(error: SearchError) -> Self {
        match error {
            SearchError::NothingMeasurable(error) => error.into(),
            SearchError::Watcher(error) => error.into(),
        }
    }
}

/// Chooses the configurations that `request` asks for by its method and criterion, telling `watch` every step.
///
/// # Errors
/// If no configuration may be measured, or the watcher stops it.
pub fn design(request: &Request<'_>, watch: &mut Watch<'_>) -> Result<DesignOutcome, DesignError> {
    let Request { arm, problem, .. } = *request;
    let rules = Rules::measurable(arm, request.sensor);
    let models = Models::new(request)?;
    let evaluator = &models.evaluator;
    let random_sets = random_sets(request, &rules)?;
    let random = reference(&random_sets, evaluator);

    let objective = Objective::new(&models, problem.criterion, arm.joint_count());
    let budget = match problem.method {
        Method::Pso => problem.swarm.evaluations(),
        _ => problem.budget,
    };
    let task = Task::new(&rules, &objective, problem.count, budget, problem.pool);
    let found = search(problem.method, &task, &problem.swarm, &mut stream(request.seed, "design/choose"), watch)?;

    let mut scratch = Scratch::default();
    let indexes = evaluator.evaluate(&found.configurations, &mut scratch);
    let indexes_all_parameters = evaluator.evaluate_all_parameters(&found.configurations, &mut scratch);
    let end_points = evaluator.end_points(&scratch);
    let evenness_in = |domain| {
        if domain == problem.evenness_domain {
            indexes.evenness
        } else {
            WorkspaceGrid::new(arm, domain, problem.evenness_step_m).evenness(end_points)
        }
    };
    let advice = advice::advise(problem, &models, &rules, &found.configurations, &random_sets);
    Ok(DesignOutcome {
        method: problem.method.name().to_owned(),
        criterion: problem.criterion.name().to_owned(),
        value: finite(found.value),
        configurations: split(&found.configurations, arm.joint_count()),
        indexes,
        indexes_all_parameters,
        evenness_domains: EvennessDomains {
            reachable: evenness_in(EvennessDomain::Reachable),
            bounding_cube: evenness_in(EvennessDomain::BoundingCube),
        },
        random,
        no_advice: advice.as_ref().err().map(ToString::to_string),
        advice: advice.ok(),
        dropped_parameters: evaluator.subspace().dropped.iter().map(|&c| arm.chain.parameters[c].name.clone()).collect(),
        evaluations: task.evaluations(),
        rejections: task.rejections(),
        stop: found.stop,
    })
}

/// `count` configurations that verify: uniform within the limits and the rules, from a stream of their own. `exact`: an exact
/// reference reads them, which sees everything; a sensor's readings must be within its view.
///
/// # Errors
/// If no configuration is free of collisions.
pub fn held_out(request: &Request<'_>, count: usize, exact: bool) -> Result<Vec<Vec<f64>>, NothingMeasurable> {
    let rules = if exact { Rules::reachable(request.arm) } else { Rules::measurable(request.arm, request.sensor) };
    let drawn = Sampler::new(&rules).draw(&mut stream(request.seed, "plan/held_out"), count)?;
    Ok(split(&drawn, request.arm.joint_count()))
}

fn random_sets(request: &Request<'_>, rules: &Rules<'_>) -> Result<Vec<Vec<f64>>, NothingMeasurable> {
    let mut sampler = Sampler::new(rules);
    (0..request.problem.random_sets)
        .map(|set| sampler.draw(&mut stream(request.seed, &format!("design/random/{set}")), request.problem.count))
        .collect()
}

fn reference(sets: &[Vec<f64>], evaluator: &Evaluator) -> RandomReference {
    let indexes: Vec<Indexes> =
        sets.par_iter().map_init(Scratch::default, |scratch, set| evaluator.evaluate(set, scratch)).collect();
    let over = |combine: fn(f64, f64) -> f64, start: f64| {
        fold(&indexes, |values| values.fold(start, combine), |ranks| ranks.fold(start, |a, b| combine(a, b as f64)) as usize)
    };
    let count = indexes.len().max(1) as f64;
    let mean = fold(&indexes, |values| values.sum::<f64>() / count, |ranks| (ranks.sum::<usize>() as f64 / count) as usize);
    if indexes.is_empty() {
        return RandomReference { sets: 0, mean: Indexes::default(), min: Indexes::default(), max: Indexes::default() };
    }
    RandomReference { sets: indexes.len(), mean, min: over(f64::min, f64::INFINITY), max: over(f64::max, f64::NEG_INFINITY) }
}

/// Combines every field of `indexes`.
fn fold(
    indexes: &[Indexes],
    combine: impl Fn(&mut dyn Iterator<Item = f64>) -> f64,
    combine_ranks: impl Fn(&mut dyn Iterator<Item = usize>) -> usize,
) -> Indexes {
    let field = |get: fn(&Indexes) -> f64| combine(&mut indexes.iter().map(get));
    Indexes {
        o1: field(|i| i.o1),
        o2: field(|i| i.o2),
        o3: field(|i| i.o3),
        o4: field(|i| i.o4),
        o5: field(|i| i.o5),
        o6: field(|i| i.o6),
        dispersion_m2: field(|i| i.dispersion_m2),
        evenness: field(|i| i.evenness),
        comprehensive: field(|i| i.comprehensive),
        rank: combine_ranks(&mut indexes.iter().map(|i| i.rank)),
    }
}
