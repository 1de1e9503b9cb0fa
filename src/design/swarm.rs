//! Particle swarm on the comprehensive index: Chen et al. 2019, eqs. 33–38 and Table 5.
//!
//! A particle is a set of m configurations (eq. 33). Its best-known position and the swarm's pull it (eq. 36) with an inertia that
//! falls linearly (eq. 37) and acceleration factors that depend on how far the swarm's mean fitness is from its best (eq. 38: c1 in
//! [3, 4), c2 in (0, 1]; Table 5 prints (0, 4) for both, the equation is followed). σ and η are one draw each per particle and
//! iteration, as eq. 36 writes them.
//!
//! Added to the paper: a step is cut at the joint limits, and a configuration that would collide stays where it was, with its
//! velocity set to zero, so that every set that is ever evaluated, and so every best, is free of collisions (of the nominal arm: the
//! true one is not known).

use rayon::prelude::*;

use super::candidates::{AlwaysColliding, Sampler};
use super::outcome::{StopReason, SwarmIteration};
use crate::arm::Arm;
use crate::quality::Indexes;
use crate::quality::evaluator::{self, Evaluator};
use crate::scene::Swarm;
use crate::seed::Stream;
use crate::self_collision::{self, CollisionCheck};

/// Where the swarm ended.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// The swarm's best-known position: configurations one after the other (rad or m).
    pub configurations: Vec<f64>,
    /// Its indexes.
    pub indexes: Indexes,
    /// Evaluations of the fitness.
    pub evaluations: u64,
    /// Configurations refused because they collide, the initial draws included.
    pub rejections: u64,
    /// Why it stopped.
    pub stop: StopReason,
}

struct Particle {
    position: Vec<f64>,
    velocity: Vec<f64>,
    indexes: Indexes,
    best_position: Vec<f64>,
    best: Indexes,
    end_points: Vec<[f32; 3]>,
    rejections: u64,
    moved: bool,
    scratch: evaluator::Scratch,
    collision_scratch: self_collision::Scratch,
}

