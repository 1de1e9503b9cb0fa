//! Genetic algorithm on sets of configurations (for calibration Aoyagi et al. 2010, Proc. IEEE/RSJ IROS, 5660–5665; Goldberg 1989).
//!
//! An individual is a set, its genes are whole configurations. As a set has no order, a child does not cut its parents at a place:
//! it takes a random share of its configurations from one and the rest, none twice, from the other. Parents are winners of
//! tournaments. A child's configurations are then moved a little or drawn anew, each with a small probability, by steps that shrink
//! with the budget. The best of a generation live on beside its children.

use super::moves::{Record, fresh, near, or_worst};
use super::outcome::StopReason;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::seed::Stream;

/// Sets of a generation.
const POPULATION: u64 = 20;
/// Share of a generation that lives on, the best first.
const ELITE: f64 = 0.5;
/// Sets of which a parent is the best.
const TOURNAMENT: usize = 3;
/// Probability of a child to have two parents.
const CROSSOVER: f64 = 0.5;
/// Configurations of a child that are changed, on average.
const MUTATIONS: f64 = 1.0;
/// Share of these that are drawn anew.
const FRESH: f64 = 0.1;
/// Probability of a joint of a configuration that is moved to move.
const SHARE: f64 = 0.3;
/// Step of a joint at the start, as a share of its range (standard deviation).
const FIRST_STEP: f64 = 0.15;
/// The same at the end.
const LAST_STEP: f64 = 0.03;

/// Breeds until the budget is spent.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let mut record = Record::new(task);
    let mut population = Population::draw(task, task.count, stream)?;
    population.offer(&mut record);
    record.tell(population.mean(), watch)?;
    let start = task.evaluations();
    let length = task.left().max(1) as f64;
    while task.left() > 0 {
        population.breed(task, (task.evaluations() - start) as f64 / length, stream)?;
        population.offer(&mut record);
        record.tell(population.mean(), watch)?;
    }
    record.end(population.mean(), StopReason::BudgetSpent, watch)
}

/// A generation of sets, the best first. Their configurations may be fewer than the task's: each then counts several times.
pub(super) struct Population<'t, 'a> {
    task: &'t Task<'a>,
    /// Configurations of each set.
    sets: Vec<Vec<f64>>,
    /// Their values.
    values: Vec<f64>,
    scratch: Scratch,
}

impl<'t, 'a> Population<'t, 'a> {
    /// Random sets of `count` configurations, valued.
    ///
    /// # Errors
    /// If no configuration may be measured.
    pub(super) fn draw(task: &'t Task<'a>, count: usize, stream: &mut Stream) -> Result<Self, SearchError> {
        let size = POPULATION.min(task.left()).max(1);
        let sets = (0..size).map(|_| task.draw(stream, count)).collect::<Result<Vec<_>, _>>()?;
        let values = values(task, &sets);
        let mut population = Population { task, sets, values, scratch: Scratch::default() };
        population.sort();
        Ok(population)
    }

    /// The best set and its value.
    pub(super) fn best(&self) -> (&[f64], f64) {
        (&self.sets[0], self.values[0])
    }

    /// Mean of the finite values; that of the best if none is.
    pub(super) fn mean(&self) -> f64 {
        let finite = self.values.iter().filter(|value| value.is_finite());
        let count = finite.clone().count();
        if count == 0 { self.values[0] } else { finite.sum::<f64>() / count as f64 }
    }

    /// Offers the best set.
    pub(super) fn offer(&self, record: &mut Record<'_, '_>) {
        let (set, value) = self.best();
        if value > record.value() || record.configurations().is_empty() {
            record.offer(&repeated(set, self.task), value);
        }
    }

    /// The next generation; `progress` (0 to 1) tells how small the steps are.
    ///
    /// # Errors
    /// If no configuration may be measured.
    pub(super) fn breed(&mut self, task: &Task<'_>, progress: f64, stream: &mut Stream) -> Result<(), SearchError> {
        let size = self.sets.len();
        let elite = ((ELITE * size as f64) as usize).max(1);
        let children = (size - elite).max(1).min(usize::try_from(task.left()).unwrap_or(usize::MAX));
        let step = FIRST_STEP * libm::pow(LAST_STEP / FIRST_STEP, progress.min(1.0));
        let mut sets = Vec::with_capacity(children);
        for _ in 0..children {
            let mother = self.winner(stream);
            let (mut child, crossed) = if stream.unit() < CROSSOVER {
                let father = self.winner(stream);
                (self.cross(mother, father, stream), mother != father)
            } else {
                (self.sets[mother].clone(), false)
            };
            self.mutate(&mut child, step, !crossed, stream)?;
            sets.push(child);
        }
        let values = values(task, &sets);
        let survivors = elite.max(size - children);
        self.sets.truncate(survivors);
        self.values.truncate(survivors);
        self.sets.extend(sets);
        self.values.extend(values);
        self.sort();
        self.sets.truncate(size);
        self.values.truncate(size);
        Ok(())
    }

