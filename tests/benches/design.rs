//! What the speed marks of designs are about: optimal approximate designs over many candidates, and DETMAX.

use divan::{Bencher, black_box};
use kincal::design::approximate::{Criterion, Settings, optimise};
use kincal::design::bound::bound;
use kincal::design::candidates::{Rules, Sampler};
use kincal::design::detmax::detmax;
use kincal::design::objective::{Models, Objective};
use kincal::design::search::Task;
use kincal::quality::information::{Blocks, InformationModel, JacobianScratch};
use kincal::scene::{self, SceneFile};
use kincal::seed::stream;

fn main() {
    divan::main();
}

/// A D-optimal approximate design over the candidates, to a gap of 1e-3. Mark: 0.1 s for 1000 candidates on two cores.
#[divan::bench(args = [1000, 2000, 4000])]
fn approximate_d(bencher: Bencher, count: usize) {
    let (blocks, _) = candidates(count);
    bencher.bench_local(|| optimise(black_box(&blocks), Criterion::D, &Settings::default()));
}

/// A design that predicts positions in the workspace best, to a gap of 1e-3. Mark: 0.1 s for 1000 candidates on two cores.
#[divan::bench(args = [1000, 2000, 4000])]
fn approximate_l(bencher: Bencher, count: usize) {
    let (blocks, workspace) = candidates(count);
    bencher.bench_local(|| optimise(black_box(&blocks), Criterion::L(&workspace), &Settings::default()));
}

/// DETMAX for 40 of a pool of 1000, from random members to a set that no excursion makes better. Mark: 0.1 s on two cores.
#[divan::bench(args = [kincal::design::problem::Criterion::DOptimality, kincal::design::problem::Criterion::IOptimality], sample_count = 20)]
fn detmax_40_of_1000(bencher: Bencher, criterion: kincal::design::problem::Criterion) {
    let SceneFile { scene, .. } = paper();
    let models = Models::new(&scene.request()).expect("free configurations");
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    let objective = Objective::new(&models, criterion, scene.arm.joint_count());
    let pool = Sampler::new(&rules).draw(&mut stream(1, "bench/pool"), 1000).expect("free configurations");
    bencher.bench_local(|| {
        let task = Task::new(&rules, &objective, 40, u64::MAX, 1000);
        detmax(&task, black_box(&pool), (0..40).collect())
    });
}

/// The bound that a design's advice rests on, over all configurations of the arm.
#[divan::bench(sample_count = 5)]
fn bound_of_all_configurations(bencher: Bencher) {
    let SceneFile { scene, .. } = paper();
    let models = Models::new(&scene.request()).expect("free configurations");
    let rules = Rules::measurable(&scene.arm, &scene.sensor);
    bencher.bench_local(|| bound(&models, &rules, kincal::design::problem::Criterion::IOptimality, 1000));
}

fn paper() -> SceneFile {
    scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml")).expect("a shipped scene")
}

/// Blocks of `count` free configurations of the paper's arm, and the mean of PᵀP over 200 others, P the rows of positions in
/// their unscaled Jacobians.
fn candidates(count: usize) -> (Blocks, Vec<f64>) {
    let SceneFile { scene, .. } = paper();
    let rules = Rules::reachable(&scene.arm);
    let draw = |label: &str, count: usize| Sampler::new(&rules).draw(&mut stream(1, label), count).expect("free configurations");
    let configurations = draw("bench/candidates", count);
    let predicted = draw("bench/workspace", 200);
    let model = InformationModel::new(&scene.arm, &scene.sensor, scene.weights);
    let n = model.rank();
    let mut workspace = vec![0.0; n * n];
    let (mut scratch, mut rows) = (JacobianScratch::default(), vec![0.0; 6 * n]);
    for joints in predicted.chunks_exact(scene.arm.joint_count()) {
        model.unscaled_into(joints, &mut scratch, &mut rows);
        for row in rows[..3 * n].chunks_exact(n) {
            for (line, left) in workspace.chunks_exact_mut(n).zip(row) {
                line.iter_mut().zip(row).for_each(|(sum, right)| *sum += left * right / 200.0);
            }
        }
    }
    (Blocks::of(&model, &configurations, scene.arm.joint_count()), workspace)
}
