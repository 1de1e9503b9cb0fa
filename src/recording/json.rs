//! JSON forms of the source messages, where they are not those of the events themselves.

use serde::{Deserialize, Serialize};

use crate::design::outcome::{Advice, DesignOutcome, EvennessDomains, RandomReference, StopReason, SwarmIteration};
use crate::quality::Indexes;

/// A configuration as an object: Foxglove shows no arrays of arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Configuration {
    joints: Vec<f64>,
}

fn wrap(configurations: &[Vec<f64>]) -> Vec<Configuration> {
    configurations.iter().map(|joints| Configuration { joints: joints.clone() }).collect()
}

fn unwrap(configurations: Vec<Configuration>) -> Vec<Vec<f64>> {
    configurations.into_iter().map(|configuration| configuration.joints).collect()
}

/// [`SwarmIteration`] without its end points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Swarm {
    iteration: usize,
    iterations: usize,
    fitness: Vec<f64>,
    personal_best: Vec<f64>,
    best_particle: usize,
    best: Indexes,
    inertia: f64,
    c1: f64,
    c2: f64,
    evaluations: u64,
    rejections: u64,
    best_configurations: Vec<Configuration>,
}

impl From<&SwarmIteration> for Swarm {
    fn from(swarm: &SwarmIteration) -> Self {
        Swarm {
            iteration: swarm.iteration,
            iterations: swarm.iterations,
            fitness: swarm.fitness.clone(),
            personal_best: swarm.personal_best.clone(),
            best_particle: swarm.best_particle,
            best: swarm.best,
            inertia: swarm.inertia,
            c1: swarm.c1,
            c2: swarm.c2,
            evaluations: swarm.evaluations,
            rejections: swarm.rejections,
            best_configurations: wrap(&swarm.best_configurations),
        }
    }
}

impl From<Swarm> for SwarmIteration {
    fn from(swarm: Swarm) -> Self {
        SwarmIteration {
            iteration: swarm.iteration,
            iterations: swarm.iterations,
            fitness: swarm.fitness,
            personal_best: swarm.personal_best,
            best_particle: swarm.best_particle,
            best: swarm.best,
            inertia: swarm.inertia,
            c1: swarm.c1,
            c2: swarm.c2,
            evaluations: swarm.evaluations,
            rejections: swarm.rejections,
            end_points: Vec::new(),
            best_configurations: unwrap(swarm.best_configurations),
        }
    }
}

/// [`DesignOutcome`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Design {
    method: String,
    criterion: String,
    value: f64,
    advice: Option<Advice>,
    configurations: Vec<Configuration>,
    indexes: Indexes,
    indexes_all_parameters: Indexes,
    evenness_domains: EvennessDomains,
    random: RandomReference,
    dropped_parameters: Vec<String>,
    evaluations: u64,
    rejections: u64,
    stop: StopReason,
}

impl From<&DesignOutcome> for Design {
    fn from(outcome: &DesignOutcome) -> Self {
        Design {
            method: outcome.method.clone(),
            criterion: outcome.criterion.clone(),
            value: outcome.value,
            advice: outcome.advice,
            configurations: wrap(&outcome.configurations),
            indexes: outcome.indexes,
            indexes_all_parameters: outcome.indexes_all_parameters,
            evenness_domains: outcome.evenness_domains,
            random: outcome.random.clone(),
            dropped_parameters: outcome.dropped_parameters.clone(),
            evaluations: outcome.evaluations,
            rejections: outcome.rejections,
            stop: outcome.stop,
        }
    }
}

impl From<Design> for DesignOutcome {
    fn from(design: Design) -> Self {
        DesignOutcome {
            method: design.method,
            criterion: design.criterion,
            value: design.value,
            advice: design.advice,
            configurations: unwrap(design.configurations),
            indexes: design.indexes,
            indexes_all_parameters: design.indexes_all_parameters,
            evenness_domains: design.evenness_domains,
            random: design.random,
            dropped_parameters: design.dropped_parameters,
            evaluations: design.evaluations,
            rejections: design.rejections,
            stop: design.stop,
        }
    }
}
