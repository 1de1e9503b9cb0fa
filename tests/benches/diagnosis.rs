//! What the speed marks of the diagnosis are about: all kinds and places, nested cross-validation; and the evidence of single effects.

use divan::{Bencher, black_box};
use kincal::diagnosis::outcome::NoiseSource;
use kincal::diagnosis::{Options, Singles, diagnose};
use kincal::lab::challenge::{self, case};
use kincal::lab::reproduce::arms::arm8;
use kincal::measurement::Measurement;
use kincal::scene::Scene;

fn main() {
    divan::main();
}

/// A blind case with one effect (a backlash) on an arm of eight joints, read with 20 µm of noise.
fn readings(poses: usize) -> (Scene, Vec<Measurement>) {
    let quiet = challenge::Options::quiet(20e-6, poses, poses / 6);
    let options = challenge::Options { kinds: vec!["backlash".to_owned()], effects: [1, 1], ..quiet };
    let key = case::key(1);
    let public = case::public(&arm8().expect("a scene"), &options, &key, 0).expect("a case");
    let hidden = case::hidden(&public, &options, &key, 0);
    let (measurements, _) = case::measured(&public, &hidden, 0).expect("an arm that can be simulated");
    (public.file.scene, measurements)
}

fn options() -> Options {
    Options::new(NoiseSource::Declared)
}

/// The whole diagnosis. Marks: 1 s for 60 readings, 10 s for 600, on two cores.
#[divan::bench(args = [60, 600], sample_count = 10)]
fn whole(bencher: Bencher, poses: usize) {
    let (scene, measurements) = readings(poses);
    let rows: Vec<&Measurement> = measurements.iter().collect();
    bencher.bench_local(|| diagnose(&scene.arm, &scene.sensor, black_box(&rows), &options()).expect("a diagnosis"));
}

/// The evidence of all single effects, given the calibrated geometry. Mark: 20 ms for 60 readings.
#[divan::bench(args = [60, 600], sample_count = 20)]
fn single_effects(bencher: Bencher, poses: usize) {
    let (scene, measurements) = readings(poses);
    let rows: Vec<&Measurement> = measurements.iter().collect();
    let singles = Singles::new(&scene.arm, &scene.sensor, &rows, &options()).expect("a data set");
    bencher.bench_local(|| black_box(&singles).evidence());
}
