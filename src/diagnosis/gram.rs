//! Inner products of residuals, geometry and signatures: all that evidence needs, additive over rows, so that a fold of a
//! cross-validation is a subtraction.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Inner products of `[geometry | signatures | residual]`.
#[derive(Clone, Debug)]
pub struct Gram {
    /// All of them.
    pub products: DMatrix<f64>,
    /// Number of geometric parameters, first.
    pub geometry: usize,
    /// Equations.
    pub equations: f64,
}

/// What is left once the geometry has been fitted jointly: inner products of what survives of signatures and residual.
#[derive(Clone, Debug)]
pub struct Surviving {
    /// Of signatures.
    pub products: DMatrix<f64>,
    /// Of signatures and residual.
    pub with_residual: DVector<f64>,
    /// Of the residual with itself.
    pub residual: f64,
    /// Equations that the geometry leaves.
    pub freedom: f64,
    /// The geometry's change per unit of each signature and, last, of the residual: `(JᵀJ + 1)⁻¹ Jᵀ [S r]`.
    pub absorbed: DMatrix<f64>,
}

impl Gram {
    /// Of the whitened rows `matrix`. (A product of matrices is blocked and vectorised, `tr_mul` is neither.)
    #[must_use]
    pub fn new(matrix: &DMatrix<f64>, geometry: usize) -> Gram {
        Gram { products: matrix.transpose() * matrix, geometry, equations: matrix.nrows() as f64 }
    }

    /// Without the rows of `part`.
    #[must_use]
    pub fn without(&self, part: &Gram) -> Gram {
        Gram { products: &self.products - &part.products, geometry: self.geometry, equations: self.equations - part.equations }
    }

    /// Everything that the geometry can absorb taken out. `offset`: the prior's pull on each parameter (the fitted values over sigma,
    /// zero where free).
    #[must_use]
    pub fn surviving(&self, offset: &DVector<f64>) -> Option<Surviving> {
        let (count, rest) = (self.geometry, self.products.ncols() - self.geometry);
        let mut normal = self.products.view((0, 0), (count, count)).into_owned();
        for column in 0..count {
            normal[(column, column)] += 1.0;
        }
        let mut mixed = self.products.view((0, count), (count, rest)).into_owned();
        for column in 0..count {
            mixed[(column, rest - 1)] -= offset[column];
        }
        let cholesky = Cholesky::new(normal)?;
        let absorbed = cholesky.solve(&mixed);
        let mut left = self.products.view((self.geometry, self.geometry), (rest, rest)).into_owned();
        left -= mixed.transpose() * &absorbed;
        let inverse = cholesky.inverse();
        let pinned: f64 = (0..count).map(|i| inverse[(i, i)]).sum();
        let freedom = self.equations - (count as f64 - pinned);
        let last = rest - 1;
        let prior = offset.norm_squared();
        Some(Surviving {
            products: left.view((0, 0), (last, last)).into_owned(),
            with_residual: left.view((0, last), (last, 1)).column(0).into_owned(),
            residual: (left[(last, last)] + prior).max(1e-12),
            freedom: freedom.max(1.0),
            absorbed,
        })
    }
}
