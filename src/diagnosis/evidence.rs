//! Marginal likelihood of sets of effects, in closed form: linear in the magnitudes, Gaussian priors of physical size, noise level
//! integrated out, geometry integrated out before (see [`super::gram`]).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::gram::Surviving;
use crate::effects::Kind;
use crate::effects::signature::library::Hypothesis;
use crate::effects::signature::shape::Shape;

/// Prior standard deviations of a magnitude, in units of its usual one, and how likely each is.
pub const SCALES: [(f64, f64); 3] = [(1.0, 0.45), (2.5, 0.45), (12.0, 0.10)];

/// What is known of the noise beforehand: so many readings' worth (degrees of freedom) of a mean square, in declared sigmas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoisePrior {
    /// Degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Mean square over the declared one.
    pub level: f64,
}

/// The hypotheses in play, and where their columns are.
#[derive(Clone, Debug)]
pub struct Candidates {
    /// What they are.
    pub hypotheses: Vec<Hypothesis>,
    /// First column of each.
    pub first: Vec<usize>,
    /// Magnitude that a coefficient of one stands for.
    pub unit: Vec<f64>,
    /// Logarithm of the prior odds of having it over not.
    pub log_odds: Vec<f64>,
    /// Whether it is in play.
    pub active: Vec<bool>,
}

/// A set of effects, each with the scale of its prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Hypothesis and scale, in the order added.
    pub members: Vec<(usize, usize)>,
    /// Logarithm of posterior over that of the empty set.
    pub log_posterior: f64,
}

/// The coefficients of a model.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Columns.
    pub columns: Vec<usize>,
    /// Posterior means.
    pub coefficients: DVector<f64>,
    /// Posterior covariance over the noise's mean square.
    pub covariance: DMatrix<f64>,
    /// By how much the residual's square drops.
    pub drop: f64,
    /// Posterior mean of the noise's mean square, in declared sigmas.
    pub noise: f64,
}

impl Candidates {
    /// Columns of a hypothesis.
    #[must_use]
    pub fn columns(&self, hypothesis: usize) -> std::ops::Range<usize> {
        self.first[hypothesis]..self.first[hypothesis] + self.hypotheses[hypothesis].spread.len()
    }

    /// Whether both cannot be in one model: they are the same thing.
    #[must_use]
    pub fn exclude(&self, a: usize, b: usize) -> bool {
        if a == b {
            return true;
        }
        let (a, b) = (&self.hypotheses[a], &self.hypotheses[b]);
        match (a.kind, b.kind) {
            (Some(x), Some(y)) => x == y && a.location == b.location && !matches!(x, Kind::StrainWaveError | Kind::GearCoupling),
            // Two bumps that overlap are one.
            (None, None) if a.location == b.location && overlap(a, b) => true,
            // What bends or seats a link unequally has the equal case in it.
            (Some(Kind::LinkBending), None) | (None, Some(Kind::LinkBending)) => {
                a.location.index == b.location.index
                    && [a.shape, b.shape].iter().any(|shape| matches!(shape, Shape::UnequalBend(_)))
            }
            (Some(Kind::TiltClearance), None) | (None, Some(Kind::TiltClearance)) => {
                a.location.index == b.location.index
                    && [a.shape, b.shape].iter().any(|shape| matches!(shape, Shape::UnequalSeat(_)))
            }
            (Some(Kind::RadialClearance), None) | (None, Some(Kind::RadialClearance)) => {
                a.location.index == b.location.index
                    && [a.shape, b.shape].iter().any(|shape| matches!(shape, Shape::UnequalShift(_)))
            }
            // A cubic spring has the linear one in it.
            (Some(Kind::JointCompliance), None) | (None, Some(Kind::JointCompliance)) | (None, None) => {
                a.location == b.location
                    && (is_hardening(a) || is_hardening(b))
                    && (a.kind != b.kind || is_hardening(a) == is_hardening(b))
            }
            _ => false,
        }
    }
}

