//! Coordinate exchange: one joint of one configuration at a time goes to where the criterion is largest (Meyer and Nachtsheim 1995,
//! Technometrics 37, 60–69).
//!
//! Each visit tries the joint at points spread evenly over its range, from a random start, and at two points near where it is. A
//! pass visits all joints of all configurations; passes are made until one brings nothing. While budget is left, the search starts
//! again from another random set, and the best local optimum is kept.

use rayon::prelude::*;

use super::objective::Set;
use super::outcome::StopReason;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Points over the range of a joint that a visit tries.
const SPREAD: usize = 6;
/// Largest step to the two points nearby, as a share of the range. It shrinks with the passes.
const NEARBY: f64 = 0.08;
/// A pass that improves the value by less than this share (or, of a logarithm, this much) has brought nothing.
const NOTHING: f64 = 1e-4;

/// Searches until the budget is spent.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut scratch = Scratch::default();
    let mut best = Found { configurations: Vec::new(), value: f64::NEG_INFINITY, stop: StopReason::BudgetSpent };
    let mut step = 0;
    while task.left() > 0 || best.configurations.is_empty() {
        let mut set = Set::new(task.objective, task.draw(stream, task.count)?, &mut scratch.objective);
        task.spend(1);
        let mut value = set.value(&mut scratch.objective);
        let mut pass = 0;
        loop {
            let before = value;
            for index in 0..task.count {
                if task.left() == 0 {
                    break;
                }
                improve(task, &mut set, index, &mut value, NEARBY / (1 + pass) as f64, stream, &mut scratch);
            }
            pass += 1;
            let improved = value > best.value || best.configurations.is_empty();
            if improved {
                best.value = value;
                best.configurations = set.configurations().to_vec();
            }
            watch.report(task.step(step, value, best.value, improved.then_some(&best.configurations)))?;
            step += 1;
            if task.left() == 0 || value - before <= NOTHING * before.abs().min(1.0) {
                break;
            }
        }
    }
    Ok(best)
}

/// Visits every joint of configuration `index` once.
pub(super) fn improve(
    task: &Task<'_>,
    set: &mut Set<'_>,
    index: usize,
    value: &mut f64,
    nearby: f64,
    stream: &mut Stream,
    scratch: &mut Scratch,
) {
    for (joint, limits) in task.arm().chain.joints.iter().enumerate() {
        let here = set.get(index).to_vec();
        let range = limits.upper - limits.lower;
        if range <= 0.0 {
            continue;
        }
        let start = stream.unit();
        let step = nearby * range * stream.unit();
        let spread = (0..SPREAD).map(|point| limits.lower + range * ((point as f64 + start) / SPREAD as f64));
        let near = [here[joint] - step, here[joint] + step].map(|near| near.clamp(limits.lower, limits.upper));
        let trials: Vec<Vec<f64>> = spread
            .chain(near)
            .map(|coordinate| {
                let mut trial = here.clone();
                trial[joint] = coordinate;
                trial
            })
            .filter(|trial| !task.refuses(trial, scratch))
            .take(usize::try_from(task.left()).unwrap_or(usize::MAX))
            .collect();
        let values: Vec<f64> = trials
            .par_iter()
            .with_min_len(2)
            .map_init(Scratch::default, |scratch, trial| task.value_with(set, index, trial, scratch))
            .collect();
        let first = (0..values.len()).fold(None, |first: Option<usize>, trial| match first {
            Some(other) if values[other] >= values[trial] => first,
            _ => Some(trial),
        });
        if let Some(first) = first.filter(|first| values[*first] > *value) {
            *value = values[first];
            set.replace(index, &trials[first], &mut scratch.objective);
        }
        if task.left() == 0 {
            return;
        }
    }
}
