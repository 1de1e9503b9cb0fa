//! Joints that do not repeat: what remains lies along one joint's motion, larger than the sensor's noise and without order in anything
//! that was recorded. Backlash does that where nobody recorded from which side the joint came. A variance of its own for that joint
//! is compared with none, by marginal likelihood, and with the ripples and bumps that such scatter is mistaken for: among thousands of
//! shapes one follows any scatter somewhat.

use nalgebra::{DVector, Matrix3, Vector3};

use super::candidates::odds_of_one_more_nameless;
use super::evidence::{Candidates, NoisePrior, coefficients, log_posterior};
use super::gram::Surviving;
use super::held_out::Problem;
use super::rows::Rows;
use super::search::Found;
use super::whitening::Whitening;
use crate::effects::Kind;
use crate::effects::signature::library::RIPPLES;
use crate::effects::signature::posture::{Mechanism, Posture};
use crate::effects::signature::shape::Shape;

/// Smallest sigma of a joint's scatter, rad or m; the others are a root of two larger each.
const SMALLEST: f64 = 5e-6;
/// Sigmas looked at.
const STEPS: u8 = 18;
/// Joints that may scatter.
const MOST: usize = 2;
/// Standard deviations by which residuals must point along the joint's motion.
const ALONG: f64 = 3.5;

/// A joint that does not repeat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The joint, from 0.
    pub joint: usize,
    /// One sigma of its error, rad or (where it slides) m.
    pub sigma: f64,
}

impl Scatter {
    /// In words.
    pub(super) fn detail(&self, slides: bool) -> String {
        let (size, unit) = if slides { (self.sigma * 1e6, "µm") } else { (self.sigma.to_degrees() * 3600.0, "arcsec") };
        format!("joint {} does not repeat: its errors scatter by {size:.0} {unit}, in no order that was recorded", self.joint + 1)
    }
}

/// What one sigma of each of `scatter` does to the target (at `targets`, in root, m) of each row: m and, of 6 equations, rad.
pub(super) fn displaced(
    mechanism: &Mechanism,
    postures: &[Posture],
    targets: &[Vector3<f64>],
    per_row: usize,
    scatter: &[Scatter],
) -> Vec<Vec<DVector<f64>>> {
    let of_row = |(posture, target): (&Posture, &Vector3<f64>)| {
        scatter.iter().map(|one| moved(mechanism, posture, target, per_row, one.joint) * one.sigma).collect()
    };
    postures.iter().zip(targets).map(of_row).collect()
}

/// What a unit move of `joint` does to `target`, m and rad.
fn moved(mechanism: &Mechanism, posture: &Posture, target: &Vector3<f64>, per_row: usize, joint: usize) -> DVector<f64> {
    let axis = posture.axes[joint];
    let (shift, turn) =
        if mechanism.slides[joint] { (axis, Vector3::zeros()) } else { (axis.cross(&(target - posture.origins[joint])), axis) };
    DVector::from_iterator(per_row, shift.iter().chain(turn.iter()).take(per_row).copied())
}

