//! What choosing is worth for this arm and situation, told before anything is measured.

use super::bound::{BoundError, bound};
use super::candidates::Rules;
use super::objective::Models;
use super::outcome::Advice;
use super::problem::{Criterion, DesignProblem};
use crate::quality::prediction::Prediction;

/// Least number of candidates of the bound.
const LEAST_POOL: usize = 500;

/// Predicts what noise will leave after a calibration with `chosen`, with each of the sets `random`, and with the best set that
/// there can be.
///
/// # Errors
/// If there is no bound.
pub fn advise(
    problem: &DesignProblem,
    models: &Models,
    rules: &Rules<'_>,
    chosen: &[f64],
    random: &[Vec<f64>],
) -> Result<Advice, BoundError> {
    let joints = models.joint_count();
    // A small pool is the search's affair.
    let bound = bound(models, rules, Criterion::IOptimality, problem.pool.max(LEAST_POOL))?;
    let predicted: Vec<Prediction> = random.iter().filter_map(|set| models.predict(set, joints)).collect();
    let mean = |of: fn(&Prediction) -> f64| predicted.iter().map(of).sum::<f64>() / predicted.len() as f64;
    let errors = || predicted.iter().map(|prediction| prediction.position_rms_m);
    Ok(Advice {
        chosen: models.predict(chosen, joints),
        random: (!predicted.is_empty()).then(|| Prediction {
            position_rms_m: mean(|prediction| prediction.position_rms_m),
            orientation_rms_rad: mean(|prediction| prediction.orientation_rms_rad),
            position_worst_m: mean(|prediction| prediction.position_worst_m),
        }),
        random_range_m: [errors().reduce(f64::min).unwrap_or(0.0), errors().reduce(f64::max).unwrap_or(0.0)],
        random_undetermined: random.len() - predicted.len(),
        bound_m: bound.least_rms_m(problem.count),
        bound_gap: bound.gap,
        bound_candidates: bound.candidates,
    })
}
