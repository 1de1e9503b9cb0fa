//! What the methods that move configurations share: small and large moves that keep to the limits and the rules, and the record of
//! the best set.

use super::candidates::NothingMeasurable;
use super::outcome::StopReason;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Steps that a search tells, roughly.
const STEPS: u64 = 200;
/// Moves that are tried before one within the rules is given up.
const TRIES: usize = 8;

/// The best set of a search, and what of it has been told.
pub(super) struct Record<'t, 'a> {
    task: &'t Task<'a>,
    configurations: Vec<f64>,
    value: f64,
    step: usize,
    told: bool,
    next: u64,
}

impl<'t, 'a> Record<'t, 'a> {
    /// Of a search that has valued nothing yet.
    pub(super) fn new(task: &'t Task<'a>) -> Self {
        Record { task, configurations: Vec::new(), value: f64::NEG_INFINITY, step: 0, told: true, next: 0 }
    }

    /// The best value so far.
    pub(super) fn value(&self) -> f64 {
        self.value
    }

    /// The best set so far.
    pub(super) fn configurations(&self) -> &[f64] {
        &self.configurations
    }

    /// Keeps a set that is better than any before.
    pub(super) fn offer(&mut self, configurations: &[f64], value: f64) {
        if value > self.value || self.configurations.is_empty() {
            self.value = value;
            self.configurations.clear();
            self.configurations.extend_from_slice(configurations);
            self.told = false;
        }
    }

    /// Tells where the search is, if enough was spent since it last told; the first time at once.
    pub(super) fn tell(&mut self, here: f64, watch: &mut Watch<'_>) -> Result<(), SearchError> {
        if self.task.evaluations() < self.next {
            return Ok(());
        }
        self.next = self.task.evaluations() + (self.task.budget / STEPS).max(1);
        self.tell_now(here, watch)
    }

    fn tell_now(&mut self, here: f64, watch: &mut Watch<'_>) -> Result<(), SearchError> {
        let improved = (!self.told).then_some(self.configurations.as_slice());
        watch.report(self.task.step(self.step, here, self.value, improved))?;
        self.step += 1;
        self.told = true;
        Ok(())
    }

    /// Tells the end, and what was found.
    pub(super) fn end(mut self, here: f64, stop: StopReason, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
        self.tell_now(here, watch)?;
        Ok(Found { configurations: self.configurations, value: self.value, stop })
    }
}

/// Writes to `out` a configuration near `joints`: each joint moves with probability `share`, and at least one does, by a normal
/// step of standard deviation `step` of its range, reflected at its limits. False if none of a few tries is within the rules;
/// `out` is then rubble.
pub(super) fn near(
    task: &Task<'_>,
    joints: &[f64],
    step: f64,
    share: f64,
    stream: &mut Stream,
    scratch: &mut Scratch,
    out: &mut Vec<f64>,
) -> bool {
    let limits = &task.arm().chain.joints;
    for _ in 0..TRIES {
        out.clear();
        out.extend_from_slice(joints);
        let sure = stream.index(limits.len());
        for (joint, (value, limit)) in out.iter_mut().zip(limits).enumerate() {
            if joint == sure || stream.unit() < share {
                *value = reflect(*value + step * (limit.upper - limit.lower) * stream.normal(), limit.lower, limit.upper);
            }
        }
        if !task.refuses(out, scratch) {
            return true;
        }
    }
    false
}

/// Writes to `out` a random configuration within the rules.
///
/// # Errors
/// If none is.
pub(super) fn fresh(task: &Task<'_>, stream: &mut Stream, out: &mut Vec<f64>) -> Result<(), NothingMeasurable> {
    *out = task.draw(stream, 1)?;
    Ok(())
}

/// `value` mirrored at the limits until it is within them.
pub(super) fn reflect(value: f64, lower: f64, upper: f64) -> f64 {
    let range = upper - lower;
    if !value.is_finite() || range <= 0.0 {
        return lower;
    }
    let folded = (value - lower).rem_euclid(2.0 * range);
    let inside = if folded > range { 2.0 * range - folded } else { folded };
    (lower + inside).clamp(lower, upper)
}

/// Standard deviation of the finite ones of `values`; zero where fewer than two are.
pub(super) fn spread(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let count = finite.len() as f64;
    let mean = finite.iter().sum::<f64>() / count.max(1.0);
    let square: f64 = finite.iter().map(|value| (value - mean) * (value - mean)).sum();
    (square / (count - 1.0).max(1.0)).sqrt()
}

/// `value`, and minus infinity for what is not a number, so that sets can be put in order.
pub(super) fn or_worst(value: f64) -> f64 {
    value.max(f64::NEG_INFINITY)
}