fn overlap(a: &Hypothesis, b: &Hypothesis) -> bool {
    match (a.shape, b.shape) {
        (Shape::Bump { centre: x, half_width: w, .. }, Shape::Bump { centre: y, half_width: v, .. }) => (x - y).abs() < w.max(v),
        _ => false,
    }
}

fn is_hardening(hypothesis: &Hypothesis) -> bool {
    matches!(hypothesis.shape, Shape::Hardening(_) | Shape::Softening(_))
}

/// Whether physics allows only one sign.
#[must_use]
pub fn one_signed(hypothesis: &Hypothesis) -> bool {
    matches!(
        hypothesis.kind,
        Some(
            Kind::JointCompliance
                | Kind::LinkBending
                | Kind::GravityLostMotion
                | Kind::RadialClearance
                | Kind::TiltClearance
                | Kind::LinkThermalGrowth
        )
    )
}

/// A model with what is needed to add to it.
struct Extended {
    columns: Vec<usize>,
    inverse: DMatrix<f64>,
    coefficients: DVector<f64>,
    drop: f64,
    log_determinant: f64,
}

fn solve(surviving: &Surviving, candidates: &Candidates, members: &[(usize, usize)]) -> Option<(Extended, Cholesky<f64, Dyn>)> {
    let mut columns = Vec::new();
    let mut precision = Vec::new();
    for (hypothesis, scale) in members {
        for column in candidates.columns(*hypothesis) {
            columns.push(column);
            precision.push(1.0 / (SCALES[*scale].0 * SCALES[*scale].0));
        }
    }
    let count = columns.len();
    let products = DMatrix::from_fn(count, count, |i, j| {
        surviving.products[(columns[i], columns[j])] + if i == j { precision[i] } else { 0.0 }
    });
    let right = DVector::from_fn(count, |i, _| surviving.with_residual[columns[i]]);
    let cholesky = Cholesky::new(products)?;
    let coefficients = cholesky.solve(&right);
    let drop = right.dot(&coefficients);
    let log_determinant = (0..count).map(|i| 2.0 * libm::log(cholesky.l_dirty()[(i, i)]) - libm::log(precision[i])).sum::<f64>();
    Some((Extended { columns, inverse: cholesky.inverse(), coefficients, drop, log_determinant }, cholesky))
}

/// Logarithm of the evidence over that of no effect.
fn log_ratio(surviving: &Surviving, noise: NoisePrior, drop: f64, log_determinant: f64) -> f64 {
    let before = noise.degrees_of_freedom * noise.level + surviving.residual;
    let after = (before - drop).max(1e-9 * before);
    -0.5 * log_determinant - 0.5 * (noise.degrees_of_freedom + surviving.degrees_of_freedom) * libm::log(after / before)
}

/// Logarithm of the share of the posterior that physics allows, over that of the prior (a half).
fn log_allowed(mean: f64, sigma: f64) -> f64 {
    let z = mean / sigma.max(1e-300);
    // Below this the tail is so thin that its logarithm is what counts.
    if z < -6.0 {
        -0.5 * z * z - libm::log(-z) - 0.919 + 0.693
    } else {
        libm::log(libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2))
    }
}

/// Evidence and prior of `members` together.
#[must_use]
pub fn log_posterior(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, members: &[(usize, usize)]) -> f64 {
    if members.is_empty() {
        return 0.0;
    }
    let Some((model, _)) = solve(surviving, candidates, members) else {
        return f64::NEG_INFINITY;
    };
    let level = level(surviving, noise, model.drop);
    let mut at = 0;
    let mut total = log_ratio(surviving, noise, model.drop, model.log_determinant);
    for (hypothesis, scale) in members {
        total += candidates.log_odds[*hypothesis] + libm::log(SCALES[*scale].1);
        if one_signed(&candidates.hypotheses[*hypothesis]) {
            total += log_allowed(model.coefficients[at], libm::sqrt(level * model.inverse[(at, at)]));
        }
        at += candidates.columns(*hypothesis).len();
    }
    total
}

