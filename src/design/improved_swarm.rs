//! An improved particle swarm, after W. Wang et al. 2018 (Robotics and Computer-Integrated Manufacturing 50, 90–101).
//!
//! That paper could not be had, and these are not its formulas. This is what improved swarms have in common:
//!
//! - the inertia falls linearly (Shi and Eberhart 1998), the pull of a particle's own best falls and that of the swarm's grows
//!   (Ratnaweera, Halgamuge and Watson 2004, IEEE Trans. Evolutionary Computation 8, 240–255);
//! - σ and η are drawn for every joint of every configuration, not once for a particle as eq. 36 of Chen et al. 2019 has it;
//! - velocities are bounded, and particles bounce off the joint limits and off what the rules refuse;
//! - particles that have not got better for some time start again from their best with some configurations drawn anew.
//!
//! And, as the abstract of a thesis on the same robot names it as what a swarm of poses stumbles over, the order of configurations
//! does not count: a configuration is pulled to the nearest one of the swarm's best set, each to another.

use rayon::prelude::*;

use super::moves::{Record, fresh, or_worst, reflect};
use super::outcome::StopReason;
use super::problem::Swarm;
use super::search::{Found, Scratch, SearchError, Task, Watch};
use crate::arm::Arm;
use crate::seed::Stream;

/// Inertia at the start and at the end.
const INERTIA: [f64; 2] = [0.9, 0.4];
/// Pull of a particle's own best at the start and at the end.
const OWN: [f64; 2] = [2.5, 0.5];
/// Pull of the swarm's best at the start and at the end.
const SWARM: [f64; 2] = [0.5, 2.5];
/// Largest velocity of a joint, as a share of its range.
const FASTEST: f64 = 0.1;
/// Share of the velocity with which a particle bounces off.
const BOUNCE: f64 = 0.5;
/// Iterations without a better set after which a particle starts again.
const PATIENCE: usize = 10;
/// Configurations that are then drawn anew, as a share of the set.
const MUTATED: f64 = 0.05;

/// A set on its way. Its best is the best that it has been.
struct Particle {
    position: Vec<f64>,
    velocity: Vec<f64>,
    value: f64,
    best_position: Vec<f64>,
    best: f64,
    idle: usize,
    /// σ and η of every joint.
    draws: Vec<f64>,
    /// The swarm's best, in the order of the own configurations.
    target: Vec<f64>,
    /// Memory for that order.
    pairs: Vec<(f64, usize, usize)>,
    /// Memory.
    scratch: Scratch,
}

/// Runs the swarm over the budget; of `settings` it takes the number of particles.
///
/// All random numbers are drawn before particles are shared among threads: the outcome does not depend on their number.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, settings: &Swarm, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let limits = &task.arm().chain.joints;
    let mut record = Record::new(task);
    let size = settings.particles.min(usize::try_from(task.left()).unwrap_or(usize::MAX)).max(1);
    let mut particles = Vec::with_capacity(size);
    for _ in 0..size {
        let position = task.draw(stream, task.count)?;
        let velocity = (0..task.count)
            .flat_map(|_| limits.iter())
            .map(|limit| FASTEST * (limit.upper - limit.lower) * stream.uniform(-1.0, 1.0))
            .collect();
        particles.push(Particle {
            best_position: position.clone(),
            position,
            velocity,
            value: f64::NEG_INFINITY,
            best: f64::NEG_INFINITY,
            idle: 0,
            draws: Vec::new(),
            target: Vec::new(),
            pairs: Vec::new(),
            scratch: Scratch::default(),
        });
    }
    particles.par_iter_mut().for_each(|particle| particle.evaluate(task));
    offer(&particles, &mut record);
    record.tell(mean(&particles), watch)?;

    let start = task.evaluations();
    let length = task.left().max(1) as f64;
    while task.left() > 0 {
        let progress = (task.evaluations() - start) as f64 / length;
        let between = |[first, last]: [f64; 2]| first + (last - first) * progress;
        let pull = [INERTIA, OWN, SWARM].map(between);
        let moving = size.min(usize::try_from(task.left()).unwrap_or(usize::MAX));
        for particle in &mut particles[..moving] {
            particle.draws.clear();
            particle.draws.extend((0..2 * particle.position.len()).map(|_| stream.unit()));
            if particle.idle >= PATIENCE {
                particle.mutate(task, stream)?;
            }
        }
        let leader = record.configurations();
        particles[..moving].par_iter_mut().for_each(|particle| {
            particle.step(task, pull, leader);
            particle.evaluate(task);
        });
        offer(&particles, &mut record);
        record.tell(mean(&particles), watch)?;
    }
    record.end(mean(&particles), StopReason::BudgetSpent, watch)
}