/// The joints that scatter, given what was found, most likely first.
pub(super) fn look(
    rows: &Rows,
    problem: &Problem,
    surviving: &Surviving,
    candidates: &Candidates,
    noise: NoisePrior,
    found: &Found,
) -> Vec<Scatter> {
    let all = &found.best.members;
    let contested = |(member, _): &&(usize, usize)| {
        let of = &candidates.hypotheses[*member];
        of.kind == Some(Kind::StrainWaveError)
            || matches!(of.shape, Shape::Harmonic(_, order) if order >= f64::from(*RIPPLES.start()))
            || matches!(of.shape, Shape::Bump { .. })
    };
    let fewer: Vec<(usize, usize)> = all.iter().filter(|member| !contested(member)).copied().collect();
    // What ripples and bumps are worth, beside the scatter that is in the noise already.
    let worth = log_posterior(surviving, candidates, noise, all) - log_posterior(surviving, candidates, noise, &fewer);
    let odds = odds_of_one_more_nameless(candidates);
    let left = |members: &[(usize, usize)]| problem.left(surviving, &coefficients(surviving, candidates, noise, members));
    let trials = if fewer.len() < all.len() { vec![(left(all), 0.0), (left(&fewer), worth)] } else { vec![(left(all), 0.0)] };
    let mut best: (f64, Vec<Scatter>) = (0.0, Vec::new());
    for (residual, lost) in trials {
        let position = Position::new(rows, problem, &residual);
        let mut scatter: Vec<Scatter> = Vec::new();
        let mut total = -lost;
        while scatter.len() < MOST {
            let tried = (0..rows.mechanism.joint_count()).filter(|joint| !scatter.iter().any(|one| one.joint == *joint));
            let values = tried.map(|joint| position.value(surviving.freedom, noise, &scatter, joint));
            match values.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((gain, one)) if gain + odds > position.lopsided().max(0.0) && position.along(one.joint) > ALONG => {
                    total += gain + odds;
                    scatter.push(one);
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

/// What is left of the positions: attitudes may be less exact than they are said to be, which is no joint's doing.
struct Position<'a> {
    rows: &'a Rows,
    /// One over sigma of each equation, as in [`Whitening::diagonal`].
    diagonal: DVector<f64>,
    /// m.
    residual: DVector<f64>,
}

impl<'a> Position<'a> {
    fn new(rows: &'a Rows, problem: &Problem, residual: &DVector<f64>) -> Position<'a> {
        let of = |vector: &DVector<f64>| {
            let first = |at: usize| vector[at / 3 * rows.per_row + at % 3];
            DVector::from_fn(3 * rows.postures.len(), |at, _| first(at))
        };
        Position { rows, diagonal: of(&problem.whitening.diagonal), residual: of(residual) }
    }

    /// What a unit move of `joint` does in `row`, m.
    fn moved(&self, row: usize, joint: usize) -> DVector<f64> {
        moved(&self.rows.mechanism, &self.rows.postures[row], &self.rows.targets[row], 3, joint)
    }

    /// Logarithm of the marginal likelihood of the residual with a scatter of `joint` besides `others` over that without, the noise's
    /// level integrated out and the sigma averaged over; and the best sigma. `freedom`: equations that the model leaves.
    fn value(&self, freedom: f64, noise: NoisePrior, others: &[Scatter], joint: usize) -> (f64, Scatter) {
        let rows = self.rows;
        let mut base = Whitening::new(self.diagonal.clone(), 3);
        if !others.is_empty() {
            base = base.with(&displaced(&rows.mechanism, &rows.postures, &rows.targets, 3, others));
        }
        let whitened = base.of_vector(&self.residual);
        let square = whitened.norm_squared();
        let moved: Vec<(f64, f64)> = (0..rows.postures.len())
            .map(|row| {
                let moved = self.moved(row, joint);
                let moved = base.of_row(row, moved.rows(0, 3));
                (moved.norm_squared(), moved.dot(&whitened.rows(3 * row, 3)))
            })
            .collect();
        let degrees = noise.freedom + freedom * 3.0 / rows.per_row as f64;
        let known = noise.freedom * noise.level;
        let level = (known + square) / degrees;
        let values: Vec<(f64, f64)> = (0..STEPS)
            .map(|step| {
                let sigma = SMALLEST * libm::pow(2.0, 0.5 * f64::from(step));
                // Over the noise's level, so that both are of one scale.
                let ratio = sigma * sigma / level;
                let (mut drop, mut volume) = (0.0, 0.0);
                for (own, with) in &moved {
                    drop += ratio * with * with / (1.0 + ratio * own);
                    volume += libm::log(1.0 + ratio * own);
                }
                let left = ((known + square - drop) / (known + square)).max(1e-12);
                (-0.5 * volume - 0.5 * degrees * libm::log(left), sigma)
            })
            .collect();
        let top = values.iter().map(|(value, _)| *value).fold(f64::NEG_INFINITY, f64::max);
        let mean = values.iter().map(|(value, _)| libm::exp(value - top)).sum::<f64>() / f64::from(STEPS);
        let sigma = values.iter().find(|(value, _)| *value == top).map_or(SMALLEST, |(_, sigma)| *sigma);
        (top + libm::log(mean), Scatter { joint, sigma })
    }

    /// The residual of `row` in sigmas.
    fn sigmas(&self, row: usize) -> Vector3<f64> {
        Vector3::from(self.residual.fixed_rows::<3>(3 * row)).component_mul(&self.diagonal.fixed_rows::<3>(3 * row))
    }

    /// What the same residual gains, in the same terms, by a sensor whose noise has another size along every axis (Schwarz's
    /// criterion): a tracker is better along its beam than across it.
    fn lopsided(&self) -> f64 {
        let count = self.rows.postures.len() as f64;
        let square = |row: usize| {
            let in_frame = self.rows.measurement_from_root[self.rows.session[row]].rotation * self.sigmas(row);
            in_frame * in_frame.transpose() / count
        };
        let covariance: Matrix3<f64> = (0..self.rows.postures.len()).map(square).sum();
        let round = libm::pow(covariance.trace() / 3.0, 3.0);
        0.5 * count * libm::log(round / covariance.determinant().max(1e-12 * round)) - 2.5 * libm::log(count)
    }

    /// By how many standard deviations the residuals point along the motion of `joint` rather than anywhere, whatever their size: some
    /// readings that are far off are no scatter (a sign test in space).
    fn along(&self, joint: usize) -> f64 {
        let cosines: Vec<f64> = (0..self.rows.postures.len())
            .filter_map(|row| {
                let moved = self.moved(row, joint);
                let (left, moved) = (self.sigmas(row), Vector3::from(moved.fixed_rows::<3>(0)));
                let size = left.norm_squared() * moved.norm_squared();
                (size > 0.0).then(|| left.dot(&moved) * left.dot(&moved) / size)
            })
            .collect();
        // The square of a cosine to a random direction is 1/3 in the mean, with the variance 4/45.
        let count = cosines.len() as f64;
        (cosines.iter().sum::<f64>() - count / 3.0) / libm::sqrt(count * 4.0 / 45.0).max(1e-12)
    }
}
