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

use super::outcome::{StopReason, SwarmIteration};
use super::problem::Swarm;
use super::search::{Found, Scratch, SearchError, SearchReport, Task, Watch, finite, split};
use crate::quality::Indexes;
use crate::quality::evaluator;
use crate::seed::Stream;

struct Particle {
    position: Vec<f64>,
    velocity: Vec<f64>,
    value: f64,
    best_position: Vec<f64>,
    best: f64,
    end_points: Vec<[f32; 3]>,
    moved: bool,
    scratch: Scratch,
}

/// Runs the swarm for sets of the task's size; `watch` sees the initial swarm and every iteration. Where the budget is smaller than
/// particles × (iterations + 1), fewer iterations are made.
///
/// All random numbers are drawn before particles are shared among threads: the outcome does not depend on their number.
///
/// # Errors
/// If no configuration may be measured, or the watcher's error.
pub fn search(task: &Task<'_>, settings: &Swarm, stream: &mut Stream, watch: &mut Watch<'_>) -> Result<Found, SearchError> {
    let joints = &task.arm().chain.joints;
    let affordable = usize::try_from(task.budget).unwrap_or(usize::MAX) / settings.particles.max(1);
    let iterations = settings.iterations.min(affordable.saturating_sub(1));
    let mut particles = Vec::with_capacity(settings.particles);
    for _ in 0..settings.particles {
        let position = task.draw(stream, task.count)?;
        let velocity =
            (0..task.count).flat_map(|_| joints.iter()).map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
        particles.push(Particle {
            best_position: position.clone(),
            position,
            velocity,
            value: f64::NEG_INFINITY,
            best: f64::NEG_INFINITY,
            end_points: Vec::new(),
            moved: true,
            scratch: Scratch::default(),
        });
    }
    particles.par_iter_mut().for_each(|particle| {
        particle.evaluate(task);
        particle.best = particle.value;
    });
    let mut leader = leader_of(&particles);
    let mut swarm_best = particles[leader].best_position.clone();
    let mut swarm_value = particles[leader].best;
    let indexes = |set: &[f64]| task.objective.models().evaluator.evaluate(set, &mut evaluator::Scratch::default());
    let mut swarm_indexes = Indexes::default();
    let mut told = None;
    let mut stop = StopReason::IterationLimit;
    let (mut inertia, mut c1, mut c2) = (0.0, 0.0, 0.0);

    for iteration in 0..=iterations {
        if iteration > 0 {
            let k = iteration as f64 / iterations as f64;
            inertia = settings.inertia[1] - k * (settings.inertia[1] - settings.inertia[0]);
            let mean = particles.iter().map(|particle| particle.best).sum::<f64>() / particles.len() as f64;
            c1 = 4.0 - libm::exp(-settings.tau * (mean - swarm_value).abs());
            c2 = 4.0 - c1;
            let pulls: Vec<(f64, f64)> = particles.iter().map(|_| (c1 * stream.unit(), c2 * stream.unit())).collect();
            particles.par_iter_mut().zip(pulls).for_each(|(particle, pull)| {
                particle.step(task, inertia, pull, &swarm_best, settings.velocity_factor);
                particle.evaluate(task);
                if particle.value > particle.best {
                    particle.best = particle.value;
                    particle.best_position.copy_from_slice(&particle.position);
                }
            });
            let first = leader_of(&particles);
            if particles[first].best > swarm_value {
                leader = first;
                swarm_best.copy_from_slice(&particles[first].best_position);
                swarm_value = particles[first].best;
            }
        }
        let improved = told.is_none_or(|told| swarm_value > told);
        told = Some(swarm_value);
        if improved {
            swarm_indexes = indexes(&swarm_best);
        }
        watch.report(SearchReport::Swarm(SwarmIteration {
            iteration,
            iterations,
            fitness: particles.iter().map(|particle| particle.value).collect(),
            personal_best: particles.iter().map(|particle| particle.best).collect(),
            best_particle: leader,
            best: swarm_indexes,
            inertia,
            c1,
            c2,
            evaluations: task.evaluations(),
            rejections: task.rejections(),
            end_points: particles.iter().map(|particle| particle.end_points.clone()).collect(),
            best_configurations: if improved { split(&swarm_best, joints.len()) } else { Vec::new() },
        }))?;
        if iteration > 0 && particles.iter().all(|particle| !particle.moved) {
            stop = StopReason::Converged;
            break;
        }
    }
    Ok(Found { configurations: swarm_best, value: swarm_value, stop })
}

