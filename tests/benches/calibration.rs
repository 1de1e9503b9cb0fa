//! What the speed marks are about: the comprehensive index, the swarm, and an identification.

use divan::{Bencher, black_box};
use kincal::arm::self_collision::{self, CollisionCheck};
use kincal::arm::urdf;
use kincal::design::candidates::{Rules, Sampler};
use kincal::design::objective::{Models, Objective};
use kincal::design::problem::Criterion;
use kincal::design::search::{SearchReport, Task, split};
use kincal::design::swarm;
use kincal::identification::real::Wishes;
use kincal::identification::{identify, identify_real};
use kincal::measurement::{Measurement, Sensor};
use kincal::progress::Silent;
use kincal::quality::evaluator::{Evaluator, Scratch};
use kincal::scene::SceneFile;
use kincal::seed::stream;
use kincal::simulation::cell::measure;
use kincal::simulation::cell::plan::plan;

fn main() {
    divan::main();
}

fn scene(name: &str) -> SceneFile {
    kincal::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).expect("a shipped scene")
}

fn evaluator(file: &SceneFile) -> Evaluator {
    let design = &file.scene.design;
    Evaluator::new(&file.scene.arm, true, design.evenness_domain, design.evenness_step_m, design.jacobian_scaling)
}

/// One evaluation of O_C with m = 40, collision checks of all 40 configurations included. Mark: 300 µs on one core.
#[divan::bench(args = ["arm8.toml", "paper.toml"])]
fn comprehensive_index(bencher: Bencher, name: &str) {
    let file = scene(name);
    let evaluator = evaluator(&file);
    let check = CollisionCheck::new(&file.scene.arm);
    let sets = sets(&file, 20);
    let (mut scratch, mut collision_scratch) = (Scratch::default(), self_collision::Scratch::default());
    let mut next = sets.iter().cycle();
    bencher.bench_local(|| {
        let set = next.next().expect("a cycle has no end");
        let free = set.chunks_exact(8).filter(|joints| !check.collides(joints, &mut collision_scratch)).count();
        (free, evaluator.evaluate(black_box(set), &mut scratch))
    });
}

/// The collision checks of 40 configurations alone.
#[divan::bench]
fn collision_checks(bencher: Bencher) {
    let file = scene("arm8.toml");
    let check = CollisionCheck::new(&file.scene.arm);
    let sets = sets(&file, 1);
    let mut scratch = self_collision::Scratch::default();
    bencher.bench_local(|| sets[0].chunks_exact(8).filter(|joints| check.collides(joints, &mut scratch)).count());
}

/// Table 5's swarm: 20 particles, 200 iterations, m = 40. Mark: 1 s on two cores.
#[divan::bench(args = ["arm8.toml", "paper.toml"], sample_count = 5)]
fn swarm(bencher: Bencher, name: &str) {
    let file = scene(name);
    let scene = &file.scene;
    let models = Models::new(&scene.request()).expect("free configurations");
    let objective = Objective::new(&models, Criterion::Comprehensive, scene.arm.joint_count());
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    bencher.bench_local(|| {
        let task = Task::new(&rules, &objective, 40, scene.design.swarm.evaluations(), 1);
        swarm::search(&task, &scene.design.swarm, &mut stream(1, "bench/swarm"), &mut |_: SearchReport| Ok(()))
            .map(|found| found.value)
    });
}

/// Identification of the 8R arm from 50 full poses, the held-out errors included. Mark: 5 ms.
#[divan::bench(args = ["arm8.toml", "paper.toml"])]
fn identification(bencher: Bencher, name: &str) {
    let file = scene(name);
    let measurements = measurements(&file, 50);
    let scene = &file.scene;
    bencher.bench_local(|| identify(&scene.arm, &scene.sensor, scene.weights, black_box(&measurements)));
}

/// Identification of a real arm with six joints from positions alone, the ladder included. Marks: 50 ms for 1000, 1 s for 20 000.
#[divan::bench(args = [1000, 20_000], sample_count = 5)]
fn real_arm(bencher: Bencher, count: usize) {
    let robot = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tutorial.urdf");
    let arm = urdf::read(&robot, None, None).expect("a shipped robot").arm;
    let mut draws = stream(1, "bench/real");
    let values: Vec<f64> = arm.chain.nominal().iter().map(|value| value + 5e-4 * draws.normal()).collect();
    let chain = arm.chain.at(&values);
    let rows: Vec<Measurement> = (0..count)
        .map(|index| {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|of| draws.uniform(of.lower, of.upper)).collect();
            let at = chain.forward(&joints).translation.vector;
            let position_m = [at.x, at.y, at.z].map(|value| value + 5e-5 * draws.normal());
            Measurement { index, pose_id: index, joints, position_m, ..Measurement::default() }
        })
        .collect();
    let sensor = Sensor::uniform(5e-5, None);
    bencher.bench_local(|| identify_real(&arm, &sensor, black_box(&rows), Wishes::default()).expect("an arm"));
}

fn sets(file: &SceneFile, count: usize) -> Vec<Vec<f64>> {
    let mut stream = stream(1, "bench/sets");
    let rules = Rules::reachable(&file.scene.arm);
    let mut sampler = Sampler::new(&rules);
    (0..count).map(|_| sampler.draw(&mut stream, 40).expect("free configurations")).collect()
}

fn measurements(file: &SceneFile, count: usize) -> Vec<Measurement> {
    let rules = Rules::reachable(&file.scene.arm);
    let mut sampler = Sampler::new(&rules);
    let chosen = sampler.draw(&mut stream(1, "bench/poses"), count).expect("free configurations");
    let planned = plan(&file.scene.cell(), &split(&chosen, 8), &[]);
    let injected = file.injected.as_ref().expect("a scene to simulate");
    measure(&file.scene.cell(), injected, &planned, planned.len(), &mut Silent).expect("measurements").0
}
