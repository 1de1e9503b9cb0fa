//! DETMAX: exchange with excursions over a pool of candidates (Mitchell 1974, Technometrics 16, 203–210).
//!
//! From a set of m members, an excursion adds the best candidates and takes the worst members until it is back at m, over sets of
//! up to m + 6 or down to m − 6: a set larger than m loses a member unless it stood in an excursion that failed since the last
//! improvement, in which case it gains another, and the other way round. An excursion that comes back better is the new start. The
//! search ends when two excursions have left the allowed sizes, or eight in a row brought nothing, and starts again from other random members while
//! budget is left; where it has not been told otherwise the criterion is the determinant, but any criterion will do.

use std::collections::BTreeSet;

use super::outcome::StopReason;
use super::pool::PoolSet;
use super::search::{Found, SearchError, Task, Watch};
use crate::seed::Stream;

/// How many members more or less than m an excursion may have.
const EXCURSION: usize = 6;
/// A gain smaller than this is nothing, or rounding where the information is nearly singular.
const NOTHING: f64 = 1e-6;
/// Excursions in a row that bring nothing, after which a search ends wherever they went: deeper ones cost more than a new start.
const FRUITLESS: usize = 8;

/// Searches from random members of a random pool, again and again while the budget lasts.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let joints = task.arm().joint_count();
    let pool = task.draw(stream, task.pool.max(task.count))?;
    let count = pool.len() / joints;
    let mut best = Found { configurations: Vec::new(), value: f64::NEG_INFINITY, stop: StopReason::BudgetSpent };
    let mut step = 0;
    while task.left() > 0 || best.configurations.is_empty() {
        let mut order: Vec<usize> = (0..count).collect();
        stream.shuffle(&mut order);
        order.truncate(task.count);
        let mut tell = |members: &[usize], value: f64, end: bool| -> Result<(), SearchError> {
            let improved = value > best.value || best.configurations.is_empty();
            if improved {
                best.value = value;
                best.configurations =
                    members.iter().flat_map(|member| &pool[member * joints..(member + 1) * joints]).copied().collect();
            }
            if improved || end {
                watch.report(task.step(step, value, best.value, improved.then_some(&best.configurations)))?;
                step += 1;
            }
            Ok(())
        };
        climb(task, &pool, order, &mut tell)?;
    }
    Ok(best)
}

/// SearchReport members, value, and whether it is the last set.
pub(super) type Tell<'t> = dyn FnMut(&[usize], f64, bool) -> Result<(), SearchError> + 't;

/// One search from `members` of `pool` (configurations one after the other, rad or m): the members of a set that no excursion makes
/// better, and its value. It goes on as long as the task's budget.
#[must_use]
pub fn detmax(task: &Task<'_>, pool: &[f64], members: Vec<usize>) -> (Vec<usize>, f64) {
    let nothing = (Vec::new(), f64::NEG_INFINITY);
    // It fails only where somebody watches.
    climb(task, pool, members, &mut |_, _, _| Ok(())).unwrap_or(nothing)
}

/// One search: from `members` to a set that no excursion makes better. `tell` gets members and value of every better set, and the
/// last.
pub(super) fn climb(
    task: &Task<'_>,
    pool: &[f64],
    members: Vec<usize>,
    tell: &mut Tell<'_>,
) -> Result<(Vec<usize>, f64), SearchError> {
    let count = members.len();
    let candidates = (pool.len() / task.arm().joint_count()) as u64;
    let mut home = PoolSet::new(task, pool, members);
    let mut set = home.clone();
    tell(home.members(), home.value(), false)?;
    let mut failed: BTreeSet<Vec<usize>> = BTreeSet::new();
    let mut up = true;
    // Excursions that have left the sizes since the last improvement.
    let mut gave_up = 0;
    let mut fruitless = 0;
    while gave_up < 2 && task.left() > 0 && fruitless < FRUITLESS {
        let mut visited = Vec::new();
        let mut first = true;
        let returned = loop {
            let size = set.members().len();
            let add = if first {
                up
            } else {
                let mut key = set.members().to_vec();
                key.sort_unstable();
                // A set that comes again within an excursion would come for ever.
                let known = failed.contains(&key) || visited.contains(&key);
                visited.push(key);
                (size < count) != known
            };
            first = false;
            if (add && size >= count + EXCURSION)
                || (!add && (size + EXCURSION <= count || size <= 1))
                || task.left() < if add { candidates } else { size as u64 }
            {
                break false;
            }
            if add {
                set.add_best();
            } else {
                set.remove_worst();
            }
            if set.members().len() == count {
                break true;
            }
        };
        if returned && set.value() > home.value() + NOTHING {
            home.clone_from(&set);
            failed.clear();
            gave_up = 0;
            fruitless = 0;
            tell(home.members(), home.value(), false)?;
        } else {
            failed.extend(visited);
            gave_up += usize::from(!returned);
            fruitless += 1;
            set.clone_from(&home);
            up = !up;
        }
    }
    tell(home.members(), home.value(), true)?;
    Ok((home.members().to_vec(), home.value()))
}
