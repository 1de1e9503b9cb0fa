//! What makes equations alike in noise: one over sigma of each, and, where joints do not repeat, the inverse root of the covariance that
//! this gives to the equations of each row; times the root of the row's weight.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};

use crate::measurement::equations::Equations;

/// Whitens residuals, geometry and signatures alike.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// One over the sensor's sigma of each equation, times the root of its row's weight.
    diagonal: DVector<f64>,
    /// Weight of each row.
    weights: Vec<f64>,
    /// Of each row instead of the diagonal; empty where no joint scatters.
    blocks: Vec<DMatrix<f64>>,
    /// First equation of each row, and last how many there are.
    first: Vec<usize>,
}

impl Whitening {
    /// Sensor noise alone. `inverse_sigmas`: one over sigma of each of the `equations`; `weights`: of each row.
    #[must_use]
    pub fn new(equations: &Equations, mut inverse_sigmas: DVector<f64>, weights: &[f64]) -> Whitening {
        let mut first = vec![0];
        for (row, weight) in weights.iter().enumerate() {
            inverse_sigmas.rows_range_mut(equations.of(row)).apply(|value| *value *= libm::sqrt(*weight));
            first.push(equations.of(row).end);
        }
        Whitening { diagonal: inverse_sigmas, weights: weights.to_vec(), blocks: Vec::new(), first }
    }

    /// With errors beside the sensor's: of each row the displacements (m, rad) that one sigma of each of them makes.
    #[must_use]
    pub fn with(mut self, scattered: &[Vec<DVector<f64>>]) -> Whitening {
        let block = |(row, moved): (usize, &Vec<DVector<f64>>)| -> DMatrix<f64> {
            let own = self.diagonal.rows_range(self.equations_of(row)).into_owned();
            let mut covariance = DMatrix::identity(own.len(), own.len());
            for moved in moved {
                // A weight counts a row as more or less than one; it is no part of what its noise is.
                let moved = moved.component_mul(&own) / libm::sqrt(self.weights[row].max(1e-300));
                covariance += &moved * moved.transpose();
            }
            // Symmetric, so that directions stay what they are.
            let eigen = SymmetricEigen::new(covariance);
            let root = eigen.eigenvalues.map(|value| 1.0 / libm::sqrt(value));
            let axes = &eigen.eigenvectors;
            let entry = |i: usize, j: usize| (0..own.len()).map(|k| axes[(i, k)] * root[k] * axes[(j, k)]).sum::<f64>();
            DMatrix::from_fn(own.len(), own.len(), |i, j| entry(i, j) * own[j])
        };
        self.blocks = scattered.iter().enumerate().map(block).collect();
        self
    }

    /// Sensor noise alone, for the equations number `which` of all, which are `equations`.
    #[must_use]
    pub fn of_sensor(&self, equations: &Equations, which: &[usize]) -> Whitening {
        let mut first = vec![0];
        first.extend((0..equations.readings()).map(|row| equations.of(row).end));
        Whitening { diagonal: self.diagonal.select_rows(which), weights: self.weights.clone(), blocks: Vec::new(), first }
    }

    /// The equations of `row`.
    fn equations_of(&self, row: usize) -> Range<usize> {
        self.first[row]..self.first[row + 1]
    }

    /// Weight of each row.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The equations of `rows` of `matrix`, whitened.
    #[must_use]
    pub fn of_rows(&self, matrix: &DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
        let equations: Vec<usize> = rows.iter().flat_map(|row| self.equations_of(*row)).collect();
        let mut chosen = matrix.select_rows(&equations);
        if self.blocks.is_empty() {
            for mut column in chosen.column_iter_mut() {
                for (value, equation) in column.iter_mut().zip(&equations) {
                    *value *= self.diagonal[*equation];
                }
            }
        } else {
            let mut at = 0;
            for row in rows {
                let block = &self.blocks[*row];
                let count = block.nrows();
                for mut column in chosen.column_iter_mut() {
                    let own = block * column.rows(at, count);
                    column.rows_mut(at, count).copy_from(&own);
                }
                at += count;
            }
        }
        chosen
    }

    /// `matrix` (all equations), whitened.
    #[must_use]
    pub fn of(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        let rows: Vec<usize> = (0..self.weights.len()).collect();
        self.of_rows(matrix, &rows)
    }

