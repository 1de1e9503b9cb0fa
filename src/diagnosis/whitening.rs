//! What makes equations alike in noise: one over sigma of each, and, where joints do not repeat, the inverse root of the covariance that
//! this gives to the equations of each row.

use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};

/// Whitens residuals, geometry and signatures alike.
#[derive(Clone, Debug)]
pub struct Whitening {
    /// One over sigma of each equation, times the root of its row's weight.
    pub diagonal: DVector<f64>,
    /// Of each row instead of that: the inverse root of its covariance. Empty where no joint scatters.
    blocks: Vec<DMatrix<f64>>,
    /// Equations per row.
    per_row: usize,
}

impl Whitening {
    /// Sensor noise alone; `diagonal` as in [`Whitening::diagonal`].
    #[must_use]
    pub fn new(diagonal: DVector<f64>, per_row: usize) -> Whitening {
        Whitening { diagonal, blocks: Vec::new(), per_row }
    }

    /// With errors beside the sensor's: of each row the displacements (m, rad) that one sigma of each of them makes.
    #[must_use]
    pub fn with(mut self, scattered: &[Vec<DVector<f64>>]) -> Whitening {
        let per_row = self.per_row;
        let block = |(row, moved): (usize, &Vec<DVector<f64>>)| -> DMatrix<f64> {
            let own = self.diagonal.rows(row * per_row, per_row).into_owned();
            let whitened: Vec<DVector<f64>> = moved.iter().map(|moved| moved.component_mul(&own)).collect();
            let mut covariance = DMatrix::identity(per_row, per_row);
            for moved in &whitened {
                covariance += moved * moved.transpose();
            }
            // Symmetric, so that directions stay what they are.
            let eigen = SymmetricEigen::new(covariance);
            let root = eigen.eigenvalues.map(|value| 1.0 / libm::sqrt(value));
            &eigen.eigenvectors * DMatrix::from_diagonal(&root) * eigen.eigenvectors.transpose() * DMatrix::from_diagonal(&own)
        };
        self.blocks = scattered.iter().enumerate().map(block).collect();
        self
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
        if !self.blocks.is_empty() {
            let rows: Vec<usize> = (0..self.blocks.len()).collect();
            return self.of_rows(matrix, &rows);
        }
        let mut result = matrix.clone();
        for mut column in result.column_iter_mut() {
            column.component_mul_assign(&self.diagonal);
        }
        result
    }

    /// `vector` (all equations), whitened.
    #[must_use]
    pub fn of_vector(&self, vector: &DVector<f64>) -> DVector<f64> {
        if self.blocks.is_empty() {
            return vector.component_mul(&self.diagonal);
        }
        let mut result = DVector::zeros(vector.len());
        for row in 0..self.blocks.len() {
            let first = row * self.per_row;
            result.rows_mut(first, self.per_row).copy_from(&self.of_row(row, vector.rows(first, self.per_row)));
        }
        result
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
    fn what_is_whitened_has_unit_covariance() {
        let diagonal = DVector::from_vec(vec![2.0, 3.0, 5.0, 1.0, 1.0, 1.0]);
        let moved = DVector::from_vec(vec![0.4, -0.1, 0.3]);
        let whitening =
            Whitening::new(diagonal.clone(), 3).with(&[vec![moved.clone(), moved.map(|value| value * value)], vec![]]);
        let own = DMatrix::from_diagonal(&diagonal.rows(0, 3).map(|value| 1.0 / (value * value)));
        let square = moved.map(|value| value * value);
        let covariance = own + &moved * moved.transpose() + &square * square.transpose();
        let mut all = DMatrix::identity(6, 6);
        all.view_mut((0, 0), (3, 3)).copy_from(&covariance);
        // W C, and W on its transpose again.
        let whitened = whitening.of(&whitening.of(&all).transpose());
        assert!((whitened - DMatrix::identity(6, 6)).norm() < 1e-12);
        let vector = DVector::from_vec(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let as_matrix = whitening.of(&DMatrix::from_column_slice(6, 1, vector.as_slice()));
        assert!((whitening.of_vector(&vector) - as_matrix.column(0)).norm() < 1e-12);
        assert!((whitening.of_rows(&all, &[1]) - whitening.of(&all).rows(3, 3)).norm() < 1e-12);
    }
}
