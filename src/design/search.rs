//! What all methods share: the task, what they find, what they tell, and the count of what they spend.
//!
//! A method sees the task and a random stream, and nothing else: the same rules, the same criterion, and the same budget for all.
//! The unit of the budget is one value of the criterion, whether it is computed from a whole set or from the change of one
//! configuration; it is counted here, not by the methods.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::candidates::{NothingMeasurable, Rules, RulesScratch, Sampler};
use super::objective::{Objective, ObjectiveScratch, Set};
use super::outcome::{SearchStep, StopReason, SwarmIteration};
use super::problem::{Method, Swarm};
use crate::arm::Arm;
use crate::progress::{Progress, Stopped};
use crate::seed::Stream;

/// A search for a set of configurations.
pub struct Task<'a> {
    /// What every configuration must keep to.
    pub rules: &'a Rules<'a>,
    /// What is to be made large.
    pub objective: &'a Objective<'a>,
    /// Configurations of the set.
    pub count: usize,
    /// Values of the criterion that may be computed.
    pub budget: u64,
    /// Candidates of methods that choose from a pool.
    pub pool: usize,
    evaluations: AtomicU64,
    rejections: AtomicU64,
}

/// A search failed.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// No configuration may be measured.
    #[error(transparent)]
    NothingMeasurable(#[from] NothingMeasurable),
    /// Whoever watches refused a step.
    #[error(transparent)]
    Watcher(#[from] Stopped),
}

/// What a search tells.
#[derive(Clone, Debug, PartialEq)]
pub enum SearchReport {
    /// The paper's swarm, in all its particles.
    Swarm(SwarmIteration),
    /// A step of any other method.
    Step(SearchStep),
}

/// Whoever watches a search.
pub type Watch<'w> = dyn Progress<SearchReport> + 'w;

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The best set: configurations one after the other (rad or m).
    pub configurations: Vec<f64>,
    /// Its value.
    pub value: f64,
    /// Why the method stopped.
    pub stop: StopReason,
}

/// Memory of one thread of a search.
#[derive(Default)]
pub struct Scratch {
    /// For values.
    pub objective: ObjectiveScratch,
    /// For the rules.
    pub rules: RulesScratch,
}

impl<'a> Task<'a> {
    /// A task of which nothing has been spent.
    #[must_use]
    pub fn new(rules: &'a Rules<'a>, objective: &'a Objective<'a>, count: usize, budget: u64, pool: usize) -> Self {
        Task { rules, objective, count, budget, pool, evaluations: AtomicU64::new(0), rejections: AtomicU64::new(0) }
    }

    /// The arm.
    #[must_use]
    pub fn arm(&self) -> &'a Arm {
        self.rules.arm()
    }

    /// Values of the criterion so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations.load(Ordering::Relaxed)
    }

    /// Values of the criterion that are left. To be asked between parallel parts, not within: what is spent there depends on
    /// nothing but the task.
    #[must_use]
    pub fn left(&self) -> u64 {
        self.budget.saturating_sub(self.evaluations())
    }

    /// Configurations refused so far.
    #[must_use]
    pub fn rejections(&self) -> u64 {
        self.rejections.load(Ordering::Relaxed)
    }

    /// Counts `count` values that a method computed by a formula of its own.
    pub fn spend(&self, count: u64) {
        self.evaluations.fetch_add(count, Ordering::Relaxed);
    }

    /// Whether `joints` is against the rules; counted if so.
    pub fn refuses(&self, joints: &[f64], scratch: &mut Scratch) -> bool {
        let refused = self.rules.refuses(joints, &mut scratch.rules);
        if refused {
            self.rejections.fetch_add(1, Ordering::Relaxed);
        }
        refused
    }

    /// `count` random configurations within the rules.
    ///
    /// # Errors
    /// If none is.
    pub fn draw(&self, stream: &mut Stream, count: usize) -> Result<Vec<f64>, NothingMeasurable> {
        let mut sampler = Sampler::new(self.rules);
        let drawn = sampler.draw(stream, count);
        self.rejections.fetch_add(sampler.rejections, Ordering::Relaxed);
        drawn
    }

    /// Value of a whole set; one of the budget.
    pub fn value(&self, configurations: &[f64], scratch: &mut Scratch) -> f64 {
        self.spend(1);
        self.objective.value(configurations, &mut scratch.objective)
    }

    /// Values of whole sets side by side, in their order.
    pub fn values(&self, sets: &[Vec<f64>]) -> Vec<f64> {
        sets.par_iter().map_init(Scratch::default, |scratch, set| self.value(set, scratch)).collect()
    }

    /// Value of `set` with `joints` in place of configuration `index`; one of the budget.
    pub fn value_with(&self, set: &Set<'_>, index: usize, joints: &[f64], scratch: &mut Scratch) -> f64 {
        self.spend(1);
        set.value_with(index, joints, &mut scratch.objective)
    }

    /// A step to tell; `improved` where `best` is better than any told before.
    #[must_use]
    pub fn step(&self, step: usize, value: f64, best: f64, improved: Option<&[f64]>) -> SearchReport {
        SearchReport::Step(SearchStep {
            step,
            evaluations: self.evaluations(),
            budget: self.budget,
            rejections: self.rejections(),
            value: finite(value),
            best: finite(best),
            best_configurations: improved.map_or_else(Vec::new, |set| split(set, self.arm().joint_count())),
        })
    }
}

/// A value as it is told. A set that determines nothing has −∞, which JSON cannot hold: [`f64::MIN`] stands for it.
#[must_use]
pub fn finite(value: f64) -> f64 {
    value.clamp(f64::MIN, f64::MAX)
}

/// Splits configurations that stand one after the other.
#[must_use]
pub fn split(configurations: &[f64], joint_count: usize) -> Vec<Vec<f64>> {
    configurations.chunks_exact(joint_count).map(<[f64]>::to_vec).collect()
}

/// Runs `method` on `task`. All random numbers come from `stream`; the outcome does not depend on the number of threads.
///
/// `swarm` are the settings of the particle swarms; where the budget allows fewer iterations, fewer are made.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(
    method: Method,
    task: &Task<'_>,
    swarm: &Swarm,
    stream: &mut Stream,
    watch: &mut Watch<'_>,
) -> Result<Found, SearchError> {
    match method {
        Method::Pso => super::swarm::search(task, swarm, stream, watch),
        Method::BestOfRandom => super::best_of_random::search(task, stream, watch),
        Method::CoordinateExchange => super::coordinate_exchange::search(task, stream, watch),
        Method::Annealing => super::annealing::search(task, stream, watch),
        Method::Detmax => super::detmax::search(task, stream, watch),
        Method::ImprovedPso => super::improved_swarm::search(task, swarm, stream, watch),
        Method::Genetic => super::genetic::search(task, stream, watch),
        Method::GeneticRepeated => super::genetic_repeated::search(task, stream, watch),
        Method::Perturbation => super::perturbation::search(task, stream, watch),
        Method::Random => {
            let configurations = task.draw(stream, task.count)?;
            let value = task.value(&configurations, &mut Scratch::default());
            watch.report(task.step(0, value, value, Some(&configurations)))?;
            Ok(Found { configurations, value, stop: StopReason::Drawn })
        }
    }
}