/// Offers every particle's best.
fn offer(particles: &[Particle], record: &mut Record<'_, '_>) {
    particles.iter().for_each(|particle| record.offer(&particle.best_position, particle.best));
}

/// Mean of the finite values.
fn mean(particles: &[Particle]) -> f64 {
    let finite = particles.iter().map(|particle| particle.value).filter(|value| value.is_finite());
    let count = finite.clone().count();
    if count == 0 { f64::NEG_INFINITY } else { finite.sum::<f64>() / count as f64 }
}

impl Particle {
    fn evaluate(&mut self, task: &Task<'_>) {
        self.value = or_worst(task.value(&self.position, &mut self.scratch));
        if self.value > self.best {
            self.best = self.value;
            self.best_position.copy_from_slice(&self.position);
            self.idle = 0;
        } else {
            self.idle += 1;
        }
    }

    /// Starts again from its best, with some configurations drawn anew and at rest.
    fn mutate(&mut self, task: &Task<'_>, stream: &mut Stream) -> Result<(), SearchError> {
        let joints = task.arm().joint_count();
        self.position.copy_from_slice(&self.best_position);
        self.velocity.fill(0.0);
        let mut drawn = Vec::new();
        for _ in 0..((MUTATED * task.count as f64) as usize).max(1) {
            let start = stream.index(task.count) * joints;
            fresh(task, stream, &mut drawn)?;
            self.position[start..start + joints].copy_from_slice(&drawn);
        }
        self.idle = 0;
        Ok(())
    }

    /// Moves by inertia and by what the particle's own best and that of the swarm (`leader`) pull.
    fn step(&mut self, task: &Task<'_>, [inertia, own, swarm]: [f64; 3], leader: &[f64]) {
        let limits = &task.arm().chain.joints;
        assign(task.arm(), &self.position, leader, &mut self.pairs, &mut self.target);
        let mut candidate = vec![0.0; limits.len()];
        for start in (0..self.position.len()).step_by(limits.len()) {
            for (offset, limit) in limits.iter().enumerate() {
                let at = start + offset;
                let position = self.position[at];
                let fastest = FASTEST * (limit.upper - limit.lower);
                let velocity = inertia * self.velocity[at]
                    + own * self.draws[2 * at] * (self.best_position[at] - position)
                    + swarm * self.draws[2 * at + 1] * (self.target[at] - position);
                self.velocity[at] = velocity.clamp(-fastest, fastest);
                let next = position + self.velocity[at];
                candidate[offset] = reflect(next, limit.lower, limit.upper);
                if next < limit.lower || next > limit.upper {
                    self.velocity[at] *= -BOUNCE;
                }
            }
            let range = start..start + limits.len();
            if task.refuses(&candidate, &mut self.scratch) {
                self.velocity[range].iter_mut().for_each(|velocity| *velocity *= -BOUNCE);
            } else {
                self.position[range].copy_from_slice(&candidate);
            }
        }
    }
}

/// Writes the configurations of `leader` to `target` in the order that puts each near one of `set`: the nearest pairs first.
fn assign(arm: &Arm, set: &[f64], leader: &[f64], pairs: &mut Vec<(f64, usize, usize)>, target: &mut Vec<f64>) {
    let limits = &arm.chain.joints;
    let joints = limits.len();
    let count = set.len() / joints;
    let over: Vec<f64> = limits.iter().map(|limit| 1.0 / (limit.upper - limit.lower).max(f64::MIN_POSITIVE)).collect();
    pairs.clear();
    for (i, one) in set.chunks_exact(joints).enumerate() {
        for (j, other) in leader.chunks_exact(joints).enumerate() {
            let square: f64 = one.iter().zip(other).zip(&over).map(|((a, b), over)| (a - b) * (a - b) * over * over).sum();
            pairs.push((square, i, j));
        }
    }
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    target.clear();
    target.resize(set.len(), 0.0);
    let (mut placed, mut taken) = (vec![false; count], vec![false; count]);
    for &(_, i, j) in pairs.iter() {
        if !placed[i] && !taken[j] {
            (placed[i], taken[j]) = (true, true);
            target[i * joints..(i + 1) * joints].copy_from_slice(&leader[j * joints..(j + 1) * joints]);
        }
    }
}