    /// The best of a few random sets.
    fn winner(&self, stream: &mut Stream) -> usize {
        (0..TOURNAMENT).map(|_| stream.index(self.sets.len())).min().unwrap_or(0)
    }

    /// A random share of `mother`'s configurations and the rest from `father`, none twice as far as they go.
    fn cross(&self, mother: usize, father: usize, stream: &mut Stream) -> Vec<f64> {
        let joints = self.task.arm().joint_count();
        let count = self.sets[mother].len() / joints;
        let mut order: Vec<usize> = (0..count).collect();
        stream.shuffle(&mut order);
        let keep = 1 + stream.index(count.max(2) - 1);
        let configuration = |set: usize, index: usize| &self.sets[set][index * joints..(index + 1) * joints];
        let mut child = Vec::with_capacity(count * joints);
        order.iter().take(keep).for_each(|index| child.extend_from_slice(configuration(mother, *index)));
        let mut others: Vec<usize> = (0..count).collect();
        stream.shuffle(&mut others);
        // What is left over of the mother fills the places for which the father has nothing new.
        let candidates = others.iter().map(|index| (father, *index)).chain(order.iter().skip(keep).map(|index| (mother, *index)));
        for (set, index) in candidates {
            if child.len() == count * joints {
                break;
            }
            let joint_values = configuration(set, index);
            if !child.chunks_exact(joints).any(|known| known == joint_values) {
                child.extend_from_slice(joint_values);
            }
        }
        // Only parents that hold a configuration twice come here.
        for index in order.iter().skip(keep) {
            if child.len() < count * joints {
                child.extend_from_slice(configuration(mother, *index));
            }
        }
        child
    }

    /// Moves or redraws some configurations; at least one if `sure`.
    fn mutate(&mut self, child: &mut [f64], step: f64, sure: bool, stream: &mut Stream) -> Result<(), SearchError> {
        let joints = self.task.arm().joint_count();
        let count = child.len() / joints;
        let chosen = stream.index(count);
        let mut out = Vec::new();
        for (index, configuration) in child.chunks_exact_mut(joints).enumerate() {
            if !(stream.unit() < MUTATIONS / count as f64 || (sure && index == chosen)) {
                continue;
            }
            if stream.unit() < FRESH {
                fresh(self.task, stream, &mut out)?;
                configuration.copy_from_slice(&out);
            } else if near(self.task, configuration, step, SHARE, stream, &mut self.scratch, &mut out) {
                configuration.copy_from_slice(&out);
            }
        }
        Ok(())
    }

    fn sort(&mut self) {
        let mut order: Vec<usize> = (0..self.sets.len()).collect();
        order.sort_by(|a, b| self.values[*b].total_cmp(&self.values[*a]));
        self.values = order.iter().map(|index| self.values[*index]).collect();
        self.sets = order.iter().map(|index| std::mem::take(&mut self.sets[*index])).collect();
    }
}

/// The configurations of `set`, each as often as the task's size asks for, as evenly as possible.
pub(super) fn repeated(set: &[f64], task: &Task<'_>) -> Vec<f64> {
    let joints = task.arm().joint_count();
    set.chunks_exact(joints).cycle().take(task.count).flatten().copied().collect()
}

/// Values of `sets` with repetitions, side by side.
pub(super) fn values(task: &Task<'_>, sets: &[Vec<f64>]) -> Vec<f64> {
    let whole = sets.first().is_none_or(|set| set.len() == task.count * task.arm().joint_count());
    let values =
        if whole { task.values(sets) } else { task.values(&sets.iter().map(|set| repeated(set, task)).collect::<Vec<_>>()) };
    values.into_iter().map(or_worst).collect()
}
