//! Perturbation of configurations with a few DETMAX steps (after H. Wang et al. 2017, IEEE Transactions on Robotics 33, 1156–1169).
//!
//! Each configuration in turn is moved at random; a move that makes the set better is kept. The step grows while many do and shrinks
//! while few do (the one-fifth rule of Rechenberg 1973). When sweeps over all configurations gain nothing more, the set is in a
//! local optimum: a few of the best of some new candidates are added and as many of the worst members taken out, as DETMAX
//! (Mitchell 1974) would, and the set that is left is perturbed again. What comes out worse is given up for the best set.

use super::moves::{Record, near, or_worst, spread};
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
const NOTHING: f64 = 0.003;
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
const SHARE: f64 = 0.2;
/// Candidates of an excursion, at most.
const CANDIDATES: usize = 60;
/// Members that are exchanged at most, as a share of the set.
const EXCHANGED: f64 = 0.1;

/// A set on its way.
struct Walk<'t, 'a> {
    task: &'t Task<'a>,
    set: Set<'t>,
    value: f64,
    record: Record<'t, 'a>,
    scratch: Scratch,
}

/// Searches until the budget is spent.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut record = Record::new(task);
    let starts = STARTS.min((task.budget as f64 * STARTS_SHARE) as u64).max(1);
    let sets = (0..starts).map(|_| task.draw(stream, task.count)).collect::<Result<Vec<_>, _>>()?;
    let values: Vec<f64> = task.values(&sets).into_iter().map(or_worst).collect();
    sets.iter().zip(&values).for_each(|(set, value)| record.offer(set, *value));
    let nothing = NOTHING * spread(&values);
    let mut scratch = Scratch::default();
    let set = Set::new(task.objective, record.configurations().to_vec(), &mut scratch.objective);
    let mut walk = Walk { task, set, value: record.value(), record, scratch };
    walk.record.tell(walk.value, watch)?;
    let mut step = FIRST_STEP;
    while task.left() > 0 {
        walk.perturb(step, nothing, stream, watch)?;
        if walk.value < walk.record.value() {
            walk.set = Set::new(task.objective, walk.record.configurations().to_vec(), &mut walk.scratch.objective);
        }
        let Some(left) = excursion(task, walk.set.configurations(), stream)? else { break };
        walk.set = Set::new(task.objective, left, &mut walk.scratch.objective);
        task.spend(1);
        walk.value = or_worst(walk.set.value(&mut walk.scratch.objective));
        walk.record.offer(walk.set.configurations(), walk.value);
        walk.record.tell(walk.value, watch)?;
        step = NEXT_STEP;
    }
    walk.record.end(walk.value, StopReason::BudgetSpent, watch)
}

impl Walk<'_, '_> {
    /// Sweeps over the configurations until that brings nothing.
    fn perturb(&mut self, mut step: f64, nothing: f64, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<(), SearchError> {
        let task = self.task;
        let mut trial = Vec::new();
        let mut idle = 0;
        while idle < PATIENCE && step >= LAST_STEP && task.left() > 0 {
            let before = self.value;
            let mut kept = 0;
            for index in 0..task.count {
                if task.left() == 0 {
                    break;
                }
                if !near(task, self.set.get(index), step, SHARE, stream, &mut self.scratch, &mut trial) {
                    // A configuration that cannot move is paid for, or the search might not end.
                    task.spend(1);
                    continue;
                }
                let value = or_worst(task.value_with(&self.set, index, &trial, &mut self.scratch));
                if value > self.value {
                    self.value = value;
                    self.set.replace(index, &trial, &mut self.scratch.objective);
                    self.record.offer(self.set.configurations(), value);
                    kept += 1;
                }
                self.record.tell(self.value, watch)?;
            }
            let few = f64::from(kept) < SUCCESS * task.count as f64;
            step = if few { step / ADAPTATION } else { (step * ADAPTATION).min(FIRST_STEP) };
            // Between sets without a finite value there is nothing to gain.
            idle = if self.value - before > nothing { 0 } else { idle + 1 };
        }
        Ok(())
    }
}

/// A few DETMAX steps over the set's configurations and some new ones: the best are added, then the worst taken out.
/// None if the budget does not last for it.
fn excursion(task: &Task<'_>, configurations: &[f64], stream: &mut Stream) -> Result<Option<Vec<f64>>, SearchError> {
    let joints = task.arm().joint_count();
    let candidates = task.pool.clamp(1, CANDIDATES);
    let mut pool = configurations.to_vec();
    pool.extend(task.draw(stream, candidates)?);
    let mut set = PoolSet::new(task, &pool, (0..task.count).collect());
    let exchanged = ((EXCHANGED * task.count as f64) as usize).max(1);
    for _ in 0..exchanged {
        if task.left() == 0 {
            return Ok(None);
        }
        set.add_best();
    }
    while set.members().len() > task.count {
        if task.left() == 0 {
            return Ok(None);
        }
        set.remove_worst();
    }
    Ok(Some(set.members().iter().flat_map(|member| &pool[member * joints..(member + 1) * joints]).copied().collect()))
}