/// An error of the search itself or of whoever watches it.
#[derive(Debug, thiserror::Error)]
pub enum SwarmError<E: std::error::Error> {
    /// No configuration is free of collisions.
    #[error(transparent)]
    AlwaysColliding(#[from] AlwaysColliding),
    /// The watcher refused an iteration.
    #[error(transparent)]
    Watcher(E),
}

/// Runs the swarm for sets of `count` configurations; `watch` sees the initial swarm and every iteration.
///
/// All random numbers are drawn before particles are shared among threads: the outcome does not depend on their number.
///
/// # Errors
/// If no configuration is free of collisions, or the watcher's error.
pub fn optimise<E: std::error::Error>(
    arm: &Arm,
    evaluator: &Evaluator,
    check: &CollisionCheck,
    count: usize,
    settings: &Swarm,
    stream: &mut Stream,
    mut watch: impl FnMut(&SwarmIteration) -> Result<(), E>,
) -> Result<Optimum, SwarmError<E>> {
    let mut sampler = Sampler::new(arm, check);
    let joints = &arm.chain.joints;
    let mut particles = Vec::with_capacity(settings.particles);
    for _ in 0..settings.particles {
        let position = sampler.draw(stream, count)?;
        let velocity = (0..count).flat_map(|_| joints.iter()).map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
        particles.push(Particle {
            best_position: position.clone(),
            position,
            velocity,
            indexes: Indexes::default(),
            best: Indexes::default(),
            end_points: Vec::new(),
            rejections: 0,
            moved: true,
            scratch: evaluator::Scratch::default(),
            collision_scratch: self_collision::Scratch::default(),
        });
    }
    particles.par_iter_mut().for_each(|particle| {
        particle.evaluate(evaluator);
        particle.best = particle.indexes;
    });
    let drawn_rejections = sampler.rejections;
    let mut evaluations = particles.len() as u64;
    let mut leader = leader_of(&particles);
    let mut swarm_best = particles[leader].best_position.clone();
    let mut swarm_indexes = particles[leader].best;
    let mut told_fitness = f64::NEG_INFINITY;
    let mut stop = StopReason::IterationLimit;
    let (mut inertia, mut c1, mut c2) = (0.0, 0.0, 0.0);

    for iteration in 0..=settings.iterations {
        if iteration > 0 {
            let k = iteration as f64 / settings.iterations as f64;
            inertia = settings.inertia[1] - k * (settings.inertia[1] - settings.inertia[0]);
            let mean = particles.iter().map(|particle| particle.best.comprehensive).sum::<f64>() / particles.len() as f64;
            c1 = 4.0 - libm::exp(-settings.tau * (mean - swarm_indexes.comprehensive).abs());
            c2 = 4.0 - c1;
            let pulls: Vec<(f64, f64)> = particles.iter().map(|_| (c1 * stream.unit(), c2 * stream.unit())).collect();
            particles.par_iter_mut().zip(pulls).for_each(|(particle, pull)| {
                particle.step(arm, check, inertia, pull, &swarm_best, settings.velocity_factor);
                particle.evaluate(evaluator);
                if particle.indexes.comprehensive > particle.best.comprehensive {
                    particle.best = particle.indexes;
                    particle.best_position.copy_from_slice(&particle.position);
                }
            });
            evaluations += particles.len() as u64;
            let first = leader_of(&particles);
            if particles[first].best.comprehensive > swarm_indexes.comprehensive {
                leader = first;
                swarm_best.copy_from_slice(&particles[first].best_position);
                swarm_indexes = particles[first].best;
            }
        }
        let improved = swarm_indexes.comprehensive > told_fitness;
        told_fitness = swarm_indexes.comprehensive;
        watch(&SwarmIteration {
            iteration,
            iterations: settings.iterations,
            fitness: particles.iter().map(|particle| particle.indexes.comprehensive).collect(),
            personal_best: particles.iter().map(|particle| particle.best.comprehensive).collect(),
            best_particle: leader,
            best: swarm_indexes,
            inertia,
            c1,
            c2,
            evaluations,
            rejections: drawn_rejections + particles.iter().map(|particle| particle.rejections).sum::<u64>(),
            end_points: particles.iter().map(|particle| particle.end_points.clone()).collect(),
            best_configurations: if improved { split(&swarm_best, arm.joint_count()) } else { Vec::new() },
        })
        .map_err(SwarmError::Watcher)?;
        if iteration > 0 && particles.iter().all(|particle| !particle.moved) {
            stop = StopReason::Converged;
            break;
        }
    }
    Ok(Optimum {
        configurations: swarm_best,
        indexes: swarm_indexes,
        evaluations,
        rejections: drawn_rejections + particles.iter().map(|particle| particle.rejections).sum::<u64>(),
        stop,
    })
}

/// Splits configurations that stand one after the other.
#[must_use]
pub fn split(configurations: &[f64], joint_count: usize) -> Vec<Vec<f64>> {
    configurations.chunks_exact(joint_count).map(<[f64]>::to_vec).collect()
}

/// The particle with the highest best-known fitness, the first of equals.
fn leader_of(particles: &[Particle]) -> usize {
    (1..particles.len()).fold(0, |leader, particle| {
        if particles[particle].best.comprehensive > particles[leader].best.comprehensive { particle } else { leader }
    })
}

impl Particle {
    fn evaluate(&mut self, evaluator: &Evaluator) {
        self.indexes = evaluator.evaluate(&self.position, &mut self.scratch);
        self.end_points.clear();
        let ends = evaluator.end_points(&self.scratch);
        self.end_points.extend(ends.iter().map(|point| [point.x as f32, point.y as f32, point.z as f32]));
    }

