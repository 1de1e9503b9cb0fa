//! From measurements to causes: what geometry leaves, which effects explain it with what probability, how far that goes on poses
//! that were not used, what could not have been seen, and what remains unknown.
//!
//! Everything is linear about the fitted geometry, so that inner products ([`gram`]) suffice for evidence ([`evidence`]), search
//! ([`search`]) and cross-validation ([`held_out`]).

mod advice;
mod candidates;
mod claims;
pub mod conditions;
mod confusion;
mod detectability;
pub mod evidence;
mod gap;
pub mod gram;
pub mod groups;
pub mod held_out;
mod magnitude;
pub mod mistake;
mod naming;
mod notes;
pub mod open_set;
pub mod outcome;
pub mod outliers;
mod parameters;
pub mod power;
mod ripple;
pub mod rows;
pub mod scatter;
pub mod search;
mod sentence;
#[cfg(test)]
pub(crate) mod tests;
mod unknown;
mod verdict;
pub mod waterfall;
mod weights;
pub mod whitening;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::arm::Arm;
use crate::effects::signature::library::{Hypothesis, library, ripple};
use crate::effects::signature::shape::Displacement;
use crate::effects::{Kind, Location};
use crate::measurement::{Measurement, Sensor};
use candidates::{matrix, weigh};
use conditions::Conditions;
use evidence::{Candidates, NoisePrior};
use gram::Surviving;
use groups::Repeats;
use held_out::{Block, Problem};
use outcome::{Diagnosis, NoiseSource};
use ripple::Ripple;
use rows::{DiagnosisError, Readings, Rows};
use scatter::Scatter;

/// Folds of the cross-validation.
pub const FOLDS: usize = 5;
/// Rounds of fitting around what was found.
const PASSES: usize = 5;
/// Times that what was found is looked through for joints that do not repeat.
const LOOKS: usize = 3;
/// Degrees of freedom of what repeats without a move tell of the noise.
const UNMOVED: f64 = 4.0;
/// Correlation of what is left of readings of one configuration from which on it is the configuration's.
const ALIKE: f64 = 0.9;
/// Held-out RMS with joints that do not repeat, over that without, from which on there are none.
const WORSE: f64 = 1.03;

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

impl Options {
    /// The whole library.
    #[must_use]
    pub fn new(noise: NoiseSource) -> Options {
        Options { noise, without: Vec::new(), only: None }
    }

    /// What is looked for.
    fn hypotheses(&self, rows: &Rows, conditions: &Conditions, ripples: &[Ripple]) -> Vec<Hypothesis> {
        let wanted = |hypothesis: &Hypothesis| {
            let is = |(kind, place): &(Kind, Location)| hypothesis.kind == Some(*kind) && hypothesis.location == *place;
            hypothesis.kind.is_none_or(|kind| !self.without.contains(&kind))
                && self.only.as_ref().is_none_or(|only| only.iter().any(is))
        };
        let nameless = self.without.contains(&Kind::StrainWaveError);
        let scanned = ripples.iter().map(|found| ripple(found.joint, found.waves, nameless));
        library(&rows.mechanism, &conditions.columns).into_iter().chain(scanned).filter(wanted).collect()
    }
}

/// What a pass of the diagnosis is made around.
#[derive(Clone)]
struct Around {
    /// Weight of each row for being far off.
    far: Vec<f64>,
    /// Weight of each row for being like others of its configuration.
    dependent: Vec<f64>,
    /// What the effects found so far do.
    displacement: Vec<Displacement>,
    /// The best set so far, sorted.
    members: Vec<(usize, usize)>,
    /// Ripples that scans have added to the library.
    ripples: Vec<Ripple>,
    /// Joints that do not repeat.
    scatter: Vec<Scatter>,
    /// Noise of the orientations over what is said of it, beside that of the positions.
    orientation: f64,
}

impl Around {
    /// Nothing found, all of `rows` rows good.
    fn nominal(rows: usize) -> Around {
        Around {
            far: vec![1.0; rows],
            dependent: vec![1.0; rows],
            displacement: Vec::new(),
            members: Vec::new(),
            ripples: Vec::new(),
            scatter: Vec::new(),
            orientation: 1.0,
        }
    }

    /// Around what a pass found.
    fn next(self, weighed: weights::Weighed, displacement: Vec<Displacement>, members: Vec<(usize, usize)>) -> Around {
        Around { far: weighed.far, dependent: weighed.dependent, displacement, members, ..self }
    }

    /// Whether a pass found what it was made around.
    fn is_settled(&self, weighed: &weights::Weighed, members: &[(usize, usize)]) -> bool {
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-2);
        same(&weighed.far, &self.far) && same(&weighed.dependent, &self.dependent) && *members == self.members
    }
}

