//! How far an arm's joint frames may be off its file, before anything is read: one sigma of joint zeros, of lengths and of turns, and how
//! the readings choose them.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::arm::chain::FrameErrors;

/// One sigma of a joint frame's position, m: machining and assembly are better than this.
pub const FRAME_SHIFT: f64 = 5e-3;
/// One sigma of a joint frame's orientation, rad.
pub const FRAME_TURN: f64 = 10e-3;
/// One sigma of what somebody says is free, m: so wide that it hardly binds.
pub const FREE_SHIFT: f64 = 50e-3;
/// The same of turns, rad.
pub const FREE_TURN: f64 = 0.5;
/// Sigmas of the frames' priors over those of manufacturing that an arm may have: the readings say which.
pub const SCALES: [f64; 7] = [3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003];
/// The same of joint zeros, which nobody machines: a marked joint is set by eye, a motor is put in a tooth further.
pub const SCALES_OF_ZEROS: [f64; 11] = [300.0, 100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003];
/// Rounds in which the sigmas of one group after the other are chosen.
const ROUNDS: usize = 3;

/// Sigmas of the frames' priors over those of manufacturing; zero where a group is held at nominal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Of a joint's zero: the turn about its axis, or the shift along it where it slides.
    pub zeros: f64,
    /// Of the other shifts: link lengths and offsets.
    pub lengths: f64,
    /// Of the other turns: twists and tilts.
    pub turns: f64,
}

impl Sizes {
    /// Those of manufacturing.
    pub const MANUFACTURING: Sizes = Sizes { zeros: 1.0, lengths: 1.0, turns: 1.0 };
    /// The arm as its file says.
    pub const NOMINAL: Sizes = Sizes { zeros: 0.0, lengths: 0.0, turns: 0.0 };

    fn group(&self, group: usize) -> f64 {
        // What is in no group has the size that somebody said.
        [self.zeros, self.lengths, self.turns].get(group).copied().unwrap_or(0.0)
    }

    fn with(self, group: usize, size: f64) -> Sizes {
        let mut sizes = self;
        *[&mut sizes.zeros, &mut sizes.lengths, &mut sizes.turns][group] = size;
        sizes
    }

    /// One sigma of the frames' error number `at`, m or rad.
    #[must_use]
    pub fn sigma(&self, frames: &FrameErrors, at: usize) -> f64 {
        let usual = if at % FrameErrors::PER_FRAME < 3 { FRAME_SHIFT } else { FRAME_TURN };
        usual * self.group(group(frames, at))
    }
}

/// The group of what the readings choose no size for.
pub(super) const NO_GROUP: usize = 3;

/// What error number `at` of the frames is about: 0 a zero, 1 a length, 2 a turn.
pub(super) fn group(frames: &FrameErrors, at: usize) -> usize {
    match at % FrameErrors::PER_FRAME {
        _ if frames.is_zero(at) => 0,
        0..3 => 1,
        _ => 2,
    }
}

/// Readings about a fit, as far as the choice of sizes needs them.
pub(super) struct Evidence<'a> {
    /// Inner products of the whitened Jacobian, in sigmas of the fit's prior.
    pub(super) normal: DMatrix<f64>,
    /// Those with the whitened residual.
    pub(super) with_residual: DVector<f64>,
    /// Of the whitened residual with itself.
    pub(super) square: f64,
    /// Number of equations.
    pub(super) equations: usize,
    /// The fitted parameters in sigmas; zero where free.
    pub(super) parameters: &'a DVector<f64>,
    /// Which parameters are free.
    pub(super) free: &'a [bool],
    /// Of each parameter that is not, what it is about.
    pub(super) group: &'a [usize],
    /// Sizes of the fit's prior.
    pub(super) sizes: Sizes,
}

