//! Choosing the configurations to measure.

pub mod approximate;
pub mod candidates;
pub mod outcome;
pub mod swarm;

use rayon::prelude::*;

use crate::quality::Indexes;
use crate::quality::evaluator::{Evaluator, Scratch};
use crate::quality::globality::WorkspaceGrid;
use crate::recording::event::{Event, Listener, ListenerError};
use crate::scene::{EvennessDomain, Method, Scene};
use crate::seed::stream;
use crate::self_collision::CollisionCheck;
use candidates::{AlwaysColliding, Sampler};
use outcome::{DesignOutcome, EvennessDomains, RandomReference, StopReason};
use swarm::{Optimum, SwarmError, split};

/// A design could not be made.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// No configuration is free of collisions.
    #[error(transparent)]
    AlwaysColliding(#[from] AlwaysColliding),
    /// Whoever records or shows the run failed.
    #[error(transparent)]
    Listener(#[from] ListenerError),
}

/// Chooses the configurations of `scene` by its method, telling `listener` every iteration and the outcome.
///
/// # Errors
/// If no configuration is free of collisions, or the listener fails.
pub fn design(scene: &Scene, listener: &mut dyn Listener) -> Result<DesignOutcome, DesignError> {
    let arm = &scene.arm;
    let problem = &scene.design;
    let attitude = scene.sensor.attitude_sigma_rad.is_some();
    let check = CollisionCheck::new(arm);
    let evaluator = Evaluator::new(arm, attitude, problem.evenness_domain, problem.evenness_step_m, problem.jacobian_scaling);
    let random = random_sets(scene, &evaluator, &check)?;

    let mut stream = stream(scene.seed, "design/choose");
    let optimum = match problem.method {
        Method::Pso => {
            let watch = |iteration: &outcome::SwarmIteration| listener.take(&Event::Swarm(iteration.clone()));
            swarm::optimise(arm, &evaluator, &check, problem.count, &problem.swarm, &mut stream, watch).map_err(|error| {
                match error {
                    SwarmError::AlwaysColliding(error) => DesignError::AlwaysColliding(error),
                    SwarmError::Watcher(error) => DesignError::Listener(error),
                }
            })?
        }
        Method::Random => {
            let mut sampler = Sampler::new(arm, &check);
            let configurations = sampler.draw(&mut stream, problem.count)?;
            let indexes = evaluator.evaluate(&configurations, &mut Scratch::default());
            Optimum { configurations, indexes, evaluations: 1, rejections: sampler.rejections, stop: StopReason::Drawn }
        }
    };

    let mut scratch = Scratch::default();
    let indexes_all_parameters = evaluator.evaluate_all_parameters(&optimum.configurations, &mut scratch);
    let end_points = evaluator.end_points(&scratch);
    let evenness_in = |domain| {
        if domain == problem.evenness_domain {
            optimum.indexes.evenness
        } else {
            WorkspaceGrid::new(arm, domain, problem.evenness_step_m).evenness(end_points)
        }
    };
    let outcome = DesignOutcome {
        method: problem.method.name().to_owned(),
        configurations: split(&optimum.configurations, arm.joint_count()),
        indexes: optimum.indexes,
        indexes_all_parameters,
        evenness_domains: EvennessDomains {
            reachable: evenness_in(EvennessDomain::Reachable),
            bounding_cube: evenness_in(EvennessDomain::BoundingCube),
        },
        random,
        dropped_parameters: evaluator.subspace().dropped.iter().map(|&c| arm.chain.parameters[c].name.clone()).collect(),
        evaluations: optimum.evaluations,
        rejections: optimum.rejections,
        stop: optimum.stop,
    };
    listener.take(&Event::Designed(outcome.clone()))?;
    Ok(outcome)
}

/// Configurations that verify: uniform within the limits, free of collisions, from a stream of their own.
///
/// # Errors
/// If no configuration is free of collisions.
pub fn held_out(scene: &Scene) -> Result<Vec<Vec<f64>>, AlwaysColliding> {
    let check = CollisionCheck::new(&scene.arm);
    let mut sampler = Sampler::new(&scene.arm, &check);
    let drawn = sampler.draw(&mut stream(scene.seed, "plan/held_out"), scene.plan.held_out_count)?;
    Ok(split(&drawn, scene.arm.joint_count()))
}

fn random_sets(scene: &Scene, evaluator: &Evaluator, check: &CollisionCheck) -> Result<RandomReference, AlwaysColliding> {
    let mut sampler = Sampler::new(&scene.arm, check);
    let sets = (0..scene.design.random_sets)
        .map(|set| sampler.draw(&mut stream(scene.seed, &format!("design/random/{set}")), scene.design.count))
        .collect::<Result<Vec<_>, _>>()?;
    let indexes: Vec<Indexes> =
        sets.par_iter().map_init(Scratch::default, |scratch, set| evaluator.evaluate(set, scratch)).collect();
    let over = |combine: fn(f64, f64) -> f64, start: f64| {
        fold(&indexes, |values| values.fold(start, combine), |ranks| ranks.fold(start, |a, b| combine(a, b as f64)) as usize)
    };
    let count = indexes.len().max(1) as f64;
    let mean = fold(&indexes, |values| values.sum::<f64>() / count, |ranks| (ranks.sum::<usize>() as f64 / count) as usize);
    if indexes.is_empty() {
        return Ok(RandomReference { sets: 0, mean: Indexes::default(), min: Indexes::default(), max: Indexes::default() });
    }
    Ok(RandomReference { sets: indexes.len(), mean, min: over(f64::min, f64::INFINITY), max: over(f64::max, f64::NEG_INFINITY) })
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

impl Method {
    /// The method's name in scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Method::Pso => "pso",
            Method::Random => "random",
        }
    }
}
