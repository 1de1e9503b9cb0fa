//! What no choice of configurations can do better than: the optimal approximate design over everything that the arm can take.
//!
//! The bound is exact for choices among the candidates that it was computed from. For all other configurations within the rules it
//! is as good as a search: candidates of large sensitivity are searched for from many starts (joint by joint) and added, a few times
//! over; the best that the last search found goes into the gap, and the bound allows for the gap.

use rayon::prelude::*;

use super::approximate::{self, ApproximateDesign, ApproximateError, Settings};
use super::candidates::{NothingMeasurable, Rules, RulesScratch, Sampler};
use super::objective::Models;
use super::problem::Criterion;
use crate::quality::information::Blocks;
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
    NothingMeasurable(#[from] NothingMeasurable),
    /// The fit assumes another noise than the sensor declares.
    #[error(
        "the fit weighs metres and radians alike, but the sensor declares different noise for them: no bound is known for such a fit; \
             set [identification] weights = \"noise\""
    )]
    OtherNoise,
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
    if !models.information.as_declared() {
        return Err(BoundError::OtherNoise);
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::advice::advise;
    use crate::lab::trial::Trial;
    use crate::measurement::Sensor;
    use crate::measurement::Weights;
    use crate::scene::Scene;
    use crate::simulation::injected::{Injected, Noise};
    use crate::statistics::Mean;

    fn cell(weights: Weights, orientation_sigma_rad: f64) -> (Scene, Injected) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml");
        let file = crate::scene::read(&path).unwrap();
        let mut scene = file.scene;
        scene.sensor =
            Sensor { position_sigma_m: 20e-6, orientation_sigma_rad: Some(orientation_sigma_rad), ..scene.sensor.clone() };
        scene.weights = weights;
        let injected = Injected {
            length_error_m: 1e-3,
            angle_error_rad: 2e-3,
            noise: Noise::Declared { factor: 1.0 },
            ..file.injected.unwrap()
        };
        (scene, injected)
    }

    /// Where noise is all there is, what is predicted is what comes out, whatever the fit assumes of the noise.
    #[test]
    fn the_predicted_error_is_that_of_simulated_calibrations() {
        for (weights, orientation_sigma_rad) in [(Weights::Noise, 50e-6), (Weights::Unit, 20e-6), (Weights::Unit, 1e-3)] {
            let (scene, injected) = cell(weights, orientation_sigma_rad);
            let models = Models::new(&scene.request()).unwrap();
            let rules = Rules::measurable(&scene.arm, &scene.sensor);
            let set = Sampler::new(&rules).draw(&mut stream(1, "test/prediction"), 20).unwrap();
            let predicted = models.predict(&set, scene.arm.joint_count()).unwrap();
            let mut ratios = [Vec::new(), Vec::new()];
            for number in 0..60 {
                let after = Trial::new(&scene, &injected, number).unwrap().calibrate(&set).unwrap().after;
                ratios[0].push((after.position_m.rms / predicted.position_rms_m).powi(2));
                ratios[1].push((after.rotation_rad.unwrap().rms / predicted.orientation_rms_rad).powi(2));
            }
            for ratios in ratios {
                let Mean { mean, interval95, .. } = Mean::of(&ratios).unwrap();
                println!("{weights:?}, {orientation_sigma_rad}: {mean} in {interval95:?}");
                // Twice the 95 % interval: four standard errors.
                let half = mean - interval95.unwrap()[0];
                assert!((mean - 1.0).abs() < 2.0 * half && half < 0.2, "{weights:?}: {mean} ± {half}");
            }
            let advice = advise(&scene.design, &models, &rules, &set, std::slice::from_ref(&set));
            // Noise that the fit does not assume has no bound.
            assert_eq!(advice.is_ok(), weights == Weights::Noise || orientation_sigma_rad == 20e-6);
        }
    }

    #[test]
    fn no_random_set_beats_the_bound() {
        let (scene, _) = cell(Weights::Noise, 50e-6);
        let models = Models::new(&scene.request()).unwrap();
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let limit = bound(&models, &rules, Criterion::IOptimality, 300).unwrap();
        assert!(limit.gap < 0.05, "{}", limit.gap);
        for number in 0..30 {
            let set = Sampler::new(&rules).draw(&mut stream(number, "test/bound"), 12).unwrap();
            let error = models.predict(&set, scene.arm.joint_count()).unwrap().position_rms_m;
            assert!(error > limit.least_rms_m(12));
        }
    }
}
