//! Inner products of residuals, geometry and signatures: all that evidence needs, additive over rows, so that a fold of a
//! cross-validation is a subtraction.

use std::ops::Range;

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
    pub degrees_of_freedom: f64,
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
        let normal = self.products.view((0, 0), (count, count)).into_owned();
        let mixed = self.products.view((0, count), (count, rest)).into_owned();
        let absorbing = Absorbing::new(normal, mixed, offset, self.equations)?;
        let mut left = self.products.view((count, count), (rest, rest)).into_owned();
        left -= absorbing.mixed.transpose() * &absorbing.absorbed;
        let last = rest - 1;
        Some(Surviving {
            products: left.view((0, 0), (last, last)).into_owned(),
            with_residual: left.view((0, last), (last, 1)).column(0).into_owned(),
            residual: (left[(last, last)] + offset.norm_squared()).max(1e-12),
            degrees_of_freedom: absorbing.degrees_of_freedom,
            absorbed: absorbing.absorbed,
        })
    }
}

impl Surviving {
    /// Of the whitened rows `matrix`, with the products of signatures of the same one of `blocks` (ranges of columns) only, all others
    /// zero: what single effects need, at a fraction of the cost. `offset`: as in [`Gram::surviving`].
    #[must_use]
    pub fn of_blocks(
        matrix: &DMatrix<f64>,
        geometry: usize,
        offset: &DVector<f64>,
        blocks: impl Iterator<Item = Range<usize>>,
    ) -> Option<Surviving> {
        let last = matrix.ncols() - 1 - geometry;
        let (jacobian, rest) = (matrix.columns(0, geometry), matrix.columns(geometry, last + 1));
        let transposed = jacobian.transpose();
        let absorbing = Absorbing::new(&transposed * jacobian, &transposed * rest, offset, matrix.nrows() as f64)?;
        let product = |a: usize, b: usize| {
            rest.column(a).dot(&rest.column(b)) - absorbing.mixed.column(a).dot(&absorbing.absorbed.column(b))
        };
        let mut products = DMatrix::zeros(last, last);
        for block in blocks {
            for a in block.clone() {
                for b in block.clone() {
                    products[(a, b)] = product(a, b);
                }
            }
        }
        Some(Surviving {
            products,
            with_residual: DVector::from_fn(last, |column, _| product(column, last)),
            residual: (product(last, last) + offset.norm_squared()).max(1e-12),
            degrees_of_freedom: absorbing.degrees_of_freedom,
            absorbed: absorbing.absorbed,
        })
    }
}

/// What the geometry takes, given the inner products that it has part in.
struct Absorbing {
    /// Of geometry with signatures and residual, the prior's pull taken off the residual's.
    mixed: DMatrix<f64>,
    /// As in [`Surviving`].
    absorbed: DMatrix<f64>,
    /// Equations that it leaves.
    degrees_of_freedom: f64,
}

impl Absorbing {
    /// `normal`: inner products of the geometry; `mixed`: of the geometry with signatures and residual.
    fn new(mut normal: DMatrix<f64>, mut mixed: DMatrix<f64>, offset: &DVector<f64>, equations: f64) -> Option<Absorbing> {
        let (count, last) = (normal.ncols(), mixed.ncols() - 1);
        for column in 0..count {
            normal[(column, column)] += 1.0;
            mixed[(column, last)] -= offset[column];
        }
        let cholesky = Cholesky::new(normal)?;
        let absorbed = cholesky.solve(&mixed);
        let inverse = cholesky.inverse();
        let pinned: f64 = (0..count).map(|i| inverse[(i, i)]).sum();
        Some(Absorbing { mixed, absorbed, degrees_of_freedom: (equations - (count as f64 - pinned)).max(1.0) })
    }
}
