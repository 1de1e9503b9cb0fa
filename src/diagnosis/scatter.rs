//! Joints that do not repeat: what remains lies along one joint's motion, larger than the sensor's noise and without order in anything
//! that was recorded. Backlash does that where nobody recorded from which side the joint came. A variance of its own for that joint
//! is compared, by marginal likelihood, with none, with the ripples and bumps that such scatter is mistaken for (among thousands of
//! shapes one follows any scatter somewhat), and with a sensor whose noise has another size along every axis; and most of what remains,
//! large or small, must point along the joint's motion.

use nalgebra::{DMatrix, DVector, DVectorView};

use super::candidates::odds_of_one_more_unnamed;
use super::evidence::{Evidence, NoisePrior};
use super::linear::Linear;
use super::rows::Rows;
use super::search::Found;
use super::settings;
use crate::effects::Kind;
use crate::effects::signature::library::{Hypothesis, RIPPLES, strongest};
use crate::effects::signature::shape::Shape;
use crate::effects::signature::unnamed::Nameless;
use crate::measurement::equations::Equations;
use crate::solver::whitening::Whitening;

/// A joint that does not repeat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scatter {
    /// The joint, from 0.
    pub(crate) joint: usize,
    /// One sigma of its error beside a sensor that is as good as declared, rad or (where it slides) m; where the noise is larger, so is
    /// this.
    pub(crate) sigma: f64,
    /// Logarithm of the odds of it against the sensor alone.
    pub(crate) log_odds: f64,
}

/// Whether both are the same joints, their sigmas alike.
pub(super) fn alike(one: &[Scatter], other: &[Scatter], settings: &settings::Scatter) -> bool {
    let [least, most] = settings.alike;
    let near = |a: &Scatter, b: &Scatter| a.joint == b.joint && (least..most).contains(&(a.sigma / b.sigma));
    one.len() == other.len() && one.iter().all(|a| other.iter().any(|b| near(a, b)))
}

/// Whether scatter may be mistaken for it: one of thousands of ripples and bumps, or a function of the angle that is free to follow.
pub(super) fn is_contested(of: &Hypothesis) -> bool {
    matches!(of.kind, Some(Kind::StrainWaveError | Kind::JointAngleMap))
        || strongest(&of.shape).is_some_and(|(_, order)| order >= f64::from(*RIPPLES.start()))
        || matches!(of.shape, Shape::Nameless(Nameless::Bump(_)))
}

/// The joints that scatter, given what was found, most likely first. `known`: some scatter was in the noise already when that was found, so
/// that its ripples and bumps do not stand in for it.
pub(super) fn look(linear: &Linear<'_>, evidence: &Evidence<'_>, found: &Found, known: bool) -> Vec<Scatter> {
    let (rows, candidates, noise) = (linear.rows, evidence.candidates, evidence.noise);
    let settings = &evidence.settings.scatter;
    let all = &found.best;
    let fewer: Vec<(usize, usize)> =
        all.iter().filter(|(member, _)| !is_contested(&candidates.hypotheses[*member])).copied().collect();
    // What ripples and bumps are worth where the noise is the sensor's.
    let worth = evidence.log_posterior(all) - evidence.log_posterior(&fewer);
    let odds = odds_of_one_more_unnamed(candidates, rows.mechanism.joint_count(), &evidence.settings.prior);
    let left = |members: &[(usize, usize)]| {
        let coefficients = evidence.coefficients(members);
        linear.left(&evidence.marginal.geometry(&coefficients), &linear.made(&coefficients))
    };
    let mut trials = vec![(left(all), 0.0)];
    if fewer.len() < all.len() && !known {
        trials.push((left(&fewer), worth));
    }
    let mut best: (f64, Vec<Scatter>) = (0.0, Vec::new());
    for (residual, lost) in trials {
        let all = Left::new(rows, &residual);
        // Orientations may be less exact than they are said to be, which is no joint's doing.
        let position = Left::of_positions(rows, &residual);
        let mut scatter: Vec<Scatter> = Vec::new();
        let mut total = -lost;
        while scatter.len() < settings.most {
            let tried = (0..rows.mechanism.joint_count()).filter(|joint| !scatter.iter().any(|one| one.joint == *joint));
            let values = tried.map(|joint| all.value(evidence.marginal.degrees_of_freedom, noise, &scatter, joint, settings));
            match values.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((gain, one))
                    if gain + odds > position.lopsided(&scatter).max(0.0)
                        && position.along(&scatter, one.joint) > settings.along =>
                {
                    total += gain + odds;
                    scatter.push(Scatter { log_odds: gain + odds, ..one });
                }
                _ => break,
            }
        }
        if total > best.0 {
            best = (total, scatter);
        }
    }
    best.1
}

