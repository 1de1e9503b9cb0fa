//! How much of an arm readings can tell: base and target alone, then joint zeros, then lengths, then the whole geometry, each judged by
//! readings that it was not fitted to.
//!
//! A rung is taken where it predicts better than the best below it by more than two standard errors of that.
//!
//! Every rung has priors of the size that the readings choose ([`super::prior`]). What decides is the error on readings that are left out,
//! fold by fold of different configurations: a rung that only fits noise is worse there than the one below.

use nalgebra::DVector;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::geometry::{Geometry, GeometryError, Readings, fit_roughly};
use super::prior::Sizes;
use crate::arm::Arm;
use crate::numerics::gram;
use crate::solver::robust;

/// Folds of configurations.
const FOLDS: usize = 10;
/// Standard errors by which a rung must predict better: a nominal arm seldom does by luck.
const BEYOND_CHANCE: f64 = 2.0;
/// What is let loose on a rung of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Freedom {
    /// Where the arm stands and where the target sits; the arm is nominal.
    BaseAndTarget,
    /// And the joints' zeros.
    Zeros,
    /// And the positions of the joints: link lengths and offsets.
    Lengths,
    /// And their directions: the whole geometry.
    Geometry,
}

impl Freedom {
    /// All, from the bottom up.
    pub const ALL: [Freedom; 4] = [Freedom::BaseAndTarget, Freedom::Zeros, Freedom::Lengths, Freedom::Geometry];

    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Freedom::BaseAndTarget => "base and target",
            Freedom::Zeros => "+ joint zeros",
            Freedom::Lengths => "+ link lengths",
            Freedom::Geometry => "+ twists: full geometry",
        }
    }

    /// `sizes` of what is let loose, nothing else.
    fn of(self, sizes: Sizes) -> Sizes {
        match self {
            Freedom::BaseAndTarget => Sizes::NOMINAL,
            Freedom::Zeros => Sizes { lengths: 0.0, turns: 0.0, ..sizes },
            Freedom::Lengths => Sizes { turns: 0.0, ..sizes },
            Freedom::Geometry => sizes,
        }
    }
}

/// A rung, and how good it is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rung {
    /// What is let loose.
    pub free: Freedom,
    /// RMS distance on readings that were left out, m.
    pub left_out_m: f64,
    /// RMS angle on readings that were left out, rad; absent where no orientation was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out_rad: Option<f64>,
    /// Whether it is the one that counts: the best on readings that were left out.
    pub chosen: bool,
}

/// The geometry of the best rung, and all rungs that were tried.
#[derive(Clone, Debug)]
pub struct Climbed {
    /// Fitted on the chosen rung.
    pub geometry: Geometry,
    /// From the bottom up.
    pub rungs: Vec<Rung>,
}

/// Climbs the ladder. `only`: the one rung that is tried, where somebody said so.
///
/// # Errors
/// If the readings cannot tell.
pub fn climb(arm: &Arm, readings: Readings<'_>, only: Option<Freedom>) -> Result<Climbed, GeometryError> {
    let loose = fit_roughly(arm, readings, Sizes::MANUFACTURING)?;
    let likeliest = loose.likeliest_sizes();
    // Rows that are far off for the whole geometry are for every part of it.
    let counts = loose.equations.counts();
    let good: Vec<bool> = (0..counts.len()).map(|row| loose.far.get(row).is_none_or(|far| *far >= robust::FAR)).collect();
    let mut tried: Vec<(Freedom, Geometry, LeftOut)> = Vec::new();
    for free in Freedom::ALL {
        if only.is_some_and(|only| only != free) {
            continue;
        }
        let mut geometry = loose.relaxed(arm, readings, free.of(likeliest))?;
        if free != Freedom::BaseAndTarget && free != Freedom::Geometry {
            let sizes = geometry.likeliest_sizes();
            if sizes != geometry.sizes() {
                geometry = geometry.relaxed(arm, readings, sizes)?;
            }
        }
        let left_out = left_out(&geometry, readings, &good);
        tried.push((free, geometry, left_out));
    }
    let best = highest(&tried.iter().map(|(_, _, left)| left.squares.as_slice()).collect::<Vec<_>>());
    let rung = |(at, (free, _, left)): (usize, &(Freedom, Geometry, LeftOut))| Rung {
        free: *free,
        left_out_m: left.position_m,
        left_out_rad: left.rotation_rad,
        chosen: at == best,
    };
    let rungs = tried.iter().enumerate().map(rung).collect();
    let taken = tried.swap_remove(best).1;
    Ok(Climbed { geometry: taken.refit(arm, readings, taken.sizes())?, rungs })
}

/// The rung up to which each is better than the best below it, by more than chance has it from row to row.
fn highest(rungs: &[&[f64]]) -> usize {
    let mut best = 0;
    for (at, squares) in rungs.iter().enumerate().skip(1) {
        let gains: Vec<f64> = rungs[best].iter().zip(*squares).map(|(before, after)| before - after).collect();
        let count = gains.len().max(1) as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        if mean > BEYOND_CHANCE * libm::sqrt(variance / count) {
            best = at;
        }
    }
    best
}

/// Errors on readings that were left out.
struct LeftOut {
    /// Mean square in declared sigmas of each row that counts.
    squares: Vec<f64>,
    position_m: f64,
    rotation_rad: Option<f64>,
}

