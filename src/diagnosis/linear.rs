//! The readings about the fitted geometry and the effects found so far: what geometry and any effects leave of them.

use nalgebra::DVector;

use super::evidence::Candidates;
use super::products::{GeometryPrior, Products};
use super::rows::Rows;
use crate::effects::signature::shape::Reading;
use crate::seed::stream;

/// A linear problem: rows, what may be in them, and what is measured minus what geometry alone predicts.
#[derive(Clone, Debug)]
pub(crate) struct Linear<'a> {
    /// Geometry fitted beside the effects found so far.
    pub(crate) rows: &'a Rows,
    /// The readings as signatures see them.
    pub(crate) readings: &'a [Reading],
    /// What may be there.
    pub(crate) candidates: &'a Candidates,
    /// Residual as it is with no effect taken out, to first order about those found so far, m and rad.
    pub(crate) residual: DVector<f64>,
    /// What is known of the geometry.
    pub(crate) prior: GeometryPrior,
}

impl<'a> Linear<'a> {
    /// `residual`: as in [`Linear::residual`]. `scale`: of the geometry's prior.
    #[must_use]
    pub(crate) fn new(
        rows: &'a Rows,
        readings: &'a [Reading],
        candidates: &'a Candidates,
        residual: DVector<f64>,
        scale: f64,
    ) -> Linear<'a> {
        let offset = DVector::from_fn(rows.jacobian.ncols(), |at, _| if rows.free[at] { 0.0 } else { rows.parameters[at] });
        let prior = GeometryPrior { offset, free: rows.free.clone(), scale, known: rows.known.clone() };
        Linear { rows, readings, candidates, residual, prior }
    }

    /// Inner products by fold.
    #[must_use]
    pub(crate) fn products(&self, fold: &[usize], folds: usize) -> Products {
        Products::new(self.rows, self.readings, self.candidates, &self.residual, fold, folds)
    }

    /// Inner products of `most` rows that stand for all, drawn by lot: a plan may take sides or payloads in turn.
    #[must_use]
    pub(crate) fn thinned(&self, most: usize) -> Products {
        let mut order: Vec<usize> = (0..self.count()).collect();
        stream(0, "diagnosis/thinned").shuffle(&mut order);
        let kept = most.clamp(1, self.count());
        let mut fold = vec![1; self.count()];
        order[..kept].iter().for_each(|row| fold[*row] = 0);
        let count = self.count() as f64 / kept as f64;
        Products::counted(self.rows, self.readings, self.candidates, &self.residual, &fold, 1, count)
    }

    /// Rows.
    #[must_use]
    pub(crate) fn count(&self) -> usize {
        self.readings.len()
    }

    /// What the signatures with these coefficients (column and value) do to each equation, m and rad.
    #[must_use]
    pub(crate) fn made(&self, coefficients: &[(usize, f64)]) -> DVector<f64> {
        let orientation = self.rows.equations.has_orientation();
        let mut made = DVector::zeros(self.residual.len());
        for (hypothesis, of) in self.candidates.hypotheses.iter().enumerate() {
            let columns = self.candidates.columns(hypothesis);
            let values: Vec<(usize, f64)> = coefficients
                .iter()
                .filter(|(column, value)| columns.contains(column) && *value != 0.0)
                .map(|(column, value)| (column - columns.start, *value))
                .collect();
            if values.is_empty() {
                continue;
            }
            for (row, reading) in self.readings.iter().enumerate() {
                let moved = of.shape.columns(reading, orientation);
                for (at, value) in &values {
                    let factor = value * self.candidates.unit[hypothesis] * of.spread[*at];
                    for (equation, moved) in self.rows.equations.of(row).zip(self.rows.read(row, &moved[*at])) {
                        made[equation] += moved * factor;
                    }
                }
            }
        }
        made
    }

    /// What is left with the geometry changed by `geometry` and with effects that do `made`, m and rad.
    #[must_use]
    pub(crate) fn left(&self, geometry: &DVector<f64>, made: &DVector<f64>) -> DVector<f64> {
        &self.residual - &self.rows.jacobian * geometry - made
    }

    /// The sum of squares of the positions of `rows` (m²) with the geometry changed by `geometry` and with effects that do `made`.
    #[must_use]
    pub(crate) fn squares(&self, rows: &[usize], geometry: &DVector<f64>, made: &DVector<f64>) -> f64 {
        let mut sum = 0.0;
        for row in rows {
            for equation in self.rows.equations.of_position(*row) {
                let moved = self.rows.jacobian.row(equation).iter().zip(geometry.iter()).map(|(a, b)| a * b).sum::<f64>();
                let left = self.residual[equation] - moved - made[equation];
                sum += left * left;
            }
        }
        sum
    }

    /// `values` (m, rad) in sigmas, times the root of each row's weight.
    #[must_use]
    pub(crate) fn in_sigmas(&self, values: &DVector<f64>) -> DVector<f64> {
        self.rows.whitening.of_vector(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::products::Marginal;
    use crate::diagnosis::tests::{hypothesis, with_analysis};
    use crate::effects::Kind;

    #[test]
    fn what_effects_do_adds_up_and_is_that_of_their_signatures() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let (linear, candidates) = (analysis.linear, analysis.evidence.candidates);
                let number = hypothesis(&analysis, Some(Kind::Backlash), 3);
                let [a, b] = [candidates.first[number], candidates.first[hypothesis(&analysis, Some(Kind::JointCompliance), 4)]];
                let together = linear.made(&[(a, 0.3), (b, -1.2)]);
                let apart = linear.made(&[(a, 0.3)]) + linear.made(&[(b, -1.2)]);
                assert!((&together - &apart).norm() < 1e-12 * together.norm());
                // A coefficient of one is one unit of the kind: half a width at the joint, over the lever of the target.
                let made = linear.made(&[(a, 1.0)]);
                for (row, reading) in linear.readings.iter().enumerate() {
                    let axis = reading.posture.axes[2];
                    let lever = axis.cross(&(reading.target - reading.posture.origins[2])).norm();
                    let expected = 0.5 * candidates.unit[number] * lever;
                    assert!((made.rows_range(linear.rows.equations.of(row)).norm() / expected - 1.0).abs() < 1e-9);
                }
                // What is left of all rows is what the squares count.
                let geometry = DVector::from_element(linear.rows.jacobian.ncols(), 0.01);
                let rows: Vec<usize> = (0..linear.count()).collect();
                let left = linear.left(&geometry, &together);
                assert!((linear.squares(&rows, &geometry, &together) / left.norm_squared() - 1.0).abs() < 1e-9);
                assert!((linear.in_sigmas(&left).norm() * crate::diagnosis::tests::SIGMA / left.norm() - 1.0).abs() < 1e-9);
            },
        );
    }

    /// As many rows as there are stand for themselves; half of them, counted twice, tell about as much.
    #[test]
    fn rows_that_stand_for_all_tell_as_much() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let linear = analysis.linear;
                let number = hypothesis(&analysis, Some(Kind::Backlash), 3);
                let information = |most: usize| {
                    let products = linear.thinned(most);
                    Marginal::new(&products, None, &linear.prior).unwrap().information(number)
                };
                let whole = analysis.evidence.marginal.information(number);
                assert!((information(linear.count()) / whole - 1.0).abs() < 1e-6);
                assert!((0.3..1.7).contains(&(information(linear.count() / 2) / whole)));
            },
        );
    }
}
