//! Products of nalgebra's matrices, column by column in a fixed order, several sums side by side that the compiler keeps in vectors.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix};
use rayon::prelude::*;

/// Rows of a panel that stays in the cache while all its columns are multiplied with each other.
const PANEL: usize = 256;
/// Panels from which on they are shared out.
const MANY: usize = 8;

/// `matrixᵀ matrix`.
#[must_use]
pub fn gram(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = matrix.ncols();
    let mut gram = DMatrix::zeros(columns, columns);
    add_products(matrix, matrix, true, &mut gram);
    gram.fill_upper_triangle_with_lower_triangle();
    gram
}

/// `leftᵀ right`.
///
/// # Panics
/// If they have not as many rows.
#[must_use]
pub fn transposed_product(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(left.ncols(), right.ncols());
    add_products(left, right, false, &mut product);
    product
}

/// `left · right`.
///
/// # Panics
/// If their inner dimensions differ.
#[must_use]
pub fn product(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    transposed_product(&left.transpose(), right)
}

/// Adds `leftᵀ right` to `product`; only its lower triangle where `lower`.
fn add_products(left: &DMatrix<f64>, right: &DMatrix<f64>, lower: bool, product: &mut DMatrix<f64>) {
    assert_eq!(left.nrows(), right.nrows(), "a product of matrices");
    let rows = left.nrows();
    let (left, right) = (left.as_slice(), right.as_slice());
    let shape = product.shape();
    let panels: Vec<Range<usize>> = (0..rows).step_by(PANEL).map(|from| from..(from + PANEL).min(rows)).collect();
    if panels.len() < MANY {
        panels.into_iter().for_each(|panel| add_panel(left, right, rows, panel, lower, product));
        return;
    }
    // Each panel's own, added in order: the same sums as one after the other.
    let own: Vec<DMatrix<f64>> = panels
        .into_par_iter()
        .map(|panel| {
            let mut own = DMatrix::zeros(shape.0, shape.1);
            add_panel(left, right, rows, panel, lower, &mut own);
            own
        })
        .collect();
    own.iter().for_each(|own| *product += own);
}

/// Adds what the rows of `panel` have in it; `left` and `right` have `rows` of them.
fn add_panel(left: &[f64], right: &[f64], rows: usize, panel: Range<usize>, lower: bool, product: &mut DMatrix<f64>) {
    let (lefts, rights) = product.shape();
    let of = |column: usize| column * rows + panel.start..column * rows + panel.end;
    let mut j = 0;
    while j < rights {
        // Two by four columns at a time share what is loaded.
        let two = j + 1 < rights;
        let b0 = &right[of(j)];
        let b1 = &right[of(if two { j + 1 } else { j })];
        let mut i = if lower { j } else { 0 };
        while i + 4 <= lefts {
            let a = [0, 1, 2, 3].map(|k| &left[of(i + k)]);
            let sums = eight_dots(a, [b0, b1]);
            for k in 0..4 {
                product[(i + k, j)] += sums[0][k];
                if two {
                    product[(i + k, j + 1)] += sums[1][k];
                }
            }
            i += 4;
        }
        for i in i..lefts {
            let a = &left[of(i)];
            product[(i, j)] += super::dense::dot(a, b0);
            if two {
                product[(i, j + 1)] += super::dense::dot(a, b1);
            }
        }
        j += 2;
    }
}

/// Inner products of four columns with two, in two interleaved sums each.
#[inline]
fn eight_dots(a: [&[f64]; 4], b: [&[f64]; 2]) -> [[f64; 4]; 2] {
    let count = b[0].len();
    let [a0, a1, a2, a3] = a.map(|column| column[..count].as_chunks::<2>());
    let [b0, b1] = b.map(|column| column[..count].as_chunks::<2>());
    let mut sums = [[[0.0; 2]; 4]; 2];
    for (((((x0, x1), x2), x3), y0), y1) in a0.0.iter().zip(a1.0).zip(a2.0).zip(a3.0).zip(b0.0).zip(b1.0) {
        for lane in 0..2 {
            sums[0][0][lane] += x0[lane] * y0[lane];
            sums[0][1][lane] += x1[lane] * y0[lane];
            sums[0][2][lane] += x2[lane] * y0[lane];
            sums[0][3][lane] += x3[lane] * y0[lane];
            sums[1][0][lane] += x0[lane] * y1[lane];
            sums[1][1][lane] += x1[lane] * y1[lane];
            sums[1][2][lane] += x2[lane] * y1[lane];
            sums[1][3][lane] += x3[lane] * y1[lane];
        }
    }
    let rest = |x: &[f64], y: &[f64]| if x.is_empty() { 0.0 } else { x[0] * y[0] };
    let (rests_a, rests_b) = ([a0.1, a1.1, a2.1, a3.1], [b0.1, b1.1]);
    std::array::from_fn(|j| std::array::from_fn(|i| sums[j][i][0] + sums[j][i][1] + rest(rests_a[i], rests_b[j])))
}

/// Inverse of a positive definite matrix whose rows have different units; `None` where it is not positive definite.
#[must_use]
pub fn scaled_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|value| 1.0 / value.sqrt());
    let scaled =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)] * scale[row] * scale[column]);
    let inverse = Cholesky::new(scaled)?.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| inverse[(row, column)] * scale[row] * scale[column]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    #[test]
    fn products_are_nalgebras() {
        let mut stream = stream(1, "test/numerics");
        for (rows, left, right) in [(1, 1, 1), (7, 3, 5), (300, 13, 6), (600, 9, 2), (513, 4, 1), (3001, 9, 5)] {
            let a = DMatrix::from_fn(rows, left, |_, _| stream.normal());
            let b = DMatrix::from_fn(rows, right, |_, _| stream.normal());
            assert!((transposed_product(&a, &b) - a.transpose() * &b).norm() < 1e-10);
            assert!((gram(&a) - a.transpose() * &a).norm() < 1e-10);
            assert!((product(&a.transpose(), &b) - a.transpose() * &b).norm() < 1e-10);
        }
    }

    #[test]
    fn an_inverse_of_mixed_units_is_one() {
        let mut stream = stream(2, "test/numerics");
        let scale = [1e-6, 1.0, 1e5, 1e-3];
        let a = DMatrix::from_fn(10, 4, |_, column| scale[column] * stream.normal());
        let normal = gram(&a);
        let one = product(&normal, &scaled_inverse(&normal).unwrap());
        let off = DMatrix::from_fn(4, 4, |i, j| one[(i, j)] * scale[j] / scale[i]) - DMatrix::identity(4, 4);
        assert!(off.norm() < 1e-12, "{off}");
        assert!(scaled_inverse(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0])).is_none());
    }
}
