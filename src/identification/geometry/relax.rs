//! A fitted geometry with priors of other sizes, without fitting anew: to first order, checked by the predictions themselves.
//!
//! The ladder asks what many priors make of the same readings. About a fit the predictions are nearly linear in what is fitted, so that each
//! answer is one solution of the normal equations; how far it is from true is seen by predicting once.

use nalgebra::{DMatrix, DVector};

use super::{Geometry, GeometryError, LEVEL, Placing, Readings, Sizes};
use crate::arm::Arm;
use crate::numerics::gram;
use crate::solver::{Problem, robust};

/// Root mean square by which predictions may differ from those of first order, in sigmas of what is left.
const NEARLY_LINEAR: f64 = 0.05;
/// Rounds of estimating the noise beside the fit.
const ROUNDS: usize = 4;
/// Relative change of the level that is nothing.
const SETTLED: f64 = 0.05;

impl Geometry {
    /// The same readings with priors of these sizes, where that is near enough to first order; else fitted anew, roughly.
    ///
    /// # Errors
    /// As [`super::fit`].
    pub(in crate::identification) fn relaxed(
        &self,
        arm: &Arm,
        readings: Readings<'_>,
        sizes: Sizes,
    ) -> Result<Geometry, GeometryError> {
        match self.to_first_order(arm, readings, sizes)? {
            Some(near) => Ok(near),
            None => self.refit_roughly(arm, readings, sizes),
        }
    }

    fn to_first_order(&self, arm: &Arm, readings: Readings<'_>, sizes: Sizes) -> Result<Option<Geometry>, GeometryError> {
        if !readings.scatter.is_empty() {
            return Ok(None);
        }
        let mut problem = Placing::new(arm, readings, &self.session, self.sessions.len(), sizes)?;
        let width = self.free.len();
        let (before, count) = (self.placed.before, self.placed.count);
        // From the file's frames on: those of this fit are taken back.
        let mut back = DVector::zeros(width);
        back.rows_mut(before, count).copy_from(&self.placed.parameters.rows(before, count));
        let residual = &self.residual + &self.jacobian * &back;
        let (of_known, by_known) = &self.distances;
        let of_known = of_known + by_known * &back;
        let scale = |column: usize| if self.sigma[column] > 0.0 { problem.sigma[column] / self.sigma[column] } else { 0.0 };
        let scale = DVector::from_fn(width, |column, _| scale(column));
        let scaled = |matrix: &DMatrix<f64>| {
            let mut matrix = matrix.clone();
            matrix.column_iter_mut().zip(scale.iter()).for_each(|(mut column, scale)| column *= *scale);
            matrix
        };
        let (jacobian, by_known) = (scaled(&self.jacobian), scaled(by_known));
        let whitened = self.whitening.of(&jacobian);
        let normal = gram(&whitened);
        let right = whitened.tr_mul(&self.whitening.of_vector(&residual));
        let (normal_of_known, right_of_known) = (gram(&by_known), by_known.tr_mul(&of_known));
        let counts = self.equations.counts();
        let bound = (before..before + count).any(|column| problem.sigma[column] > 0.0);
        let mut level = self.level;
        let mut found = None;
        for _ in 0..ROUNDS {
            let mut all = &normal / level + &normal_of_known;
            (0..width).for_each(|at| all[(at, at)] += 1.0);
            let Some(factor) = all.cholesky() else {
                return Ok(None);
            };
            let step = factor.solve(&(&right / level + &right_of_known));
            let left = &residual - &jacobian * &step;
            let squares: Vec<f64> = (0..counts.len())
                .map(|row| {
                    let own = self.equations.of(row);
                    own.map(|equation| (left[equation] / self.equations.sigmas()[equation].max(super::SMALLEST_SIGMA)).powi(2))
                        .sum()
                })
                .collect();
            let now = robust::level(&squares, &counts);
            let now = if now > LEVEL && bound { now } else { 1.0 };
            let same = (now / level - 1.0).abs() < SETTLED;
            level = now;
            found = Some((step, left));
            if same {
                break;
            }
        }
        let Some((step, expected)) = found else {
            return Ok(None);
        };
        let mut start = super::Placed { sizes, sigma: problem.sigma_of_frames(), ..self.placed.clone() };
        start.features.truncate(problem.features.len());
        start.parameters.rows_mut(before, count).fill(0.0);
        let columns: Vec<usize> = (0..width).collect();
        let placed = problem.moved(&start, &columns, &step);
        problem.whiten(&placed);
        let residual = problem.residual(&placed);
        let off = self.whitening.of_vector(&(&residual - &expected)).norm_squared();
        if off > NEARLY_LINEAR * NEARLY_LINEAR * level * residual.len() as f64 {
            return Ok(None);
        }
        let distances = (of_known - &by_known * &step, by_known);
        let cost = self.whitening.of_vector(&residual).norm_squared()
            + level * (placed.parameters.norm_squared() + distances.0.norm_squared());
        Ok(Some(Geometry {
            placed,
            residual,
            jacobian,
            distances,
            level,
            cost,
            sigma: problem.sigma,
            group: problem.group,
            ..self.clone()
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{arm, readings, sensor};
    use super::super::{Readings, fit_at};
    use super::*;
    use crate::measurement::Measurement;
    use crate::seed::stream;

    /// A geometry that is relaxed is the one that is fitted with those priors.
    #[test]
    fn to_first_order_is_what_a_fit_finds() {
        let mut stream = stream(3, "test/relax");
        let arm = arm(6, &mut stream);
        for (wrong, orientation) in [(0.05, false), (0.05, true), (0.3, false)] {
            let rows = readings(&arm, 80, 1, wrong, 5e-5, &mut stream);
            let read: Vec<&Measurement> = rows.iter().collect();
            let sensor = sensor(orientation);
            let of = Readings::new(&sensor, &read, &[1.0; 80]);
            let loose = fit_at(&arm, of, Sizes::MANUFACTURING).unwrap();
            for sizes in
                [Sizes::NOMINAL, Sizes { zeros: 1.0, lengths: 0.0, turns: 0.0 }, Sizes { zeros: 0.3, lengths: 0.1, turns: 0.03 }]
            {
                let near = loose.relaxed(&arm, of, sizes).unwrap();
                let fitted = loose.refit(&arm, of, sizes).unwrap();
                let rms = |of: &DVector<f64>| of.norm() / libm::sqrt(of.len() as f64);
                let off = rms(&(&near.residual - &fitted.residual));
                assert!(off < 0.1 * rms(&fitted.residual), "{off} of {} {sizes:?}", rms(&fitted.residual));
                assert!((near.level / fitted.level - 1.0).abs() < 0.2, "{} {}", near.level, fitted.level);
            }
        }
    }
}