impl Evidence<'_> {
    /// Sizes of which the readings are likeliest, where those of groups that the fit held stay: marginal likelihood to first order, base
    /// and target free, the noise's size unknown. First one size for all, then group by group.
    pub(super) fn likeliest(&self) -> Sizes {
        let held = |group: usize| self.sizes.group(group) == 0.0;
        let all = |scale: f64| (0..3).filter(|group| !held(*group)).fold(self.sizes, |sizes, group| sizes.with(group, scale));
        let better = |candidates: &mut dyn Iterator<Item = Sizes>| -> Option<Sizes> {
            candidates.map(|sizes| (self.likelihood(sizes), sizes)).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, sizes)| sizes)
        };
        let mut best = better(&mut SCALES.iter().map(|scale| all(*scale))).unwrap_or(self.sizes);
        for _ in 0..ROUNDS {
            let before = best;
            for group in (0..3).filter(|group| !held(*group)) {
                let grid: &[f64] = if group == 0 { &SCALES_OF_ZEROS } else { &SCALES };
                best = better(&mut grid.iter().map(|scale| best.with(group, *scale))).unwrap_or(best);
            }
            if best == before {
                break;
            }
        }
        best
    }

    /// Logarithm of the marginal likelihood of the readings, up to what does not depend on `sizes`.
    pub(super) fn likelihood(&self, sizes: Sizes) -> f64 {
        let (mut normal, mut with_residual, mut square) = (self.normal.clone(), self.with_residual.clone(), self.square);
        let mut log = 0.0;
        for at in 0..self.free.len() {
            let group = self.group[at];
            // The fit's own prior is one in its units.
            let same = self.free[at] || self.sizes.group(group) == 0.0;
            let precision = if same { 1.0 } else { (self.sizes.group(group) / sizes.group(group)).powi(2) };
            let offset = self.parameters[at];
            normal[(at, at)] += precision;
            with_residual[at] -= precision * offset;
            square += precision * offset * offset;
            log += 0.5 * libm::log(precision);
        }
        let Some(cholesky) = Cholesky::new(normal) else {
            return f64::NEG_INFINITY;
        };
        log -= (0..self.free.len()).map(|at| libm::log(cholesky.l_dirty()[(at, at)])).sum::<f64>();
        let left = square - with_residual.dot(&cholesky.solve(&with_residual));
        let beyond = self.equations.saturating_sub(self.free.iter().filter(|free| **free).count()).max(1) as f64;
        log - 0.5 * beyond * libm::log(left.max(1e-12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    /// The marginal likelihood over that at other sizes is the one of the dense covariance of the readings, the noise's size integrated
    /// out: `|V|^(-1/2) (r' V^-1 r)^(-n/2)` with `V = I + J S J'`, S the squares of the sizes.
    #[test]
    fn sizes_are_compared_by_the_likelihood_of_the_dense_covariance() {
        let mut stream = stream(3, "test/scales");
        let (rows, columns) = (14, 6);
        let jacobian = DMatrix::from_fn(rows, columns, |_, _| 3.0 * stream.normal());
        let read = DVector::from_fn(rows, |_, _| 2.0 * stream.normal());
        let parameters = DVector::from_fn(columns, |_, _| stream.normal());
        // About a fit that is somewhere: the readings are the residual and what the fitted parameters do.
        let residual = &read - &jacobian * &parameters;
        let group = vec![0, 1, 2, 0, 1, 2];
        let evidence = Evidence {
            normal: jacobian.transpose() * &jacobian,
            with_residual: jacobian.transpose() * &residual,
            square: residual.norm_squared(),
            equations: rows,
            parameters: &parameters,
            free: &[false; 6],
            group: &group,
            sizes: Sizes::MANUFACTURING,
        };
        let dense = |sizes: Sizes| {
            let squares = DMatrix::from_diagonal(&DVector::from_fn(columns, |at, _| sizes.group(group[at]).powi(2)));
            let covariance = DMatrix::identity(rows, rows) + &jacobian * squares * jacobian.transpose();
            let square = read.dot(&(covariance.clone().try_inverse().unwrap() * &read));
            -0.5 * covariance.determinant().ln() - 0.5 * rows as f64 * square.ln()
        };
        let usual = Sizes::MANUFACTURING;
        for (zeros, lengths, turns) in [(3.0, 3.0, 3.0), (0.3, 1.0, 0.03), (100.0, 0.003, 1.0)] {
            let sizes = Sizes { zeros, lengths, turns };
            let (found, wanted) = (evidence.likelihood(sizes) - evidence.likelihood(usual), dense(sizes) - dense(usual));
            assert!((found - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{sizes:?}: {found} against {wanted}");
        }
        // The choice is no worse than any single size.
        let best = evidence.likelihood(evidence.likeliest());
        for scale in SCALES {
            assert!(best >= evidence.likelihood(Sizes { zeros: scale, lengths: scale, turns: scale }));
        }
    }
}
