//! The analyser's signatures against what physics makes of the same effect: they are derived apart, and must agree.

use nalgebra::{DMatrix, DVector};

use super::challenge::{Options, case};
use super::detectability::{difference, has_signal, noiseless};
use super::injection::places;
use crate::diagnosis::conditions::conditions;
use crate::diagnosis::deflection::Loads;
use crate::diagnosis::rows::{Readings, fit};
use crate::diagnosis::settings::Model;
use crate::effects::signature::library::library;
use crate::effects::signature::posture::Mechanism;
use crate::effects::{Kind, Need};
use crate::lab::reproduce::arms::arm8;
use crate::seed::stream;
use crate::simulation::effect::Effect;
use crate::simulation::injected::{Injected, Noise};

#[test]
fn every_signature_is_what_physics_makes() {
    let elsewhere = |kind: &Kind| needs_moves(*kind) || *kind == Kind::JointAngleMap;
    check(&Options::quiet(20e-6, 60, 0), Kind::known().filter(|kind| !elsewhere(kind)));
}

/// Over moves straight from reading to reading.
#[test]
fn so_is_that_of_what_follows_moves() {
    check(&Options { direct: true, ..Options::quiet(20e-6, 60, 0) }, Kind::known().filter(|kind| needs_moves(*kind)));
}

/// Over angles that lie dense enough.
#[test]
fn so_is_that_of_a_map() {
    check(&Options::quiet(20e-6, 150, 0), std::iter::once(Kind::JointAngleMap));
}

fn needs_moves(kind: Kind) -> bool {
    kind.descriptor().needs.contains(&Need::Moves)
}

fn check(options: &Options, kinds: impl Iterator<Item = Kind>) {
    let public = case::public(&arm8().unwrap(), options, &case::key(5), 0).unwrap();
    let scene = &public.file.scene;
    let hidden = case::hidden(&public, options, &case::key(5), 0).injected;
    let nothing = Injected { effects: Vec::new(), length_error_m: 0.0, angle_error_rad: 0.0, noise: Noise::Off, ..hidden };
    let mut wrong = Vec::new();
    let plain = noiseless(scene, &nothing, &public.planned).unwrap();
    let (measurements, _) = crate::simulation::cell::measure(
        &scene.cell(),
        &nothing,
        &public.planned,
        public.planned.len(),
        &mut crate::progress::Silent,
    )
    .unwrap();
    let rows: Vec<_> = measurements.iter().collect();
    let fitted = fit(
        &scene.arm,
        Readings { sensor: &scene.sensor, measurements: &rows, weights: &vec![1.0; rows.len()], displacement: &[], scatter: &[] },
    )
    .unwrap();
    let known = conditions(&rows, &fitted, &[], Loads::AsItStands, None, &Model::default()).0;
    let library = library(&Mechanism::new(&scene.arm), &known.columns);
    for one in &library {
        let orientation = known.columns.orientation;
        let widths = [one.spread.len(), one.shape.columns(&known.readings[0], orientation).len()];
        assert_eq!(widths, [one.shape.width(orientation); 2], "{one:?}");
        assert!(one.kind.is_some() || one.shape.unnamed().is_some(), "{one:?} has neither a name nor a family");
        assert!(one.shape.magnitude_width() <= widths[0]);
    }
    for kind in kinds {
        for place in places(kind, &scene.arm) {
            let magnitude = kind.range(place, scene.arm.joint_count())[1];
            let effect = Effect::drawn(kind, place, magnitude, &scene.arm, &mut stream(4, kind.name()));
            if !has_signal(&effect) {
                continue;
            }
            let with = noiseless(scene, &Injected { effects: vec![effect.clone()], ..nothing.clone() }, &public.planned).unwrap();
            let made = difference(&with, &plain);
            let moved = DVector::from_iterator(3 * made.len(), made.iter().flat_map(|row| row[..3].to_vec()));
            let size = moved.norm().max(1e-12);
            // The best of the variants of this kind at this place.
            let best = library
                .iter()
                .filter(|one| one.kind == Some(kind) && one.location == effect.location())
                .map(|one| {
                    let width = one.spread.len();
                    // Where the base stands is fitted, too.
                    let mut matrix =
                        DMatrix::from_fn(moved.len(), width + 3, |row, column| f64::from(u8::from(row % 3 + width == column)));
                    for (row, reading) in known.readings.iter().enumerate() {
                        for (column, value) in one.shape.columns(reading, false).iter().enumerate() {
                            for axis in 0..3 {
                                matrix[(3 * row + axis, column)] = value[axis];
                            }
                        }
                    }
                    let solved = matrix.clone().svd(true, true).solve(&moved, 1e-12).unwrap();
                    (&moved - matrix * &solved).norm() / size
                })
                .min_by(f64::total_cmp);
            let Some(left) = best else {
                panic!("{kind:?} {place:?} is not in the library");
            };
            if left > kind.descriptor().known.unwrap().misses.fitted && size > 1e-6 {
                wrong.push(format!("{kind:?} {place:?}: {:.2} % of the displacement is not in the signature", 100.0 * left));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
