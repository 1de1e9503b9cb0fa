//! Small dense symmetric algebra on row-major slices: what the searches do millions of times. Plain loops in a fixed order, so
//! that the bits do not depend on the processor's kernels.

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

/// Replaces the lower triangle of the row-major `n × n` matrix by its Cholesky factor; false (and rubble) where it is not
/// positive definite.
#[must_use]
pub fn cholesky(matrix: &mut [f64], n: usize) -> bool {
    for i in 0..n {
        let (above, from_i) = matrix.split_at_mut(i * n);
        let row_i = &mut from_i[..=i];
        let mut j = 0;
        // Four columns at a time share what is left of them.
        while j + 4 <= i {
            let lines = [j, j + 1, j + 2, j + 3].map(|j| &above[j * n..j * n + j + 1]);
            let dots = four_dots(&row_i[..j], lines.map(|line| &line[..lines[0].len() - 1]));
            for (lane, line) in lines.into_iter().enumerate() {
                let dot = (0..lane).fold(dots[lane], |dot, k| dot + row_i[j + k] * line[j + k]);
                row_i[j + lane] = (row_i[j + lane] - dot) / line[j + lane];
            }
            j += 4;
        }
        for j in j..i {
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

/// Solves `Lᵀ x = b` in place for the Cholesky factor `lower` (row-major `n × n`).
pub fn solve_lower_transposed(lower: &[f64], n: usize, right: &mut [f64]) {
    for i in (0..n).rev() {
        let row = &lower[i * n..=i * n + i];
        let value = right[i] / row[i];
        right[i] = value;
        for (entry, factor) in right[..i].iter_mut().zip(row) {
            *entry -= factor * value;
        }
    }
}

/// L⁻ᵀ (row-major, upper triangular) of the Cholesky factor `lower` (row-major `n × n`).
#[must_use]
pub fn inverse_transposed(lower: &[f64], n: usize) -> Vec<f64> {
    let mut columns = vec![0.0; n * n];
    for k in 0..n {
        let column = &mut columns[k * n..(k + 1) * n];
        column[k] = 1.0;
        for i in k..n {
            let row = &lower[i * n..=i * n + i];
            column[i] = (column[i] - dot(&row[k..i], &column[k..i])) / row[i];
        }
    }
    columns
}

/// The inverse (both triangles, row-major) of the matrix whose Cholesky factor is `lower`.
#[must_use]
pub fn inverse(lower: &[f64], n: usize) -> Vec<f64> {
    let columns = inverse_transposed(lower, n);
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

/// Writes `rows · matrix` to `product`: `rows` and `product` have `n` columns, `matrix` is `n × n`, all row-major.
pub fn multiply(rows: &[f64], matrix: &[f64], n: usize, product: &mut [f64]) {
    multiply_from(rows, matrix, n, product, |_| 0);
}

/// The same for an upper triangular `matrix`: half the work.
pub fn multiply_upper(rows: &[f64], matrix: &[f64], n: usize, product: &mut [f64]) {
    multiply_from(rows, matrix, n, product, |line| line);
}

/// `from`: where the first entry of four lines of `matrix` is that may not be zero.
#[inline(always)]
fn multiply_from(rows: &[f64], matrix: &[f64], n: usize, product: &mut [f64], from: impl Fn(usize) -> usize) {
    for (row, sums) in rows.chunks_exact(n).zip(product.chunks_exact_mut(n)) {
        sums.fill(0.0);
        let mut line = 0;
        while line + 4 <= n {
            let start = from(line);
            let [m0, m1, m2, m3] = [0, 1, 2, 3].map(|k| &matrix[(line + k) * n + start..(line + k + 1) * n]);
            let (x0, x1, x2, x3) = (row[line], row[line + 1], row[line + 2], row[line + 3]);
            for ((((sum, a), b), c), d) in sums[start..].iter_mut().zip(m0).zip(m1).zip(m2).zip(m3) {
                *sum += (x0 * a + x1 * b) + (x2 * c + x3 * d);
            }
            line += 4;
        }
        for line in line..n {
            for (sum, value) in sums.iter_mut().zip(&matrix[line * n..(line + 1) * n]) {
                *sum += row[line] * value;
            }
        }
    }
}

/// `vᵀ A v` for the symmetric matrix `a`, both triangles given.
#[must_use]
pub fn quadratic(a: &[f64], v: &[f64]) -> f64 {
    a.chunks_exact(v.len()).zip(v).map(|(row, value)| value * dot(row, v)).sum()
}

/// Writes the lower triangle of `rowsᵀ rows` (`rows` has `n` columns) to `gram`, row after row: n (n + 1) / 2 numbers.
pub fn packed_gram(rows: &[f64], n: usize, gram: &mut [f64]) {
    gram.fill(0.0);
    let threes = rows.chunks_exact(3 * n);
    let rest = threes.remainder();
    for three in threes {
        let (r0, others) = three.split_at(n);
        let (r1, r2) = others.split_at(n);
        let mut start = 0;
        for i in 0..n {
            let (c0, c1, c2) = (r0[i], r1[i], r2[i]);
            for (((sum, a), b), c) in gram[start..=start + i].iter_mut().zip(r0).zip(r1).zip(r2) {
                *sum += (c0 * a + c1 * b) + c2 * c;
            }
            start += i + 1;
        }
    }
    for row in rest.chunks_exact(n) {
        let mut start = 0;
        for i in 0..n {
            for (sum, value) in gram[start..=start + i].iter_mut().zip(row) {
                *sum += row[i] * value;
            }
            start += i + 1;
        }
    }
}

/// Inner products of `a` with four others of its length, in four interleaved sums each.
#[must_use]
pub fn four_dots(a: &[f64], others: [&[f64]; 4]) -> [f64; 4] {
    #[inline(always)]
    fn add(sums: &mut [f64; 4], a: &[f64; 4], b: &[f64; 4]) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let (whole, rest) = a.as_chunks::<4>();
    let [(w0, r0), (w1, r1), (w2, r2), (w3, r3)] = others.map(|other| other[..a.len()].as_chunks::<4>());
    let [mut s0, mut s1, mut s2, mut s3] = [[0.0; 4]; 4];
    for ((((a, b0), b1), b2), b3) in whole.iter().zip(w0).zip(w1).zip(w2).zip(w3) {
        add(&mut s0, a, b0);
        add(&mut s1, a, b1);
        add(&mut s2, a, b2);
        add(&mut s3, a, b3);
    }
    let rest_of = |other: &[f64]| rest.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    let sum = |[a, b, c, d]: [f64; 4]| (a + b) + (c + d);
    [sum(s0) + rest_of(r0), sum(s1) + rest_of(r1), sum(s2) + rest_of(r2), sum(s3) + rest_of(r3)]
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
        let expected = reference.l().transpose().solve_upper_triangular(&expected).unwrap();
        solve_lower_transposed(&gram, n, &mut right);
        assert!(right.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-11));
        assert!(!cholesky(&mut [1.0, 0.0, 2.0, 1.0], 2));
    }

    #[test]
    fn products_are_nalgebras() {
        let mut stream = stream(4, "test/dense/products");
        for (n, m) in [(1, 1), (2, 6), (13, 7), (36, 6)] {
            let rows: Vec<f64> = (0..m * n).map(|_| stream.uniform(-1.0, 1.0)).collect();
            let matrix: Vec<f64> = (0..n * n).map(|_| stream.uniform(-1.0, 1.0)).collect();
            let upper: Vec<f64> = (0..n * n).map(|at| if at % n >= at / n { matrix[at] } else { 0.0 }).collect();
            let left = DMatrix::from_row_slice(m, n, &rows);
            let mut product = vec![f64::NAN; m * n];
            multiply(&rows, &matrix, n, &mut product);
            let difference = DMatrix::from_row_slice(m, n, &product) - &left * DMatrix::from_row_slice(n, n, &matrix);
            assert!(difference.norm() < 1e-12);
            multiply_upper(&rows, &upper, n, &mut product);
            let difference = DMatrix::from_row_slice(m, n, &product) - &left * DMatrix::from_row_slice(n, n, &upper);
            assert!(difference.norm() < 1e-12);
            let mut packed = vec![f64::NAN; n * (n + 1) / 2];
            packed_gram(&rows, n, &mut packed);
            let gram = left.transpose() * &left;
            let expected = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|at| gram[at]);
            assert!(packed.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
            let others: [Vec<f64>; 4] = [0, 1, 2, 3].map(|k| (0..n).map(|i| (i + k) as f64).collect());
            let dots = four_dots(&rows[..n], [&others[0], &others[1], &others[2], &others[3]]);
            assert!(dots.iter().zip(&others).all(|(ours, other)| (ours - dot(&rows[..n], other)).abs() < 1e-11));
        }
    }
}
