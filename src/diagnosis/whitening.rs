//! What makes equations alike in noise: one over sigma of each, and, where joints do not repeat, the inverse root of the covariance that
//! this gives to the equations of each row; times the root of the row's weight.

use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};

/// Whitens residuals, geometry and signatures alike.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// One over the sensor's sigma of each equation, times the root of its row's weight.
    diagonal: DVector<f64>,
    /// Weight of each row.
    weights: Vec<f64>,
    /// Of each row instead of the diagonal; empty where no joint scatters.
    blocks: Vec<DMatrix<f64>>,
    /// Equations per row.
    per_row: usize,
}

impl Whitening {
    /// Sensor noise alone. `inverse_sigmas`: one over sigma of each equation; `weights`: of each row.
    #[must_use]
    pub fn new(mut inverse_sigmas: DVector<f64>, weights: &[f64]) -> Whitening {
        let per_row = inverse_sigmas.len() / weights.len().max(1);
        for (equation, value) in inverse_sigmas.iter_mut().enumerate() {
            *value *= libm::sqrt(weights[equation / per_row]);
        }
        Whitening { diagonal: inverse_sigmas, weights: weights.to_vec(), blocks: Vec::new(), per_row }
    }

    /// With errors beside the sensor's: of each row the displacements (m, rad) that one sigma of each of them makes.
    #[must_use]
    pub fn with(mut self, scattered: &[Vec<DVector<f64>>]) -> Whitening {
        let per_row = self.per_row;
        let block = |(row, moved): (usize, &Vec<DVector<f64>>)| -> DMatrix<f64> {
            let own = self.diagonal.rows(row * per_row, per_row).into_owned();
            let mut covariance = DMatrix::identity(per_row, per_row);
            for moved in moved {
                // A weight counts a row as more or less than one; it is no part of what its noise is.
                let moved = moved.component_mul(&own) / libm::sqrt(self.weights[row].max(1e-300));
                covariance += &moved * moved.transpose();
            }
            // Symmetric, so that directions stay what they are.
            let eigen = SymmetricEigen::new(covariance);
            let root = eigen.eigenvalues.map(|value| 1.0 / libm::sqrt(value));
            &eigen.eigenvectors * DMatrix::from_diagonal(&root) * eigen.eigenvectors.transpose() * DMatrix::from_diagonal(&own)
        };
        self.blocks = scattered.iter().enumerate().map(block).collect();
        self
    }

    /// The first `count` equations of each row, sensor noise alone.
    #[must_use]
    pub fn of_sensor(&self, count: usize) -> Whitening {
        let first = |at: usize| self.diagonal[at / count * self.per_row + at % count];
        let diagonal = DVector::from_fn(count * self.weights.len(), |at, _| first(at));
        Whitening { diagonal, weights: self.weights.clone(), blocks: Vec::new(), per_row: count }
    }

    /// Weight of each row.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The equations of `rows` of `matrix`, whitened.
    #[must_use]
    pub fn of_rows(&self, matrix: &DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
        let equations: Vec<usize> = rows.iter().flat_map(|row| row * self.per_row..(row + 1) * self.per_row).collect();
        let mut chosen = matrix.select_rows(&equations);
        if self.blocks.is_empty() {
            for mut column in chosen.column_iter_mut() {
                for (value, equation) in column.iter_mut().zip(&equations) {
                    *value *= self.diagonal[*equation];
                }
            }
        } else {
            for (at, row) in rows.iter().enumerate() {
                let own = &self.blocks[*row] * chosen.rows(at * self.per_row, self.per_row);
                chosen.rows_mut(at * self.per_row, self.per_row).copy_from(&own);
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

    /// `vector` (all equations), whitened.
    #[must_use]
    pub fn of_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        let rows = vector.as_slice().chunks(self.per_row).enumerate();
        let values: Vec<f64> = rows
            .flat_map(|(row, values)| {
                let whitened = self.of_row(row, DVectorView::from_slice(values, values.len()));
                whitened.iter().copied().collect::<Vec<f64>>()
            })
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
            None => values.iter_mut().enumerate().for_each(|(at, value)| *value *= self.diagonal[row * self.per_row + at]),
        }
    }

    /// The equations of one row, whitened.
    #[must_use]
    pub fn of_row(&self, row: usize, values: DVectorView<'_, f64>) -> DVector<f64> {
        match self.blocks.get(row) {
            Some(block) => block * values,
            None => values.component_mul(&self.diagonal.rows(row * self.per_row, self.per_row)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_whitened_has_unit_covariance_over_its_weight() {
        let inverse = DVector::from_vec(vec![2.0, 3.0, 5.0, 1.0, 1.0, 1.0]);
        let moved = DVector::from_vec(vec![0.4, -0.1, 0.3]);
        let square = moved.map(|value| value * value);
        let whitening = Whitening::new(inverse.clone(), &[0.25, 1.0]).with(&[vec![moved.clone(), square.clone()], vec![]]);
        let own = DMatrix::from_diagonal(&inverse.rows(0, 3).map(|value| 1.0 / (value * value)));
        let covariance = own + &moved * moved.transpose() + &square * square.transpose();
        let mut all = DMatrix::identity(6, 6);
        all.view_mut((0, 0), (3, 3)).copy_from(&(covariance * 4.0));
        // W C, and W on its transpose again.
        let whitened = whitening.of(&whitening.of(&all).transpose());
        assert!((whitened - DMatrix::identity(6, 6)).norm() < 1e-12);
        let vector = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let as_matrix = whitening.of(&DMatrix::from_column_slice(6, 1, vector.as_slice()));
        assert!((whitening.of_vector(&vector) - as_matrix.column(0)).norm() < 1e-12);
        assert!((whitening.of_rows(&all, &[1]) - whitening.of(&all).rows(3, 3)).norm() < 1e-12);
        let sensor = whitening.of_sensor(2);
        assert_eq!(sensor.of_vector(&DVector::from_element(4, 1.0)).as_slice(), [1.0, 1.5, 1.0, 1.0]);
    }
}
