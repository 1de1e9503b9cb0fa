//! Small dense symmetric algebra on row-major slices: what the searches do millions of times. Plain loops in a fixed order, so that
//! the bits do not depend on the processor's kernels.

/// Adds `factor · rowsᵀ rows` to the lower triangle of the row-major `n × n` matrix `gram`; `rows` has `n` columns.
pub fn add_gram(rows: &[f64], factor: f64, n: usize, gram: &mut [f64]) {
    if rows.len() == 6 * n {
        let (r0, rest) = rows.split_at(n);
        let (r1, rest) = rest.split_at(n);
        let (r2, rest) = rest.split_at(n);
        let (r3, rest) = rest.split_at(n);
        let (r4, r5) = rest.split_at(n);
        for i in 0..n {
            let [c0, c1, c2, c3, c4, c5] = [r0[i], r1[i], r2[i], r3[i], r4[i], r5[i]].map(|value| factor * value);
            let target = &mut gram[i * n..=i * n + i];
            let sources = r0.iter().zip(r1).zip(r2).zip(r3).zip(r4).zip(r5);
            for (sum, (((((a0, a1), a2), a3), a4), a5)) in target.iter_mut().zip(sources) {
                *sum += ((c0 * a0 + c1 * a1) + (c2 * a2 + c3 * a3)) + (c4 * a4 + c5 * a5);
            }
        }
    } else {
        for row in rows.chunks_exact(n) {
            for i in 0..n {
                let weight = factor * row[i];
                for (sum, value) in gram[i * n..=i * n + i].iter_mut().zip(row) {
                    *sum += weight * value;
                }
            }
        }
    }
}

/// Replaces the lower triangle of the row-major `n × n` matrix by its Cholesky factor; false (and rubble) where it is not positive
/// definite.
#[must_use]
pub fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    for i in 0..n {
        let (above, from_i) = matrix.split_at_mut(i * n);
        let row_i = &mut from_i[..=i];
        for j in 0..i {
            let row_j = &above[j * n..=j * n + j];
            let dot = dot(&row_i[..j], &row_j[..j]);
            row_i[j] = (row_i[j] - dot) / row_j[j];
        }
        let square = row_i[i] - dot(&row_i[..i], &row_i[..i]);
        if square.is_nan() || square <= 0.0 {
            return false;
        }
        row_i[i] = square.sqrt();
    }
    true
}

/// Inner product in four interleaved sums.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (chunks_a, chunks_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = chunks_a.remainder().iter().zip(chunks_b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in chunks_a.zip(chunks_b) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// Solves `L x = b` in place for the Cholesky factor `lower` (row-major `n × n`).
pub fn solve_lower(lower: &[f64], n: usize, right: &mut [f64]) {
    for i in 0..n {
        let row = &lower[i * n..=i * n + i];
        right[i] = (right[i] - dot(&row[..i], &right[..i])) / row[i];
    }
}

/// Logarithm of the determinant from the Cholesky factor.
#[must_use]
pub fn log_determinant(lower: &[f64], n: usize) -> f64 {
    // Products of a few at a time: a logarithm costs as much as many multiplications.
    (0..n).step_by(4).map(|start| libm::log((start..(start + 4).min(n)).map(|i| lower[i * n + i]).product::<f64>())).sum::<f64>()
        * 2.0
}

/// The inverse (both triangles, row-major) of the matrix whose Cholesky factor is `lower`.
#[must_use]
pub fn inverse(lower: &[f64], n: usize) -> Vec<f64> {
    // Rows of `columns` are the columns of L⁻¹.
    let mut columns = vec![0.0; n * n];
    for k in 0..n {
        let column = &mut columns[k * n..(k + 1) * n];
        column[k] = 1.0;
        for i in k..n {
            let row = &lower[i * n..=i * n + i];
            column[i] = (column[i] - dot(&row[k..i], &column[k..i])) / row[i];
        }
    }
    let mut inverse = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let value = dot(&columns[i * n + i..(i + 1) * n], &columns[j * n + i..(j + 1) * n]);
            inverse[i * n + j] = value;
            inverse[j * n + i] = value;
        }
    }
    inverse
}

/// Copies the lower triangle of the row-major `n × n` matrix to the upper.
pub fn mirror(matrix: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            matrix[j * n + i] = matrix[i * n + j];
        }
    }
}

/// `vᵀ A v` for the symmetric matrix `a`, both triangles given.
#[must_use]
pub fn quadratic(a: &[f64], v: &[f64]) -> f64 {
    a.chunks_exact(v.len()).zip(v).map(|(row, value)| value * dot(row, v)).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::seed::stream;

    #[test]
    fn factor_determinant_and_inverse_are_nalgebras() {
        let n = 13;
        let mut stream = stream(3, "test/dense");
        let rows: Vec<f64> = (0..n * (n + 4)).map(|_| stream.uniform(-1.0, 1.0)).collect();
        let mut gram = vec![0.0; n * n];
        add_gram(&rows, 2.0, n, &mut gram);
        let rows = DMatrix::from_row_slice(n + 4, n, &rows);
        let full = 2.0 * rows.transpose() * rows;
        assert!(cholesky(&mut gram, n));
        let reference = full.clone().cholesky().unwrap();
        for i in 0..n {
            for j in 0..=i {
                assert!((gram[i * n + j] - reference.l()[(i, j)]).abs() < 1e-12);
            }
        }
        assert!((log_determinant(&gram, n) - full.determinant().ln()).abs() < 1e-10);
        let inverse = DMatrix::from_row_slice(n, n, &inverse(&gram, n));
        assert!((inverse * &full - DMatrix::identity(n, n)).norm() < 1e-9);
        let mut right: Vec<f64> = (0..n).map(|i| i as f64).collect();
        let expected = reference.l().solve_lower_triangular(&nalgebra::DVector::from_vec(right.clone())).unwrap();
        solve_lower(&gram, n, &mut right);
        assert!(right.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-12));
        assert!(!cholesky(&mut [1.0, 0.0, 2.0, 1.0], 2));
    }
}