/// What was found, before it is put into words.
pub(crate) struct Analysis<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) conditions: &'a Conditions,
    pub(crate) candidates: &'a Candidates,
    pub(crate) surviving: &'a Surviving,
    pub(crate) noise: NoisePrior,
    pub(crate) found: search::Found,
    pub(crate) held_out: Vec<held_out::HeldOut>,
    pub(crate) structure: open_set::Structure,
    pub(crate) outliers: outliers::Outliers,
    /// Joints that do not repeat.
    pub(crate) scatter: Vec<Scatter>,
    /// Noise of the orientations over what was said of it.
    pub(crate) orientation: f64,
    pub(crate) maps: Vec<outcome::Map>,
    pub(crate) residuals: Vec<outcome::Residual>,
    /// Of each row, which member of the best set moves it most.
    pub(crate) moved: Vec<Option<usize>>,
    pub(crate) measurements: &'a [&'a Measurement],
    pub(crate) sensor: &'a Sensor,
    pub(crate) repeats: Option<Repeats>,
    /// Correlation of residuals of the same configuration, where there are any.
    pub(crate) correlation: Option<f64>,
    pub(crate) options: &'a Options,
}

impl Analysis<'_> {
    /// One sigma of a position about an axis, as it is said of the sensor, m.
    fn sigma_m(&self) -> f64 {
        self.sensor.mean_position_sigma(self.measurements.iter().copied())
    }
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
    let groups = groups::groups(measurements);
    let repeats = groups::repeats(measurements, &groups);
    let sigma_m = sensor.mean_position_sigma(measurements.iter().copied());
    let noise = noise_prior(repeats, sigma_m, options.noise);
    let by_repeats = weights::orientation_of_repeats(sensor, repeats, sigma_m);
    let mut around = Around { orientation: by_repeats.unwrap_or(1.0), ..Around::nominal(total) };
    let (mut last, mut looks) = (PASSES - 1, 0);
    let mut plain = None;
    // Around the arm as it is with the effects found so far, until nothing changes: signatures are those of the fitted arm, readings
    // that are far off from the best model or that repeat others are weighted down, and geometry and effects are fitted together.
    for pass in 0.. {
        let weights: Vec<f64> = around.dependent.iter().zip(&around.far).map(|(a, b)| a * b).collect();
        let (displacement, scatter) = (&around.displacement, &around.scatter);
        let orientation_sigma_rad = sensor.orientation_sigma_rad.map(|sigma| sigma * around.orientation);
        let sensor = &Sensor { orientation_sigma_rad, ..sensor.clone() };
        let rows = rows::fit(arm, Readings { sensor, measurements, weights: &weights, displacement, scatter })?;
        let conditions = conditions::conditions(measurements, &rows);
        let hypotheses = options.hypotheses(&rows, &conditions, &around.ripples);
        let (mut raw, mut candidates) = matrix(&rows, &conditions, hypotheses);
        put_back(&mut raw, &rows, displacement);
        let problem = Problem::new(&rows, raw);
        let schemes = held_out::schemes(measurements, &rows.targets, &groups);
        let grams = problem.grams(&schemes[0]);
        let Some(surviving) = held_out::sum(&grams).surviving(&problem.offset) else {
            return Err(DiagnosisError::Degenerate);
        };
        weigh(&mut candidates, &surviving);
        let found = search::search(&surviving, &candidates, noise, search::MOST);
        let coefficients = evidence::coefficients(&surviving, &candidates, noise, &found.best.members);
        let residual = problem.left(&surviving, &coefficients);
        let weighed = weights::weigh(&rows, &residual, &weights, &groups);
        let may_tell = pass < last && scatter.is_empty() && by_repeats.is_none();
        let ratio = weights::orientation_over_position(&rows, &residual, around.orientation != 1.0).filter(|_| may_tell);
        let mut members: Vec<(usize, usize)> = found.best.members.clone();
        members.sort_unstable();
        let settled = around.is_settled(&weighed, &members);
        let more = if pass < last {
            let level = evidence::noise_level(&surviving, &candidates, noise, &found.best.members);
            ripple::scan(&problem, &conditions.readings, &residual, level, &candidates)
        } else {
            Vec::new()
        };
        if pass < last && (!settled || !more.is_empty() || ratio.is_some()) {
            let displacement = displaced(&problem, &rows, &coefficients);
            around = around.next(weighed, displacement, members);
            around.ripples.extend(more);
            around.orientation *= ratio.unwrap_or(1.0);
            continue;
        }
        let mut outliers = outliers::look(&weighed.squares, rows.per_row);
        // What play makes of a reading whose side nobody knows says nothing about the sensor.
        let seated = |row: &usize| {
            !members.iter().any(|(member, _)| candidates.hypotheses[*member].shape.undecided(&conditions.readings[*row]))
        };
        let sure: Vec<f64> = (0..total).filter(seated).map(|row| weighed.squares[row]).collect();
        if sure.len() < total && 2 * sure.len() >= total {
            let far_off = std::mem::take(&mut outliers.rows);
            outliers = outliers::Outliers { rows: far_off, ..outliers::look(&sure, rows.per_row) };
        }
        let good: Vec<bool> = (0..total).map(|row| !outliers.rows.contains(&row)).collect();
        let validate = |scheme: &held_out::Scheme, good: &[bool]| {
            let own = (scheme.by != Block::Region).then(|| problem.grams(scheme));
            let grams = own.as_ref().unwrap_or(&grams);
            held_out::cross_validate(&problem, scheme, good, grams, &candidates, noise, search::MOST)
        };
        // Then, whether a joint does not repeat: its errors are no evidence of anything else. An error that comes again with the
        // configuration is no scatter.
        let comes_again = repeats.is_some_and(|repeats| repeats.moved) && weighed.correlation > ALIKE;
        let may_scatter = looks < LOOKS && options.only.is_none() && !comes_again;
        // Repeats between which the arm moved have the scatter in them.
        let of_sensor = NoisePrior { degrees_of_freedom: noise.degrees_of_freedom.min(UNMOVED), ..noise };
        let looked = may_scatter
            .then(|| scatter::look(&rows, &problem, &surviving, &candidates, of_sensor, &found, !around.scatter.is_empty()));
        if let Some(scatter) = looked.filter(|scatter| !scatter::alike(scatter, &around.scatter)) {
            if around.scatter.is_empty() && plain.is_none() {
                // Ripples were chosen with the readings that a fold leaves out: they seem to help there.
                let mut others = candidates.clone();
                for (active, of) in others.active.iter_mut().zip(&others.hypotheses) {
                    *active &= !scatter::is_contested(of);
                }
                let without =
                    held_out::cross_validate(&problem, &schemes[0], &good, &grams, &others, noise, search::MOST).explained();
                plain = Some((without, good, around.clone()));
            }
            let displacement = displaced(&problem, &rows, &coefficients);
            around = Around { scatter, ..around.next(weighed, displacement, members) };
            (last, looks) = (pass + PASSES, looks + 1);
            continue;
        }
        // Scatter has no order: where readings that were not used are predicted worse with it, it took the place of one that there is.
        if let Some((left, good, without)) = plain.take_if(|_| !around.scatter.is_empty())
            && validate(&schemes[0], &good).explained() > WORSE * WORSE * left
        {
            around = without;
            (last, looks) = (pass + 1, LOOKS);
            continue;
        }
        let held_out: Vec<held_out::HeldOut> = schemes.iter().map(|scheme| validate(scheme, &good)).collect();
        let positions = |of: &DVector<f64>| -> Vec<Vector3<f64>> {
            (0..total).map(|row| Vector3::from(of.fixed_rows::<3>(row * rows.per_row))).collect()
        };
        let moved = moved_most(&problem, &surviving, &candidates, &coefficients, &found.best.members);
        let geometry_alone = problem.left(&surviving, &DVector::zeros(coefficients.len()));
        let residuals = residuals(&rows, measurements, &geometry_alone, &residual);
        let structure =
            open_set::structure(&conditions, &positions(&problem.whitening.of_vector(&residual)), &groups.alike(measurements));
        let maps = open_set::maps(&conditions, &positions(&residual));
        let analysis = Analysis {
            rows: &rows,
            conditions: &conditions,
            candidates: &candidates,
            surviving: &surviving,
            noise,
            found,
            held_out,
            structure,
            outliers,
            scatter: around.scatter,
            orientation: around.orientation,
            maps,
            residuals,
            moved,
            measurements,
            sensor,
            repeats,
            correlation: (groups.rows.len() < total).then_some(weighed.correlation),
            options,
        };
        return Ok(verdict::put(&analysis));
    }
    unreachable!("the loop ends by returning")
}

