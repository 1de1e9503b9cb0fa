//! What no choice of configurations can do better than: the optimal approximate design over everything that the arm can take.
//!
//! The bound is exact for choices among the candidates that it was computed from. To make it hold for all configurations within the
//! rules, candidates whose sensitivity is larger than the mean are searched for from many starts (joint by joint) and added, until
//! none is found; what the last search found goes into the gap, and the bound allows for the gap.

use rayon::prelude::*;

use super::approximate::{self, ApproximateDesign, ApproximateError, Settings};
use super::candidates::{AlwaysColliding, Rules, RulesScratch, Sampler};
use super::objective::Models;
use crate::quality::information::Blocks;
use crate::scene::Criterion;
use crate::seed::{Stream, stream};

/// Searches for further candidates.
const ROUNDS: usize = 4;
/// Random starts of a search.
const STARTS: usize = 32;
/// Members of the design, those of largest weight, from which a search starts too.
const MEMBERS: usize = 16;
/// Passes over the joints in a search.
const PASSES: usize = 2;
/// Values that are tried of a joint.
const LEVELS: usize = 8;
/// Gap that is good enough.
const GAP: f64 = 1e-3;

/// A bound, for one criterion.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The design that it comes from.
    pub design: ApproximateDesign,
    /// Largest sensitivity over the mean, less one, of all configurations that were looked at.
    pub gap: f64,
    /// Candidates of the design, and configurations that the searches ended at.
    pub candidates: usize,
    rank: usize,
}

/// There is no bound.
#[derive(Debug, thiserror::Error)]
pub enum BoundError {
    /// No configuration may be measured.
    #[error(transparent)]
    AlwaysColliding(#[from] AlwaysColliding),
    /// No design of the candidates determines the parameters.
    #[error(transparent)]
    Approximate(#[from] ApproximateError),
}

/// The bound for `criterion`, [`Criterion::DOptimality`] or else the mean variance of [`Criterion::IOptimality`], starting from
/// `pool` random candidates.
///
/// # Errors
/// If no configuration may be measured, or all together do not determine the parameters.
pub fn bound(models: &Models, rules: &Rules<'_>, criterion: Criterion, pool: usize) -> Result<Bound, BoundError> {
    let joints = rules.arm().joint_count();
    // A property of the arm and the rules, whatever the scene's seed.
    let mut stream = stream(0, "design/bound");
    let mut candidates = Sampler::new(rules).draw(&mut stream, pool)?;
    let goal = match criterion {
        Criterion::DOptimality => approximate::Criterion::D,
        _ => approximate::Criterion::L(models.workspace.position_matrix()),
    };
    let settings = Settings { gap: GAP, ..Settings::default() };
    let mut round = 0;
    loop {
        let blocks = Blocks::of(&models.information, &candidates, joints);
        let design = approximate::optimise(&blocks, goal, &settings)?;
        let found = climb(models, rules, goal, &design, &candidates, &mut stream)?;
        let largest = found.iter().map(|(sensitivity, _)| *sensitivity).fold(1.0, f64::max);
        round += 1;
        if largest <= 1.0 + GAP || round == ROUNDS {
            let gap = design.gap.max(largest - 1.0);
            return Ok(Bound { gap, candidates: blocks.len() + found.len(), rank: models.information.rank(), design });
        }
        for (_, configuration) in found.into_iter().filter(|(sensitivity, _)| *sensitivity > 1.0) {
            candidates.extend(configuration);
        }
    }
}

impl Bound {
    /// Least root of the mean squared position error over the workspace that noise leaves with `count` configurations, m; of a
    /// bound for the mean variance.
    #[must_use]
    pub fn least_rms_m(&self, count: usize) -> f64 {
        (self.design.value / (1.0 + self.gap) / count as f64).sqrt()
    }

    /// Largest value of [`Criterion::DOptimality`] with `count` configurations; of a bound for the determinant.
    #[must_use]
    pub fn largest_d(&self, count: usize) -> f64 {
        self.design.value / self.rank as f64 + libm::log1p(self.gap) + libm::log(count as f64)
    }
}

/// Configurations of large sensitivity, each with it: searched joint by joint from random starts and from the design's members.
fn climb(
    models: &Models,
    rules: &Rules<'_>,
    goal: approximate::Criterion<'_>,
    design: &ApproximateDesign,
    candidates: &[f64],
    stream: &mut Stream,
) -> Result<Vec<(f64, Vec<f64>)>, BoundError> {
    let joints = rules.arm().joint_count();
    let mut heaviest: Vec<usize> = (0..design.weights.len()).collect();
    heaviest.sort_by(|a, b| design.weights[*b].total_cmp(&design.weights[*a]));
    heaviest.truncate(MEMBERS);
    let drawn = Sampler::new(rules).draw(stream, STARTS)?;
    let members = heaviest.iter().map(|member| &candidates[member * joints..(member + 1) * joints]);
    let mut here: Vec<Vec<f64>> = drawn.chunks_exact(joints).chain(members).map(<[f64]>::to_vec).collect();
    let sensitivities =
        |configurations: &[f64]| design.sensitivities(goal, &Blocks::of(&models.information, configurations, joints));
    let mut best = sensitivities(&here.concat());
    for pass in 0..PASSES {
        for (joint, limits) in rules.arm().chain.joints.iter().enumerate() {
            let range = limits.upper - limits.lower;
            let starts: Vec<f64> = here.iter().map(|_| stream.unit()).collect();
            let tried = here.par_iter().zip(starts).enumerate().map_init(
                RulesScratch::default,
                |scratch, (owner, (configuration, start))| {
                    let mut tried = Vec::new();
                    for level in 0..LEVELS {
                        let share = (level as f64 + start) / LEVELS as f64;
                        let mut trial = configuration.clone();
                        // The whole range first, then ever nearer to where it is.
                        trial[joint] = if pass == 0 {
                            limits.lower + range * share
                        } else {
                            let step = range * (share - 0.5) * 0.3 / pass as f64;
                            (configuration[joint] + step).clamp(limits.lower, limits.upper)
                        };
                        if !rules.refuses(&trial, scratch) {
                            tried.push((owner, trial));
                        }
                    }
                    tried
                },
            );
            let tried: Vec<(usize, Vec<f64>)> = tried.collect::<Vec<_>>().concat();
            let (owners, trials): (Vec<usize>, Vec<Vec<f64>>) = tried.into_iter().unzip();
            let trials = trials.concat();
            for ((sensitivity, trial), owner) in sensitivities(&trials).into_iter().zip(trials.chunks_exact(joints)).zip(owners) {
                if sensitivity > best[owner] {
                    best[owner] = sensitivity;
                    here[owner].copy_from_slice(trial);
                }
            }
        }
    }
    Ok(best.into_iter().zip(here).collect())
}
