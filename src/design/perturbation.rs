//! Perturbation of configurations with a few DETMAX steps (after H. Wang et al. 2017, IEEE Transactions on Robotics 33, 1156–1169).
//!
//! Each configuration in turn is moved at random; a move that makes the set better is kept. The step grows while many do and shrinks
//! while few do (the one-fifth rule of Rechenberg 1973). When sweeps over all configurations gain nothing more, the set is in a
//! local optimum: a few of the best of some new candidates are added and as many of the worst members taken out, as DETMAX
//! (Mitchell 1974) would, and the set that is left is perturbed again. What comes out worse is given up for the best set.

use super::moves::{Record, near, or_worst, spread, knob};
use super::objective::Set;
use super::outcome::StopReason;
use super::pool::PoolSet;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Random sets whose values tell what is little; the best is the start.
const STARTS: u64 = 10;
/// Share of the budget that these may take.
const STARTS_SHARE: f64 = 0.05;
/// A sweep that gains less than this share of the standard deviation among random sets has gained nothing.
const NOTHING: f64 = 0.01;
/// Sweeps in a row that gain nothing before the local optimum is left.
const PATIENCE: usize = 3;
/// First step of a joint, as a share of its range (standard deviation).
const FIRST_STEP: f64 = 0.2;
/// Step after an excursion.
const NEXT_STEP: f64 = 0.1;
/// Smallest step.
const LAST_STEP: f64 = 0.005;
/// By what the step grows or shrinks after a sweep.
const ADAPTATION: f64 = 1.3;
/// Share of kept moves above which the step grows.
const SUCCESS: f64 = 0.2;
/// Probability of a joint of the moved configuration to move.
const SHARE: f64 = 0.3;
/// Candidates of an excursion, at most.
const CANDIDATES: usize = 60;
/// Members that are exchanged at most, as a share of the set.
const EXCHANGED: f64 = 0.1;

/// Searches until the budget is spent.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut scratch = Scratch::default();
    let mut record = Record::new(task);
    let starts = STARTS.min((task.budget as f64 * STARTS_SHARE) as u64).max(1);
    let sets = (0..starts).map(|_| task.draw(stream, task.count)).collect::<Result<Vec<_>, _>>()?;
    let values: Vec<f64> = task.values(&sets).into_iter().map(or_worst).collect();
    sets.iter().zip(&values).for_each(|(set, value)| record.offer(set, *value));
    let nothing = knob("PE_N", NOTHING) * spread(&values);
    let mut set = Set::new(task.objective, record.configurations().to_vec(), &mut scratch.objective);
    let mut value = record.value();
    record.tell(value, watch)?;
    let mut step = knob("PE_S0", FIRST_STEP);
    while task.left() > 0 {
        perturb(task, &mut set, &mut value, step, nothing, stream, &mut scratch, &mut record, watch)?;
        if task.left() == 0 {
            break;
        }
        if value < record.value() {
            set = Set::new(task.objective, record.configurations().to_vec(), &mut scratch.objective);
        }
        let left = excursion(task, set.configurations(), stream)?;
        set = Set::new(task.objective, left, &mut scratch.objective);
        task.spend(1);
        value = or_worst(set.value(&mut scratch.objective));
        record.offer(set.configurations(), value);
        record.tell(value, watch)?;
        step = knob("PE_S1", NEXT_STEP);
    }
    record.end(value, StopReason::BudgetSpent, watch)
}

/// Sweeps over the configurations until that brings nothing.
#[expect(clippy::too_many_arguments, reason = "the state of one search")]
fn perturb(
    task: &Task<'_>,
    set: &mut Set<'_>,
    value: &mut f64,
    mut step: f64,
    nothing: f64,
    stream: &mut Stream,
    scratch: &mut Scratch,
    record: &mut Record<'_, '_>,
    watch: &mut Watch<'_>,
) -> Result<(), SearchError> {
    let mut trial = Vec::new();
    let mut idle = 0;
    let sh = knob("PE_SH", SHARE);
    while idle < knob("PE_P", PATIENCE as f64) as usize && task.left() > 0 {
        let before = *value;
        let mut kept = 0;
        for index in 0..task.count {
            if task.left() == 0 {
                break;
            }
            if !near(task, set.get(index), step, sh, stream, scratch, &mut trial) {
                // A configuration that cannot move is paid for, or the search might not end.
                task.spend(1);
                continue;
            }
            let next = or_worst(task.value_with(set, index, &trial, scratch));
            if next > *value {
                *value = next;
                set.replace(index, &trial, &mut scratch.objective);
                kept += 1;
            }
            if task.evaluations() % 16 == 0 {
                record.offer(set.configurations(), *value);
                record.tell(*value, watch)?;
            }
        }
        record.offer(set.configurations(), *value);
        record.tell(*value, watch)?;
        let few = (kept as f64) < SUCCESS * task.count as f64;
        step = if few { step / ADAPTATION } else { (step * ADAPTATION).min(FIRST_STEP) };
        if step < LAST_STEP {
            break;
        }
        // Between sets without a finite value there is nothing to gain.
        idle = if *value - before > nothing { 0 } else { idle + 1 };
    }
    Ok(())
}

/// A few DETMAX steps over the set's configurations and some new ones: the best are added, then the worst taken out.
fn excursion(task: &Task<'_>, configurations: &[f64], stream: &mut Stream) -> Result<Vec<f64>, SearchError> {
    let joints = task.arm().joint_count();
    let candidates = task.pool.min(knob("PE_C", CANDIDATES as f64) as usize).max(1);
    let mut pool = configurations.to_vec();
    pool.extend(task.draw(stream, candidates)?);
    let mut set = PoolSet::new(task, &pool, (0..task.count).collect());
    let exchanged = ((knob("PE_X", EXCHANGED) * task.count as f64) as usize).max(1);
    for _ in 0..exchanged {
        if task.left() == 0 {
            break;
        }
        set.add_best();
    }
    while set.members().len() > task.count {
        set.remove_worst();
    }
    Ok(set.members().iter().flat_map(|member| &pool[member * joints..(member + 1) * joints]).copied().collect())
}
