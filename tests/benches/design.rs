//! What the speed marks of designs are about: optimal approximate designs over many candidates.

use divan::{Bencher, black_box};
use kincal::design::approximate::{Criterion, Settings, optimise};
use kincal::design::candidates::Sampler;
use kincal::quality::information::{Blocks, InformationModel, JacobianScratch};
use kincal::scene::SceneFile;
use kincal::seed::stream;
use kincal::self_collision::CollisionCheck;

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

/// Blocks of `count` free configurations of the paper's arm, and the mean of PᵀP over 200 others, P the rows of positions in
/// their unscaled Jacobians.
fn candidates(count: usize) -> (Blocks, Vec<f64>) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml");
    let SceneFile { scene, .. } = kincal::scene::read(&path).expect("a shipped scene");
    let check = CollisionCheck::new(&scene.arm);
    let draw = |label: &str, count: usize| {
        Sampler::new(&scene.arm, &check).draw(&mut stream(1, label), count).expect("free configurations")
    };
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
