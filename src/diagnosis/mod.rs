//! From measurements to causes: what geometry leaves, which effects explain it with what probability, how far that goes on poses
//! that were not used, what could not have been seen, and what remains unknown.
//!
//! Everything is linear about the fitted geometry, so that inner products ([`gram`]) suffice for evidence ([`evidence`]), search
//! ([`search`]) and cross-validation ([`held_out`]).

pub mod conditions;
pub mod evidence;
pub mod gram;
pub mod held_out;
pub mod open_set;
pub mod outcome;
pub mod outliers;
pub mod power;
pub mod rows;
pub mod search;
#[cfg(test)]
mod tests;
mod verdict;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::arm::Arm;
use crate::effects::signature::library::{Hypothesis, library};
use crate::effects::signature::shape::Shape;
use crate::effects::{Kind, Location};
use crate::measurement::{Measurement, Sensor};
use conditions::Conditions;
use evidence::{Candidates, NoisePrior};
use gram::{Gram, Surviving};
use outcome::{Diagnosis, NoiseSource};
use rows::{DiagnosisError, Rows};

/// Folds of the cross-validation.
pub const FOLDS: usize = 5;
/// Prior odds of one effect more.
const ODDS: f64 = 0.5;
/// Rounds of weighting outliers down.
const PASSES: usize = 4;
/// Share of the prior of shapes without a name.
const NAMELESS: f64 = 0.25;
/// λ at the upper end of the realistic range below which a hypothesis has no information in the data.
const NO_INFORMATION: f64 = 4.0;

/// How to diagnose.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Where the sensor's declared noise comes from.
    pub noise: NoiseSource,
    /// Kinds that are left out of the library.
    pub without: Vec<Kind>,
    /// Nothing but these kinds at these places, for who knows what is there.
    pub only: Option<Vec<(Kind, Location)>>,
}

/// What was found, before it is put into words.
pub(crate) struct Analysis<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) conditions: &'a Conditions,
    pub(crate) candidates: &'a Candidates,
    pub(crate) surviving: &'a Surviving,
    pub(crate) noise: NoisePrior,
    pub(crate) found: search::Found,
    pub(crate) folds: Vec<held_out::Fold>,
    pub(crate) structure: open_set::Structure,
    pub(crate) outliers: outliers::Outliers,
    pub(crate) maps: Vec<outcome::Map>,
    pub(crate) measurements: &'a [&'a Measurement],
    pub(crate) sensor: &'a Sensor,
    pub(crate) repeats: Option<Repeats>,
    pub(crate) options: &'a Options,
}

/// Noise from repeats.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeats {
    /// One sigma per axis, m.
    pub(crate) position_m: f64,
    /// Degrees of freedom.
    pub(crate) freedom: f64,
}

