//! Few configurations, each measured several times: genetic algorithm, then gradient search (after Wu et al. 2015, Robotics and
//! Computer-Integrated Manufacturing 35, 151–168).
//!
//! The set of m consists of n different configurations, repeated as evenly as possible, where n is little more than what it takes
//! to determine the parameters. That makes the search small: n rather than m configurations are looked for, by the genetic
//! algorithm of [`super::genetic`], and the best of them is polished along the numerical gradient over its joints, projected on the
//! limits, along conjugate directions and with the step told by trying several lengths side by side. While budget is left, both begin again from other random sets.
//!
//! Repetition is what Wu et al. claim to be cheap, and what Chen et al. 2019 criticise as prone to singular Jacobians; and a
//! criterion that looks at end points gains nothing from measuring at one twice. Where n is m, this is a genetic algorithm with
//! gradient search.

use super::genetic::{Population, repeated, values};
use super::moves::Record;
use super::outcome::StopReason;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Configurations more than the parameters need.
const MARGIN: usize = 3;
/// Share of what is left that the genetic algorithm spends before the gradient search.
const BREEDING: f64 = 0.3;
/// Step of the numerical derivative, as a share of a joint's range.
const DIFFERENCE: f64 = 1e-4;
/// First length of a step along the gradient: that of the joint that moves most, as a share of its range.
const FIRST_LENGTH: f64 = 0.02;
/// Lengths tried side by side, as multiples of the last.
const LENGTHS: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.2, 0.05];
/// Length below which nothing more is to be gained.
const LAST_LENGTH: f64 = 1e-5;
/// A step that gains less than this share of what the gradient search has gained so far ends it.
const NOTHING: f64 = 1e-3;

/// Breeds and climbs until the budget is spent.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut record = Record::new(task);
    let count = distinct(task);
    let mut here = f64::NEG_INFINITY;
    while task.left() > 0 || record.configurations().is_empty() {
        let start = task.evaluations();
        let length = (task.left() as f64 * BREEDING).max(1.0);
        let progress = || (task.evaluations() - start) as f64 / length;
        let mut population = Population::draw(task, count, stream)?;
        population.offer(&mut record);
        record.tell(population.mean(), watch)?;
        while task.left() > 0 && progress() < 1.0 {
            population.breed(task, progress(), stream)?;
            population.offer(&mut record);
            record.tell(population.mean(), watch)?;
        }
        let (set, value) = population.best();
        here = climb(task, set.to_vec(), value, &mut record, watch)?;
    }
    record.end(here, StopReason::BudgetSpent, watch)
}

/// Different configurations of the set: what the parameters need and a little more.
fn distinct(task: &Task<'_>) -> usize {
    let model = &task.objective.models().information;
    let needed = model.rank().div_ceil(model.rows_per_pose());
    task.count.min(needed + MARGIN)
}

/// Follows the gradient from `set` until that brings nothing; the value it gets to.
fn climb(
    task: &Task<'_>,
    mut set: Vec<f64>,
    mut value: f64,
    record: &mut Record<'_, '_>,
    watch: &mut Watch<'_>,
) -> Result<f64, SearchError> {
    let mut scratch = Scratch::default();
    let mut length = FIRST_LENGTH;
    let begun = value;
    let (mut gradient_before, mut direction): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    while task.left() > 0 && value.is_finite() {
        let gradient = gradient(task, &set, value, &mut scratch);
        // Conjugate directions (Polak and Ribière), from the gradient itself where they would lead down.
        let square = dot(&gradient_before, &gradient_before);
        let share =
            if square > 0.0 { ((dot(&gradient, &gradient) - dot(&gradient, &gradient_before)) / square).max(0.0) } else { 0.0 };
        direction = if direction.is_empty() {
            gradient.clone()
        } else {
            gradient.iter().zip(&direction).map(|(gradient, before)| gradient + share * before).collect()
        };
        if dot(&direction, &gradient) <= 0.0 {
            direction.clone_from(&gradient);
        }
        gradient_before = gradient;
        let largest = direction.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
        if largest.is_nan() || largest <= 0.0 {
            break;
        }
        let before = value;
        while value <= before && length >= LAST_LENGTH && task.left() > 0 {
            let lengths: Vec<f64> = LENGTHS.iter().map(|share| share * length).collect();
            let trials: Vec<Vec<f64>> =
                lengths.iter().map(|length| moved(task, &set, &direction, length / largest, &mut scratch)).collect();
            let found = values(task, &trials);
            let best = (1..found.len()).fold(0, |best, trial| if found[trial] > found[best] { trial } else { best });
            if found[best] > value {
                value = found[best];
                set.clone_from(&trials[best]);
                length = lengths[best];
            } else {
                length = lengths[LENGTHS.len() - 1];
            }
        }
        record.offer(&repeated(&set, task), value);
        record.tell(value, watch)?;
        if value - before <= NOTHING * (value - begun) {
            break;
        }
    }
    Ok(value)
}

/// Derivatives of the value with respect to the joints, as shares of their ranges. Differences are taken to the side that the
/// limits and the rules allow; where neither does, the derivative counts as zero.
fn gradient(task: &Task<'_>, set: &[f64], value: f64, scratch: &mut Scratch) -> Vec<f64> {
    let limits = &task.arm().chain.joints;
    let mut places = Vec::with_capacity(set.len());
    let mut trials = Vec::with_capacity(set.len());
    for at in 0..set.len() {
        let (start, limit) = (at - at % limits.len(), &limits[at % limits.len()]);
        let step = DIFFERENCE * (limit.upper - limit.lower);
        for step in [step, -step] {
            let mut trial = set.to_vec();
            trial[at] = set[at] + step;
            let within = (limit.lower..=limit.upper).contains(&trial[at]);
            if within && step != 0.0 && !task.refuses(&trial[start..start + limits.len()], scratch) {
                places.push((at, if step > 0.0 { DIFFERENCE } else { -DIFFERENCE }));
                trials.push(trial);
                break;
            }
        }
    }
    let mut gradient = vec![0.0; set.len()];
    for ((at, step), trial) in places.into_iter().zip(values(task, &trials)) {
        gradient[at] = if trial.is_finite() { (trial - value) / step } else { 0.0 };
    }
    gradient
}

/// `set` a step along `direction`, cut at the limits; a configuration that would be against the rules stays.
fn moved(task: &Task<'_>, set: &[f64], direction: &[f64], factor: f64, scratch: &mut Scratch) -> Vec<f64> {
    let limits = &task.arm().chain.joints;
    let mut out = set.to_vec();
    for (start, configuration) in (0..set.len()).step_by(limits.len()).zip(out.chunks_exact_mut(limits.len())) {
        for (offset, (value, limit)) in configuration.iter_mut().zip(limits).enumerate() {
            let step = factor * direction[start + offset] * (limit.upper - limit.lower);
            *value = (*value + step).clamp(limit.lower, limit.upper);
        }
        if task.refuses(configuration, scratch) {
            configuration.copy_from_slice(&set[start..start + limits.len()]);
        }
    }
    out
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