/// Errors of `geometry` on readings of configurations that were left out, to first order about the fit of all: without fold k the parameters
/// change by `-(N - N_k + 1)^-1 J_k' r_k`.
fn left_out(geometry: &Geometry, readings: Readings<'_>, good: &[bool]) -> LeftOut {
    let (residual, jacobian) = geometry.counted();
    let mut normal = gram(&jacobian) + gram(&geometry.known().1);
    (0..normal.nrows()).for_each(|at| normal[(at, at)] += 1.0);
    let fold_of = folds(readings);
    let equations = &geometry.equations;
    let mut squares = Vec::new();
    let (mut of_position, mut of_rotation, mut rows) = (0.0, 0.0, 0_usize);
    for fold in 0..FOLDS {
        let own: Vec<usize> = (0..good.len()).filter(|row| fold_of[*row] == fold).collect();
        let of_fold: Vec<usize> = own.iter().flat_map(|row| equations.of(*row)).collect();
        let there = jacobian.select_rows(&of_fold);
        let without = &normal - gram(&there);
        let right = there.tr_mul(&residual.select_rows(&of_fold));
        let change = without.cholesky().map_or_else(|| DVector::zeros(right.len()), |factor| factor.solve(&right));
        let moved = geometry.jacobian.select_rows(&of_fold) * &change;
        let mut at = 0;
        for row in own {
            let first = at;
            at += equations.of(row).len();
            if !good[row] {
                continue;
            }
            rows += 1;
            let mut square = 0.0;
            for (place, equation) in equations.of(row).enumerate() {
                let left = geometry.residual[equation] + moved[first + place];
                square += (left / equations.sigmas()[equation].max(1e-9)).powi(2);
                let sum = if equations.component(equation) < 3 { &mut of_position } else { &mut of_rotation };
                *sum += left * left;
            }
            squares.push(square / equations.of(row).len().max(1) as f64);
        }
    }
    let rows = rows.max(1) as f64;
    LeftOut {
        squares,
        position_m: libm::sqrt(of_position / rows),
        rotation_rad: equations.has_orientation().then(|| libm::sqrt(of_rotation / rows)),
    }
}

/// A fold for each reading; those of one configuration are in one.
fn folds(readings: Readings<'_>) -> Vec<usize> {
    let mut known: std::collections::HashMap<Vec<u64>, usize> = std::collections::HashMap::new();
    let of = |row: &&crate::measurement::Measurement| -> usize {
        let key: Vec<u64> = row.joints.iter().map(|value| value.to_bits()).collect();
        let next = known.len() % FOLDS;
        *known.entry(key).or_insert(next)
    };
    readings.measurements.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::rotation_from_vector;
    use crate::measurement::{Measurement, Sensor};
    use crate::scene;
    use crate::seed::stream;
    use nalgebra::Vector3;

    /// What is said of left-out readings is what a fit without them leaves, to first order; the arm is off as machining leaves it.
    #[test]
    fn left_out_errors_are_those_of_fits_without_the_fold() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/arm8.toml");
        let arm = scene::read(path).unwrap().scene.arm;
        let mut draws = stream(1, "test/ladder");
        let values: Vec<f64> = arm.chain.nominal().iter().map(|value| value + 5e-4 * draws.normal()).collect();
        let chain = arm.chain.at(&values);
        let base = nalgebra::Isometry3::from_parts(
            Vector3::new(0.4, -0.2, 0.3).into(),
            rotation_from_vector(&Vector3::new(0.2, 0.5, -0.9)),
        );
        let rows: Vec<Measurement> = (0..50)
            .map(|index| {
                let joints: Vec<f64> = arm.chain.joints.iter().map(|of| draws.uniform(of.lower, of.upper)).collect();
                let at = (base * chain.forward(&joints)).translation.vector + Vector3::from_fn(|_, _| 1e-4 * draws.normal());
                Measurement { index, joints, position_m: at.into(), ..Measurement::default() }
            })
            .collect();
        let sensor = Sensor::uniform(1e-4, None);
        let fitted = |rows: &[&Measurement], from: Option<&Geometry>| {
            let weights = vec![1.0; rows.len()];
            let readings = Readings::new(&sensor, rows, &weights);
            let sizes = from.map_or(Sizes::MANUFACTURING, Geometry::sizes);
            let geometry = super::super::geometry::fit_at(&arm, readings, sizes).unwrap();
            let left = from.is_none().then(|| left_out(&geometry, readings, &[true; 50]));
            (geometry, left, folds(readings))
        };
        let all: Vec<&Measurement> = rows.iter().collect();
        let (whole, left, fold_of) = fitted(&all, None);
        let mut square = 0.0;
        for fold in 0..FOLDS {
            let (out, kept): (Vec<&Measurement>, Vec<&Measurement>) = rows.iter().partition(|row| fold_of[row.index] == fold);
            let without = fitted(&kept, Some(&whole)).0;
            square += out
                .iter()
                .map(|row| (row.position().coords - without.predict(row).translation.vector).norm_squared())
                .sum::<f64>();
        }
        let expected = (square / 50.0).sqrt();
        let found = left.unwrap().position_m;
        assert!((found / expected - 1.0).abs() < 0.05, "{found} against {expected}");
    }

    #[test]
    fn a_rung_is_taken_for_a_gain_beyond_its_standard_error() {
        let flat = [1.0; 8];
        let better = [0.5, 0.6, 0.4, 0.5, 0.6, 0.4, 0.5, 0.5];
        let luck = [0.1, 1.2, 0.9, 1.1, 1.0, 1.2, 0.6, 1.0];
        assert_eq!(highest(&[&flat, &better]), 1);
        assert_eq!(highest(&[&flat, &luck]), 0);
        assert_eq!(highest(&[&flat, &luck, &better, &flat]), 2);
        assert_eq!(highest(&[&flat]), 0);
    }
}