/// Diagnoses `measurements` of `arm`, read by `sensor`.
///
/// # Errors
/// If the measurements cannot tell where the arm stands, or are not this robot's.
pub fn diagnose(
    arm: &Arm,
    sensor: &Sensor,
    measurements: &[&Measurement],
    options: &Options,
) -> Result<Diagnosis, DiagnosisError> {
    let total = measurements.len();
    let rows = rows::fit(arm, sensor, measurements, &vec![1.0; total])?;
    let conditions = conditions::conditions(measurements, &rows);
    let hypotheses: Vec<Hypothesis> = library(&rows.mechanism, &conditions.columns)
        .into_iter()
        .filter(|hypothesis| hypothesis.kind.is_none_or(|kind| !options.without.contains(&kind)))
        .filter(|hypothesis| {
            let is = |(kind, place): &(Kind, Location)| hypothesis.kind == Some(*kind) && hypothesis.location == *place;
            options.only.as_ref().is_none_or(|only| only.iter().any(is))
        })
        .collect();
    let repeats = repeats(measurements);
    let noise = match (repeats, options.noise) {
        (Some(repeats), _) => {
            let declared = mean_sigma(sensor, measurements);
            NoisePrior {
                freedom: repeats.freedom.min(20.0),
                level: (repeats.position_m / declared) * (repeats.position_m / declared),
            }
        }
        (None, NoiseSource::Assumed) => NoisePrior { freedom: 1.0, level: 1.0 },
        (None, _) => NoisePrior { freedom: 10.0, level: 1.0 },
    };
    let (raw, mut candidates) = matrix(&rows, &conditions, hypotheses);
    let geometry = rows.jacobian.ncols();
    let offset = DVector::from_fn(geometry, |column, _| if rows.free[column] { 0.0 } else { rows.parameters[column] });
    let fold = held_out::regions(&rows.targets, FOLDS.min(total / 4).max(2));
    let folds = fold.iter().max().map_or(1, |most| most + 1);

    let all = vec![true; geometry];
    let mut weights = vec![1.0; total];
    let mut result = None;
    // Readings that are far off from the best model are weighted down, until it stays the same.
    for pass in 0..PASSES {
        let mut whitening = rows.whitening.clone();
        for (row, weight) in weights.iter().enumerate() {
            whitening.rows_mut(row * rows.per_row, rows.per_row).scale_mut(libm::sqrt(*weight));
        }
        let grams = blocks(&raw, &whitening, &fold, folds, rows.per_row, geometry);
        let Some(mut surviving) = held_out::sum(&grams).surviving(&all, &offset) else {
            return Err(DiagnosisError::Degenerate);
        };
        // A row that counts half is half an equation.
        let lost = rows.per_row as f64 * weights.iter().map(|weight| 1.0 - weight).sum::<f64>();
        surviving.freedom = (surviving.freedom - lost).max(1.0);
        weigh(&mut candidates, &surviving);
        let found = search::search(&surviving, &candidates, noise, search::MOST);
        let residual = residual(&raw, &surviving, &candidates, noise, &found.best.members, geometry);
        let squares: Vec<f64> = (0..total)
            .map(|row| {
                let (first, count) = (row * rows.per_row, rows.per_row);
                residual.rows(first, count).component_mul(&rows.whitening.rows(first, count)).norm_squared()
            })
            .collect();
        let next = outliers::weights(&squares, rows.per_row);
        let same = next.iter().zip(&weights).all(|(a, b)| (a - b).abs() < 1e-3);
        let last = pass + 1 == PASSES || same;
        if last {
            result = Some((grams, whitening, surviving, found, residual, squares));
            break;
        }
        weights = next;
    }
    let Some((grams, whitening, surviving, found, residual, squares)) = result else {
        return Err(DiagnosisError::Degenerate);
    };
    let outliers = outliers::look(&squares, rows.per_row, surviving.freedom / surviving_equations(&rows));
    let good: Vec<bool> = (0..total).map(|row| !outliers.rows.contains(&row)).collect();
    let problem = held_out::Problem {
        raw: &raw,
        whitening: &whitening,
        per_row: rows.per_row,
        geometry,
        offset: &offset,
        free: &rows.free,
        fold: &fold,
        good: &good,
    };
    let folds = held_out::cross_validate(&problem, &grams, &candidates, noise, search::MOST);
    let position = |weighted: bool| -> Vec<Vector3<f64>> {
        (0..total)
            .map(|row| {
                let first = row * rows.per_row;
                let weight = if weighted { libm::sqrt(weights[row]) * rows.whitening[first] } else { 1.0 };
                Vector3::from(residual.fixed_rows::<3>(first)) * weight
            })
            .collect()
    };
    let structure = open_set::structure(&conditions, &position(true));
    let maps = open_set::maps(&conditions, &position(false));
    let analysis = Analysis {
        rows: &rows,
        conditions: &conditions,
        candidates: &candidates,
        surviving: &surviving,
        noise,
        found,
        folds,
        structure,
        outliers,
        maps,
        measurements,
        sensor,
        repeats,
        options,
    };
    Ok(verdict::put(&analysis))
}

fn surviving_equations(rows: &Rows) -> f64 {
    rows.residual.len() as f64
}

/// Mean sigma of a position, m.
fn mean_sigma(sensor: &Sensor, measurements: &[&Measurement]) -> f64 {
    let sum: f64 = measurements.iter().map(|row| sensor.position_sigma_at(&row.position().coords)).sum();
    (sum / measurements.len().max(1) as f64).max(1e-9)
}

/// `[geometry | signatures | residual]`, m and rad, and the hypotheses that its columns stand for.
fn matrix(rows: &Rows, conditions: &Conditions, hypotheses: Vec<Hypothesis>) -> (DMatrix<f64>, Candidates) {
    let geometry = rows.jacobian.ncols();
    let mut first = Vec::new();
    let mut columns = 0;
    for hypothesis in &hypotheses {
        first.push(columns);
        columns += hypothesis.spread.len();
    }
    let mut raw = DMatrix::zeros(rows.residual.len(), geometry + columns + 1);
    raw.columns_mut(0, geometry).copy_from(&rows.jacobian);
    raw.set_column(geometry + columns, &rows.residual);
    let unit: Vec<f64> = hypotheses.iter().map(|hypothesis| libm::sqrt(hypothesis.range[0] * hypothesis.range[1])).collect();
    let attitude = rows.per_row == 6;
    for (row, reading) in conditions.readings.iter().enumerate() {
        for (number, hypothesis) in hypotheses.iter().enumerate() {
            for (at, column) in hypothesis.shape.columns(reading, attitude).iter().enumerate() {
                let factor = unit[number] * hypothesis.spread[at];
                for equation in 0..rows.per_row {
                    raw[(row * rows.per_row + equation, geometry + first[number] + at)] = column[equation] * factor;
                }
            }
        }
    }
    let count = hypotheses.len();
    (raw, Candidates { hypotheses, first, unit, log_odds: vec![0.0; count], active: vec![true; count] })
}