/// The particle with the highest best-known fitness, the first of equals.
fn leader_of(particles: &[Particle]) -> usize {
    (1..particles.len()).fold(
        0,
        |leader, particle| {
            if particles[particle].best > particles[leader].best { particle } else { leader }
        },
    )
}

impl Particle {
    fn evaluate(&mut self, task: &Task<'_>) {
        self.value = finite(task.value(&self.position, &mut self.scratch));
        self.end_points.clear();
        let ends = self.scratch.objective.end_points();
        self.end_points.extend(ends.iter().map(|point| [point.x as f32, point.y as f32, point.z as f32]));
    }

    /// Eq. 36 with the limits and the rules.
    fn step(&mut self, task: &Task<'_>, inertia: f64, pull: (f64, f64), swarm_best: &[f64], factor: f64) {
        let joints = &task.arm().chain.joints;
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
            if task.refuses(&candidate, &mut self.scratch) {
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
    use crate::design::candidates::Rules;
    use crate::design::objective::{Models, Objective};
    use crate::design::problem::Criterion;
    use crate::scene::SceneFile;
    use crate::seed::stream;

    fn cell() -> SceneFile {
        crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml")).unwrap()
    }

    /// What a small swarm finds and tells, with its evaluations and rejections.
    fn swarm() -> (Found, Vec<SwarmIteration>, [u64; 2]) {
        let file = cell();
        let scene = &file.scene;
        let models = Models::new(&scene.request()).unwrap();
        let objective = Objective::new(&models, Criterion::Comprehensive, scene.arm.joint_count());
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let task = Task::new(&rules, &objective, 10, u64::MAX, 1);
        let settings = Swarm { particles: 6, iterations: 15, ..scene.design.swarm.clone() };
        let mut told = Vec::new();
        let mut watch = |step: SearchReport| {
            let SearchReport::Swarm(iteration) = step else { panic!("a swarm tells iterations") };
            told.push(iteration);
            Ok(())
        };
        let found = search(&task, &settings, &mut stream(5, "test/swarm"), &mut watch).unwrap();
        (found, told, [task.evaluations(), task.rejections()])
    }

    #[test]
    fn no_best_ever_collides_or_leaves_the_limits_and_the_swarm_only_gets_better() {
        let (found, told, [evaluations, rejections]) = swarm();
        let scene = cell().scene;
        let rules = Rules::measurable(&scene.arm, &scene.sensor);
        let mut bests = 0;
        for joints in told.iter().flat_map(|iteration| &iteration.best_configurations) {
            assert!(scene.arm.within_limits(joints) && !rules.refuses(joints, &mut Default::default()), "{joints:?}");
            bests += 1;
        }
        assert!(bests >= 10);
        assert!(told.windows(2).all(|pair| pair[1].best.comprehensive >= pair[0].best.comprehensive));
        assert_eq!(evaluations, 6 * 16);
        assert!(rejections > 0, "collisions bind in this cell");
        let last = told.last().unwrap();
        assert_eq!([last.evaluations, last.rejections], [evaluations, rejections]);
        assert_eq!(last.best.comprehensive, found.value);
    }

    #[test]
    fn inertia_and_factors_follow_equations_37_and_38() {
        let (_, told, _) = swarm();
        let last = told.last().unwrap();
        assert_eq!(last.inertia, 0.4);
        let before = &told[told.len() - 2];
        let mean = before.personal_best.iter().sum::<f64>() / before.personal_best.len() as f64;
        assert!((last.c1 - (4.0 - (-(mean - before.best.comprehensive).abs()).exp())).abs() < 1e-12);
        assert_eq!(last.c2, 4.0 - last.c1);
    }
}