/// A data set around its calibrated geometry, ready for the evidence of single effects.
pub struct Singles {
    /// Whitened `[geometry | signatures | residual]`.
    whitened: DMatrix<f64>,
    problem: Problem,
    candidates: Candidates,
    noise: NoisePrior,
}

impl Singles {
    /// Prepares `measurements` as [`diagnose`] does in its first pass.
    ///
    /// # Errors
    /// As [`diagnose`].
    pub fn new(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement], options: &Options) -> Result<Singles, DiagnosisError> {
        let weights = vec![1.0; measurements.len()];
        let rows = rows::fit(arm, Readings { sensor, measurements, weights: &weights, displacement: &[], scatter: &[] })?;
        let conditions = conditions::conditions(measurements, &rows);
        let hypotheses = options.hypotheses(&rows, &conditions, &[]);
        let (raw, candidates) = matrix(&rows, &conditions, hypotheses);
        let groups = groups::groups(measurements);
        let noise = noise_prior(
            groups::repeats(measurements, &groups),
            sensor.mean_position_sigma(measurements.iter().copied()),
            options.noise,
        );
        Ok(Singles { whitened: rows.whitening.of(&raw), problem: Problem::new(&rows, raw), candidates, noise })
    }

    /// The evidence of every hypothesis alone, at every scale of its prior: geometry taken out, marginal likelihoods. Signatures are
    /// not multiplied with those of other hypotheses, which only sets of effects need.
    #[must_use]
    pub fn evidence(&self) -> Vec<evidence::Model> {
        let blocks = (0..self.candidates.hypotheses.len()).map(|hypothesis| self.candidates.columns(hypothesis));
        let Some(surviving) = Surviving::of_blocks(&self.whitened, self.problem.geometry, &self.problem.offset, blocks) else {
            return Vec::new();
        };
        let mut candidates = self.candidates.clone();
        weigh(&mut candidates, &surviving);
        evidence::extensions(&surviving, &candidates, self.noise, &[])
    }
}