/// What is left of the readings, or of their positions.
struct Left<'a> {
    rows: &'a Rows,
    /// Sensor noise alone.
    whitening: Whitening,
    /// m, rad.
    residual: DVector<f64>,
    /// What is looked at of the rows, and of each equation its number among all.
    equations: Equations,
    which: Vec<usize>,
}

impl<'a> Left<'a> {
    /// Of all equations.
    fn new(rows: &'a Rows, residual: &DVector<f64>) -> Left<'a> {
        Left::of(rows, residual, (rows.equations.clone(), (0..rows.equations.len()).collect()))
    }

    /// Of the positions.
    fn of_positions(rows: &'a Rows, residual: &DVector<f64>) -> Left<'a> {
        Left::of(rows, residual, rows.equations.positions())
    }

    fn of(rows: &'a Rows, residual: &DVector<f64>, (equations, which): (Equations, Vec<usize>)) -> Left<'a> {
        let whitening = rows.whitening.of_sensor(&equations, &which);
        Left { rows, whitening, residual: residual.select_rows(&which), equations, which }
    }

    /// What a unit move of `joint` does to the equations of `row` that are looked at.
    fn moved(&self, row: usize, joint: usize) -> DVector<f64> {
        let (moved, first) = (self.rows.moved(row, joint), self.rows.equations.of(row).start);
        DVector::from_iterator(
            self.equations.of(row).len(),
            self.which[self.equations.of(row)].iter().map(|at| moved[at - first]),
        )
    }

    /// What makes the equations alike beside the scatter of `others`.
    fn beside(&self, others: &[Scatter]) -> Whitening {
        if others.is_empty() {
            return self.whitening.clone();
        }
        let of_row = |row: usize| others.iter().map(|one| self.moved(row, one.joint) * one.sigma).collect();
        self.whitening.clone().with(&(0..self.equations.readings()).map(of_row).collect::<Vec<_>>())
    }

    /// Of each row: its weight, the residual and what a unit move of `joint` does, both in sigmas beside `others`.
    fn in_sigmas(&self, others: &[Scatter], joint: usize) -> Vec<(f64, DVector<f64>, DVector<f64>)> {
        let base = self.beside(others);
        (0..self.equations.readings())
            .map(|row| {
                let weight = base.weights()[row].max(1e-300);
                let moved = self.moved(row, joint);
                let of = |values: DVectorView<'_, f64>| base.of_row(row, values) / libm::sqrt(weight);
                (weight, of(self.residual.rows_range(self.equations.of(row))), of(moved.as_view()))
            })
            .collect()
    }

    /// Logarithm of the marginal likelihood of the residual with a scatter of `joint` besides `others` over that without, the noise's
    /// level integrated out, the geometry as fitted, and the sigma averaged over; and the best sigma. `degrees_of_freedom`: equations that
    /// the model leaves. A row counts by its weight.
    fn value(
        &self,
        degrees_of_freedom: f64,
        noise: NoisePrior,
        others: &[Scatter],
        joint: usize,
        settings: &settings::Scatter,
    ) -> (f64, Scatter) {
        let rows = self.in_sigmas(others, joint);
        let square: f64 = rows.iter().map(|(weight, left, _)| weight * left.norm_squared()).sum();
        let degrees =
            noise.degrees_of_freedom + degrees_of_freedom * self.equations.len() as f64 / self.rows.equations.len() as f64;
        let known = noise.degrees_of_freedom * noise.level;
        let values: Vec<(f64, f64)> = (0..settings.steps)
            .map(|step| {
                let sigma = settings.smallest * libm::pow(2.0, 0.5 * f64::from(step));
                let (mut drop, mut volume) = (0.0, 0.0);
                for (weight, left, moved) in &rows {
                    let (own, with) = (sigma * sigma * moved.norm_squared(), sigma * moved.dot(left));
                    drop += weight * with * with / (1.0 + own);
                    volume += weight * libm::log(1.0 + own);
                }
                let left = ((known + square - drop) / (known + square)).max(1e-12);
                (-0.5 * volume - 0.5 * degrees * libm::log(left), sigma)
            })
            .collect();
        let top = values.iter().map(|(value, _)| *value).fold(f64::NEG_INFINITY, f64::max);
        let mean = values.iter().map(|(value, _)| libm::exp(value - top)).sum::<f64>() / f64::from(settings.steps);
        let sigma = values.iter().find(|(value, _)| *value == top).map_or(settings.smallest, |(_, sigma)| *sigma);
        (top + libm::log(mean), Scatter { joint, sigma, log_odds: 0.0 })
    }

    /// What the positions beside `others` gain, in the same terms, by a sensor whose noise has another size along every axis (Schwarz's
    /// criterion): a tracker is better along its beam than across it.
    fn lopsided(&self, others: &[Scatter]) -> f64 {
        let base = self.beside(others);
        let whitened = base.of_vector(&self.residual);
        let count: f64 = base.weights().iter().sum();
        let read: Vec<usize> = (0..3).filter(|axis| self.equations.components()[*axis]).collect();
        let square = |row: usize| {
            let left = self.equations.pose(row, &whitened.as_slice()[self.equations.of(row)]);
            let left = DVector::from_iterator(read.len(), read.iter().map(|axis| left[*axis]));
            &left * left.transpose() / count
        };
        let zero = DMatrix::zeros(read.len(), read.len());
        let covariance = (0..self.equations.readings()).map(square).fold(zero, |sum, one| sum + one);
        let axes = read.len() as f64;
        let round = libm::pow(covariance.trace() / axes, axes).max(1e-300);
        // Sizes and directions of an ellipsoid, but for its mean size.
        let added = 0.5 * axes * (axes + 1.0) - 1.0;
        0.5 * count * libm::log(round / covariance.determinant().max(1e-12 * round)) - 0.5 * added * libm::log(count)
    }

    /// By how many standard deviations the positions beside `others` point along the motion of `joint` rather than anywhere, whatever
    /// their size: some readings that are far off are no scatter (a sign test in space). Readings that are alike count once.
    fn along(&self, others: &[Scatter], joint: usize) -> f64 {
        let (mut sum, mut variance) = (0.0, 0.0);
        for (weight, left, moved) in self.in_sigmas(others, joint) {
            let size = left.norm_squared() * moved.norm_squared();
            if size > 0.0 {
                // Mean and variance of the square of a cosine to a random direction: of three axes 1/3 and 4/45.
                let axes = left.len() as f64;
                sum += weight * (left.dot(&moved) * left.dot(&moved) / size - 1.0 / axes);
                variance += weight * 2.0 * (axes - 1.0) / (axes * axes * (axes + 2.0));
            }
        }
        sum / libm::sqrt(variance).max(1e-12)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::with_analysis;

    /// A number between -1 and 1 that is in no order of `value`.
    fn without_order(value: f64) -> f64 {
        (1e7 * value).sin()
    }

    fn looked(off: impl Fn(f64, usize) -> f64) -> Vec<Scatter> {
        let mut found = Vec::new();
        with_analysis(
            |_, joints, _, of, _| off(joints[of], of),
            |analysis| found = look(analysis.linear, &analysis.evidence, &Found::default(), false),
        );
        found
    }

    #[test]
    fn a_joint_that_does_not_repeat_is_found_with_its_sigma() {
        let found = looked(|angle, of| if of == 3 { 4e-4 * without_order(angle) } else { 0.0 });
        assert_eq!(found.iter().map(|one| one.joint).collect::<Vec<_>>(), [3]);
        // At most the root mean square of the sine: the geometry, which was fitted without it, has taken some of it, and has spread some
        // over all directions, where it counts as noise.
        let ratio = found[0].sigma / (4e-4 / 2_f64.sqrt());
        assert!((0.15..1.5).contains(&ratio) && found[0].log_odds > 5.0, "{:?}", found[0]);
    }

    #[test]
    fn an_arm_that_repeats_has_none() {
        assert_eq!(looked(|_, _| 0.0), []);
    }

    #[test]
    fn scatter_is_alike_by_joint_and_size() {
        let settings = crate::diagnosis::settings::Settings::default().scatter;
        let of = |joint: usize, sigma: f64| Scatter { joint, sigma, log_odds: 0.0 };
        assert!(alike(&[of(1, 1e-3), of(4, 2e-3)], &[of(4, 2e-3), of(1, 1.001e-3)], &settings));
        assert!(!alike(&[of(1, 1e-3)], &[of(2, 1e-3)], &settings) && !alike(&[of(1, 1e-3)], &[of(1, 9e-3)], &settings));
        assert!(!alike(&[of(1, 1e-3)], &[], &settings));
    }
}