fn level(surviving: &Surviving, noise: NoisePrior, drop: f64) -> f64 {
    (noise.degrees_of_freedom * noise.level + surviving.residual - drop).max(1e-12)
        / (noise.degrees_of_freedom + surviving.degrees_of_freedom)
}

/// Posterior mean of the noise's mean square beside `members`, in declared sigmas.
#[must_use]
pub fn noise_level(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, members: &[(usize, usize)]) -> f64 {
    fit(surviving, candidates, noise, members).map_or_else(|| level(surviving, noise, 0.0), |fit| fit.noise)
}

/// The coefficients of `members`.
#[must_use]
pub fn fit(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, members: &[(usize, usize)]) -> Option<Fit> {
    let (model, _) = solve(surviving, candidates, members)?;
    Some(Fit {
        noise: level(surviving, noise, model.drop),
        columns: model.columns,
        coefficients: model.coefficients,
        covariance: model.inverse,
        drop: model.drop,
    })
}

/// Coefficients of all signatures, zero for those that are no members.
#[must_use]
pub fn coefficients(
    surviving: &Surviving,
    candidates: &Candidates,
    noise: NoisePrior,
    members: &[(usize, usize)],
) -> DVector<f64> {
    let mut coefficients = DVector::zeros(surviving.products.ncols());
    if let Some(fit) = fit(surviving, candidates, noise, members) {
        for (column, value) in fit.columns.iter().zip(fit.coefficients.iter()) {
            coefficients[*column] = *value;
        }
    }
    coefficients
}

/// All models that have one effect more than `members`.
#[must_use]
pub fn extensions(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, members: &[(usize, usize)]) -> Vec<Model> {
    let Some((base, _)) = solve(surviving, candidates, members) else {
        return Vec::new();
    };
    let prior: f64 =
        members.iter().map(|(hypothesis, scale)| candidates.log_odds[*hypothesis] + libm::log(SCALES[*scale].1)).sum();
    let mut found = Vec::new();
    for hypothesis in 0..candidates.hypotheses.len() {
        if !candidates.active[hypothesis] || members.iter().any(|(member, _)| candidates.exclude(*member, hypothesis)) {
            continue;
        }
        let range = candidates.columns(hypothesis);
        let width = range.len();
        let cross = DMatrix::from_fn(base.columns.len(), width, |i, j| surviving.products[(base.columns[i], range.start + j)]);
        let absorbed = &base.inverse * &cross;
        let left = surviving.products.view((range.start, range.start), (width, width)) - cross.tr_mul(&absorbed);
        let right = surviving.with_residual.rows(range.start, width) - cross.tr_mul(&base.coefficients);
        for (scale, (size, share)) in SCALES.iter().enumerate() {
            let precision = 1.0 / (size * size);
            let (added, log_determinant, first, variance) = if width == 1 {
                let diagonal = left[(0, 0)] + precision;
                let coefficient = right[0] / diagonal;
                (right[0] * coefficient, libm::log(diagonal / precision), coefficient, 1.0 / diagonal)
            } else {
                let mut matrix = left.clone();
                for i in 0..width {
                    matrix[(i, i)] += precision;
                }
                let Some(cholesky) = Cholesky::new(matrix) else {
                    continue;
                };
                let coefficients = cholesky.solve(&right);
                let log_determinant =
                    (0..width).map(|i| 2.0 * libm::log(cholesky.l_dirty()[(i, i)]) - libm::log(precision)).sum::<f64>();
                (right.dot(&coefficients), log_determinant, coefficients[0], 0.0)
            };
            let drop = base.drop + added;
            let mut total = prior + log_ratio(surviving, noise, drop, base.log_determinant + log_determinant);
            total += candidates.log_odds[hypothesis] + libm::log(*share);
            if one_signed(&candidates.hypotheses[hypothesis]) {
                total += log_allowed(first, libm::sqrt(level(surviving, noise, drop) * variance));
            }
            let mut extended = members.to_vec();
            extended.push((hypothesis, scale));
            found.push(Model { members: extended, log_posterior: total });
        }
    }
    found
}