    /// Whitens `matrix` (all equations) in place, and takes it times `factor`.
    pub fn apply_to(&self, matrix: &mut DMatrix<f64>, factor: f64) {
        for mut column in matrix.column_iter_mut() {
            if self.blocks.is_empty() {
                column.iter_mut().zip(self.diagonal.iter()).for_each(|(value, one)| *value *= one * factor);
                continue;
            }
            for (row, block) in self.blocks.iter().enumerate() {
                let mut own = column.rows_range_mut(self.equations_of(row));
                let whitened = block * &own * factor;
                own.copy_from(&whitened);
            }
        }
    }

    /// `vector` (all equations), whitened.
    #[must_use]
    pub fn of_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        if self.blocks.is_empty() {
            return vector.component_mul(&self.diagonal);
        }
        let values: Vec<f64> = (0..self.weights.len())
            .flat_map(|row| self.of_row(row, vector.rows_range(self.equations_of(row))).data.as_vec().clone())
            .collect();
        DVector::from_vec(values)
    }

    /// Whitens the equations of one row in place.
    pub fn apply(&self, row: usize, values: &mut [f64]) {
        match self.blocks.get(row) {
            Some(block) => {
                let whitened = block * DVectorView::from_slice(values, values.len());
                values.copy_from_slice(whitened.as_slice());
            }
            None => values.iter_mut().enumerate().for_each(|(at, value)| *value *= self.diagonal[self.first[row] + at]),
        }
    }

    /// The equations of one row, whitened.
    #[must_use]
    pub fn of_row(&self, row: usize, values: DVectorView<'_, f64>) -> DVector<f64> {
        match self.blocks.get(row) {
            Some(block) => block * values,
            None => values.component_mul(&self.diagonal.rows_range(self.equations_of(row))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measurement::{Measurement, Sensor};

    #[test]
    fn what_is_whitened_has_unit_covariance_over_its_weight() {
        let inverse = DVector::from_vec(vec![2.0, 3.0, 5.0, 1.0, 1.0, 1.0]);
        let moved = DVector::from_vec(vec![0.4, -0.1, 0.3]);
        let square = moved.map(|value| value * value);
        let sensor = Sensor {
            position_in_base: nalgebra::Point3::origin(),
            position_sigma_m: 1.0,
            position_sigma_per_m: 0.0,
            orientation_sigma_rad: None,
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: None,
        };
        let reading = Measurement::default();
        let equations = Equations::new(&sensor, &[&reading, &reading]);
        let whitening =
            Whitening::new(&equations, inverse.clone(), &[0.25, 1.0]).with(&[vec![moved.clone(), square.clone()], vec![]]);
        let own = DMatrix::from_diagonal(&inverse.rows(0, 3).map(|value| 1.0 / (value * value)));
        let covariance = own + &moved * moved.transpose() + &square * square.transpose();
        let mut all = DMatrix::identity(6, 6);
        all.view_mut((0, 0), (3, 3)).copy_from(&(covariance * 4.0));
        // W C, and W on its transpose again.
        let whitened = whitening.of(&whitening.of(&all).transpose());
        assert!((whitened - DMatrix::identity(6, 6)).norm() < 1e-12);
        let vector = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let as_matrix = whitening.of(&DMatrix::from_column_slice(6, 1, vector.as_slice()));
        let mut in_place = DMatrix::from_column_slice(6, 1, vector.as_slice());
        whitening.apply_to(&mut in_place, 0.5);
        assert!((in_place * 2.0 - &as_matrix).norm() < 1e-12);
        assert!((whitening.of_vector(&vector) - as_matrix.column(0)).norm() < 1e-12);
        assert!((whitening.of_rows(&all, &[1]) - whitening.of(&all).rows(3, 3)).norm() < 1e-12);
        let flat = Measurement { unread: [false, false, true], ..reading };
        let sensor = whitening.of_sensor(&Equations::new(&sensor, &[&flat, &flat]), &[0, 1, 3, 4]);
        assert_eq!(sensor.of_vector(&DVector::from_element(4, 1.0)).as_slice(), [1.0, 1.5, 1.0, 1.0]);
    }
}
