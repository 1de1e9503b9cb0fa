//! The best of as many random sets as the budget allows: what every other method has to beat.

use super::outcome::StopReason;
use super::search::{Found, SearchError, Task, Watch};
use crate::seed::Stream;

/// Sets that are valued side by side.
const BATCH: u64 = 64;

/// Draws sets until the budget is spent and keeps the best.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut best = Found { configurations: Vec::new(), value: f64::NEG_INFINITY, stop: StopReason::BudgetSpent };
    let mut step = 0;
    while task.left() > 0 || step == 0 {
        let count = task.left().clamp(1, BATCH);
        let mut sets = (0..count).map(|_| task.draw(stream, task.count)).collect::<Result<Vec<_>, _>>()?;
        let values = task.values(&sets);
        let first = (1..values.len()).fold(0, |first, set| if values[set] > values[first] { set } else { first });
        let improved = values[first] > best.value || best.configurations.is_empty();
        if improved {
            best.value = values[first];
            best.configurations = sets.swap_remove(first);
        }
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        watch.report(task.step(step, mean, best.value, improved.then_some(&best.configurations)))?;
        step += 1;
    }
    Ok(best)
}