    /// Eq. 36 with the limits and the collisions.
    fn step(&mut self, arm: &Arm, check: &CollisionCheck, inertia: f64, pull: (f64, f64), swarm_best: &[f64], factor: f64) {
        let joints = &arm.chain.joints;
        let mut moved = false;
        let mut candidate = vec![0.0; joints.len()];
        for start in (0..self.position.len()).step_by(joints.len()) {
            for (offset, joint) in joints.iter().enumerate() {
                let at = start + offset;
                let (position, velocity) = (self.position[at], self.velocity[at]);
                self.velocity[at] =
                    inertia * velocity + pull.0 * (self.best_position[at] - position) + pull.1 * (swarm_best[at] - position);
                candidate[offset] = (position + factor * self.velocity[at]).clamp(joint.lower, joint.upper);
            }
            let range = start..start + joints.len();
            if check.collides(&candidate, &mut self.collision_scratch) {
                self.rejections += 1;
                self.velocity[range].fill(0.0);
                // It did not move, but the pull may still move it.
                moved = true;
            } else {
                moved |= self.position[range.clone()] != candidate || self.velocity[range.clone()].iter().any(|v| *v != 0.0);
                self.position[range].copy_from_slice(&candidate);
            }
        }
        self.moved = moved;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneFile;
    use crate::seed::stream;

    fn cell() -> SceneFile {
        crate::scene::read(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml")).unwrap()
    }

    fn optimise_cell(threads: usize) -> (Optimum, Vec<SwarmIteration>) {
        let file = cell();
        let scene = &file.scene;
        let evaluator = Evaluator::new(
            &scene.arm,
            true,
            scene.design.evenness_domain,
            scene.design.evenness_step_m,
            scene.design.jacobian_scaling,
        );
        let check = CollisionCheck::new(&scene.arm);
        let settings = Swarm { particles: 6, iterations: 15, ..scene.design.swarm.clone() };
        let mut told = Vec::new();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let optimum = pool
            .install(|| {
                let watch = |iteration: &SwarmIteration| {
                    told.push(iteration.clone());
                    Ok::<(), std::convert::Infallible>(())
                };
                optimise(&scene.arm, &evaluator, &check, 10, &settings, &mut stream(5, "test/swarm"), watch)
            })
            .unwrap();
        (optimum, told)
    }

    #[test]
    fn the_outcome_does_not_depend_on_the_number_of_threads() {
        let (one, told_one) = optimise_cell(1);
        let (two, told_two) = optimise_cell(2);
        assert_eq!(one.configurations, two.configurations);
        assert_eq!(told_one, told_two);
    }

    #[test]
    fn no_best_ever_collides_or_leaves_the_limits_and_the_swarm_only_gets_better() {
        let (optimum, told) = optimise_cell(2);
        let arm = cell().scene.arm;
        let check = CollisionCheck::new(&arm);
        let mut scratch = self_collision::Scratch::default();
        let mut bests = 0;
        for joints in told.iter().flat_map(|iteration| &iteration.best_configurations) {
            assert!(arm.within_limits(joints) && !check.collides(joints, &mut scratch), "{joints:?}");
            bests += 1;
        }
        assert!(bests >= 10);
        assert!(told.windows(2).all(|pair| pair[1].best.comprehensive >= pair[0].best.comprehensive));
        assert_eq!(optimum.evaluations, 6 * 16);
        assert!(optimum.rejections > 0, "collisions bind in this cell");
        let last = told.last().unwrap();
        assert_eq!((last.rejections, last.evaluations), (optimum.rejections, optimum.evaluations));
        assert_eq!(last.best.comprehensive, optimum.indexes.comprehensive);
    }

    #[test]
    fn inertia_and_factors_follow_equations_37_and_38() {
        let (_, told) = optimise_cell(1);
        let last = told.last().unwrap();
        assert_eq!(last.inertia, 0.4);
        let before = &told[told.len() - 2];
        let mean = before.personal_best.iter().sum::<f64>() / before.personal_best.len() as f64;
        assert!((last.c1 - (4.0 - (-(mean - before.best.comprehensive).abs()).exp())).abs() < 1e-12);
        assert_eq!(last.c2, 4.0 - last.c1);
    }
}