/// What is known of the noise: from repeats where there are any, else what is said.
fn noise_prior(repeats: Option<Repeats>, declared_m: f64, source: NoiseSource) -> NoisePrior {
    match (repeats, source) {
        (Some(repeats), _) => {
            let level = (repeats.position_m / declared_m) * (repeats.position_m / declared_m);
            // Without a move between them they say little about the arm.
            NoisePrior { degrees_of_freedom: repeats.degrees_of_freedom.min(if repeats.moved { 20.0 } else { UNMOVED }), level }
        }
        (None, NoiseSource::Assumed) => NoisePrior { degrees_of_freedom: 1.0, level: 1.0 },
        (None, _) => NoisePrior { degrees_of_freedom: 10.0, level: 1.0 },
    }
}

/// What the effects do to each row, in root.
fn displaced(problem: &Problem, rows: &Rows, coefficients: &DVector<f64>) -> Vec<Displacement> {
    let made = problem.signatures() * coefficients;
    made.as_slice().chunks(rows.per_row).map(|row| std::array::from_fn(|at| row.get(at).copied().unwrap_or(0.0))).collect()
}

/// Of each row, which of `members` moves it most beyond what geometry absorbs.
fn moved_most(
    problem: &Problem,
    surviving: &Surviving,
    candidates: &Candidates,
    coefficients: &DVector<f64>,
    members: &[(usize, usize)],
) -> Vec<Option<usize>> {
    let seen: Vec<DVector<f64>> = members
        .iter()
        .map(|(hypothesis, _)| {
            let columns = candidates.columns(*hypothesis);
            let of = coefficients.rows(columns.start, columns.len());
            let absorbed = surviving.absorbed.columns(columns.start, columns.len()) * of;
            problem.signatures().columns(columns.start, columns.len()) * of - problem.raw.columns(0, problem.geometry) * absorbed
        })
        .collect();
    (0..problem.raw.nrows() / problem.per_row)
        .map(|row| {
            let size = |member: &usize| seen[*member].fixed_rows::<3>(row * problem.per_row).norm_squared();
            (0..members.len()).max_by(|a, b| size(a).total_cmp(&size(b)))
        })
        .collect()
}

/// What is left of each reading, in the measurement frame.
fn residuals(rows: &Rows, measurements: &[&Measurement], before: &DVector<f64>, after: &DVector<f64>) -> Vec<outcome::Residual> {
    (0..measurements.len())
        .map(|row| {
            let rotation = rows.measurement_from_root[rows.session[row]].rotation;
            let part = |of: &DVector<f64>| (rotation * Vector3::from(of.fixed_rows::<3>(row * rows.per_row))).into();
            outcome::Residual {
                row: measurements[row].index,
                position_m: measurements[row].position_m,
                before_m: part(before),
                after_m: part(after),
                cause: None,
            }
        })
        .collect()
}

/// The residual as it would be without the effects that were taken out before the fit.
fn put_back(raw: &mut DMatrix<f64>, rows: &Rows, displacement: &[Displacement]) {
    let last = raw.ncols() - 1;
    for (row, displacement) in displacement.iter().enumerate() {
        for equation in 0..rows.per_row {
            raw[(row * rows.per_row + equation, last)] += displacement[equation];
        }
    }
}
