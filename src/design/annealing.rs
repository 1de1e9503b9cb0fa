//! Simulated annealing (Kirkpatrick, Gelatt and Vecchi 1983, Science 220, 671–680; for calibration D.S. Wang et al. 2014, Int. J.
//! Modelling, Identification and Control 21, 211–222).
//!
//! A move changes one configuration: a few of its joints, by steps that shrink with the temperature, or now and then all of it. A
//! move that makes the set better is taken, one that makes it worse by δ with probability exp(−δ/T). The first temperature is the
//! one that takes four of five of the first worse moves, so that it is in the criterion's own unit; it falls geometrically with
//! what is spent of the budget. The best set is kept, wherever the search goes from it.

use super::moves::{Record, fresh, near, or_worst};
use super::objective::Set;
use super::outcome::StopReason;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Moves from the start from which the first temperature is told, at most.
const TRIAL_MOVES: u64 = 100;
/// Share of the budget that these may take.
const TRIAL_SHARE: f64 = 0.05;
/// Share of the worse moves that the first temperature takes.
const FIRST_ACCEPTANCE: f64 = 0.8;
/// Last temperature as a share of the first.
const LAST_TEMPERATURE: f64 = 3e-4;
/// Step of a joint at the first temperature, as a share of its range (standard deviation).
const FIRST_STEP: f64 = 0.3;
/// The same at the last.
const LAST_STEP: f64 = 0.03;
/// Probability of a joint of the changed configuration to move.
const SHARE: f64 = 0.2;
/// Probability of a new random configuration at the first temperature; it falls to zero with the budget.
const FRESH: f64 = 0.2;

/// Anneals once, over the whole budget.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut scratch = Scratch::default();
    let mut set = Set::new(task.objective, task.draw(stream, task.count)?, &mut scratch.objective);
    task.spend(1);
    let mut value = or_worst(set.value(&mut scratch.objective));
    let mut record = Record::new(task);
    record.offer(set.configurations(), value);
    record.tell(value, watch)?;

    let mut trial = Vec::new();
    let mut losses = Vec::new();
    let trials = TRIAL_MOVES.min((task.budget as f64 * TRIAL_SHARE) as u64);
    for _ in 0..trials {
        let index = stream.index(task.count);
        if !propose(task, set.get(index), 0.0, stream, &mut scratch, &mut trial)? {
            continue;
        }
        let loss = value - or_worst(task.value_with(&set, index, &trial, &mut scratch));
        if loss.is_finite() && loss > 0.0 {
            losses.push(loss);
        }
    }
    let first = first_temperature(&losses);
    let start = task.evaluations();
    let length = task.left().max(1) as f64;
    while task.left() > 0 {
        let progress = (task.evaluations() - start) as f64 / length;
        let temperature = first * libm::pow(LAST_TEMPERATURE, progress);
        let index = stream.index(task.count);
        let moved = propose(task, set.get(index), progress, stream, &mut scratch, &mut trial)?;
        let chance = stream.unit();
        // A set from which no move is within the rules is paid for all the same, or the search would not end.
        if !moved {
            task.spend(1);
            continue;
        }
        let next = or_worst(task.value_with(&set, index, &trial, &mut scratch));
        if next >= value || chance < libm::exp((next - value) / temperature) {
            set.replace(index, &trial, &mut scratch.objective);
            value = next;
            record.offer(set.configurations(), value);
        }
        record.tell(value, watch)?;
    }
    record.end(value, StopReason::BudgetSpent, watch)
}

/// Writes a move of the configuration `joints` to `out`; false if none is within the rules.
fn propose(
    task: &Task<'_>,
    joints: &[f64],
    progress: f64,
    stream: &mut Stream,
    scratch: &mut Scratch,
    out: &mut Vec<f64>,
) -> Result<bool, SearchError> {
    if stream.unit() < FRESH * (1.0 - progress) {
        fresh(task, stream, out)?;
        return Ok(true);
    }
    let step = FIRST_STEP * libm::pow(LAST_STEP / FIRST_STEP, progress);
    Ok(near(task, joints, step, SHARE, stream, scratch, out))
}

/// The temperature at which moves with these `losses` are taken with probability [`FIRST_ACCEPTANCE`] on average; zero (no worse
/// move is ever taken) where there are none.
fn first_temperature(losses: &[f64]) -> f64 {
    let count = losses.len() as f64;
    if losses.is_empty() {
        return 0.0;
    }
    let mut temperature = losses.iter().sum::<f64>() / count / -libm::log(FIRST_ACCEPTANCE);
    // The mean over the losses of exp(−loss/T), brought to the share wanted (Ben-Ameur 2004).
    for _ in 0..20 {
        let taken = losses.iter().map(|loss| libm::exp(-loss / temperature)).sum::<f64>() / count;
        temperature *= (libm::log(taken) / libm::log(FIRST_ACCEPTANCE)).clamp(0.1, 10.0);
    }
    temperature
}