/// Inner products fold by fold.
fn blocks(
    raw: &DMatrix<f64>,
    whitening: &DVector<f64>,
    fold: &[usize],
    folds: usize,
    per_row: usize,
    geometry: usize,
) -> Vec<Gram> {
    use rayon::prelude::*;
    (0..folds)
        .into_par_iter()
        .map(|number| {
            let equations: Vec<usize> =
                (0..fold.len()).filter(|row| fold[*row] == number).flat_map(|row| row * per_row..(row + 1) * per_row).collect();
            let mut block = raw.select_rows(&equations);
            for (at, equation) in equations.iter().enumerate() {
                block.row_mut(at).scale_mut(whitening[*equation]);
            }
            Gram::new(&block, geometry)
        })
        .collect()
}

/// A class of hypotheses that share one prior.
fn class(hypothesis: &Hypothesis) -> (Option<Kind>, u8) {
    let shape = match hypothesis.shape {
        _ if hypothesis.kind.is_some() => 0,
        Shape::Harmonic(..) => 1,
        Shape::Bump { .. } => 2,
        Shape::Crosstalk { .. } => 3,
        Shape::Softening(_) | Shape::Hardening(_) => 4,
        Shape::TorqueMemory(..) => 5,
        Shape::DirectionLoad(_) => 6,
        Shape::Memory(..) => 7,
        Shape::AllYield => 8,
        Shape::AngleCurve(_) => 10,
        _ => 9,
    };
    (hypothesis.kind, shape)
}

/// Which hypotheses have information, and their prior odds: equal for all kinds, for all places of a kind, for all variants at a
/// place; shapes without a name share a part.
fn weigh(candidates: &mut Candidates, surviving: &Surviving) {
    let count = candidates.hypotheses.len();
    for number in 0..count {
        let information: f64 = candidates.columns(number).map(|column| surviving.products[(column, column)]).sum();
        let largest = candidates.hypotheses[number].range[1] / candidates.unit[number];
        candidates.active[number] = information * largest * largest >= NO_INFORMATION;
    }
    let active: Vec<usize> = (0..count).filter(|number| candidates.active[*number]).collect();
    let hypotheses = &candidates.hypotheses;
    let distinct = |keys: Vec<(Option<Kind>, u8, Option<usize>)>| {
        let mut keys = keys;
        keys.sort_unstable();
        keys.dedup();
        keys.len().max(1) as f64
    };
    let key = |number: usize| {
        let (kind, shape) = class(&hypotheses[number]);
        (kind, shape, hypotheses[number].location.index)
    };
    let mut log_odds = vec![f64::NEG_INFINITY; count];
    for number in &active {
        let (kind, shape, _) = key(*number);
        let classes = distinct(
            active
                .iter()
                .map(|other| key(*other))
                .filter(|other| other.0.is_some() == kind.is_some())
                .map(|other| (other.0, other.1, None))
                .collect(),
        );
        let places =
            distinct(active.iter().map(|other| key(*other)).filter(|other| (other.0, other.1) == (kind, shape)).collect());
        let variants = active.iter().filter(|other| key(**other) == key(*number)).count() as f64;
        let share = if kind.is_some() { 1.0 - NAMELESS } else { NAMELESS };
        log_odds[*number] = libm::log(ODDS * share / (classes * places * variants));
    }
    candidates.log_odds = log_odds;
}

/// What geometry and `members` together leave, m and rad.
fn residual(
    raw: &DMatrix<f64>,
    surviving: &Surviving,
    candidates: &Candidates,
    noise: NoisePrior,
    members: &[(usize, usize)],
    geometry: usize,
) -> DVector<f64> {
    let last = raw.ncols() - 1;
    let mut coefficients = DVector::zeros(last - geometry);
    if let Some(fit) = evidence::fit(surviving, candidates, noise, members) {
        for (column, value) in fit.columns.iter().zip(fit.coefficients.iter()) {
            coefficients[*column] = *value;
        }
    }
    let change = surviving.absorbed.column(last - geometry) - surviving.absorbed.columns(0, last - geometry) * &coefficients;
    raw.column(last) - raw.columns(0, geometry) * change - raw.columns(geometry, last - geometry) * coefficients
}

/// Noise from readings of the same configuration, approached and loaded alike.
fn repeats(measurements: &[&Measurement]) -> Option<Repeats> {
    let mut used = vec![false; measurements.len()];
    let (mut squares, mut freedom) = (Vec::new(), 0.0);
    for first in 0..measurements.len() {
        if used[first] {
            continue;
        }
        let a = measurements[first];
        let alike = |b: &Measurement| {
            a.pose_id == b.pose_id
                && a.joints == b.joints
                && a.approach == b.approach
                && a.payload_kg == b.payload_kg
                && a.target == b.target
        };
        let group: Vec<usize> = (first..measurements.len()).filter(|row| alike(measurements[*row])).collect();
        for row in &group {
            used[*row] = true;
        }
        if group.len() < 2 {
            continue;
        }
        let points: Vec<Vector3<f64>> = group.iter().map(|row| measurements[*row].position().coords).collect();
        let centre = conditions::centre(&points);
        squares.extend(points.iter().map(|point| (point - centre).norm_squared()));
        freedom += 3.0 * (group.len() - 1) as f64;
    }
    let sum: f64 = squares.iter().sum();
    (freedom >= 9.0 && sum > 0.0).then(|| Repeats { position_m: libm::sqrt(sum / freedom), freedom })
}
