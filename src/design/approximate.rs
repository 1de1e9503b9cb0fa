//! Optimal approximate designs: weights on candidate configurations instead of a choice of some, with a bound that tells how far
//! from the optimum they are at most. An approximate design is what no choice of the same size can beat.
//!
//! Candidate i has a block Xᵢ ([`Blocks`]), a design weights w ≥ 0 that add up to one, and the information per pose M(w) =
//! Σ wᵢ XᵢᵀXᵢ. Both criteria are convex, and both have one number per candidate, its sensitivity sᵢ, whose weighted mean is known
//! and whose largest value bounds the optimum: for D the dᵢ = tr(Xᵢ M⁻¹ Xᵢᵀ) with Σ wᵢ dᵢ = rank (Kiefer and Wolfowitz, "The
//! equivalence of two extremum problems", Canadian Journal of Mathematics 12, 1960; for blocks Fedorov, "Theory of Optimal
//! Experiments", 1972, chapter 5), for L the φᵢ = tr(Xᵢ M⁻¹ L M⁻¹ Xᵢᵀ) with Σ wᵢ φᵢ = tr(L M⁻¹) (Fedorov, 1972,
//! section 2.9). The gap is `max sᵢ / Σ wᵢ sᵢ − 1`, and a design of invertible M is optimal if it is zero.
//!
//! **Gap for D.** Let M\* be optimal and λ the r eigenvalues of M⁻¹M\*. By the inequality of the means, (det M\*/det M)^(1/r) =
//! (Π λ)^(1/r) ≤ Σ λ / r = Σ w\*ᵢ dᵢ / r ≤ max dᵢ / r = 1 + gap. Therefore log det M\* ≤ log det M + r log(1 + gap), which is
//! tighter than log det M + max dᵢ − r of the tangent, because log(1 + x) ≤ x.
//!
//! **Gap for L.** Let L = KKᵀ and f = tr(L M⁻¹). By the inequality of Cauchy and Schwarz for ⟨A, B⟩ = tr(AᵀB) with A = M\*^(−½) K
//! and B = M\*^(½) M⁻¹ K, f² = ⟨A, B⟩² ≤ tr(L M\*⁻¹) · tr(L M⁻¹ M\* M⁻¹) = f\* · Σ w\*ᵢ φᵢ ≤ f\* · max φᵢ. Therefore f\* ≥
//! f² / max φᵢ = f / (1 + gap), which is tighter than the tangent's 2f − max φᵢ: the difference is (max φᵢ − f)² / max φᵢ.
//!
//! **How.** Newton's method on a few candidates at a time. Without its constraint Σ w = 1 the problem is to minimise
//! −log det M + r Σ w (or tr(L M⁻¹) + f Σ w), whose minimum over w ≥ 0 is the same up to a scale. Its quadratic model is
//! minimised over w ≥ 0 for the candidates that carry weight and those with the largest sensitivities (block principal pivoting:
//! Portugal, Júdice and Vicente, Mathematics of Computation 63, 1994), then the model's minimum is approached as far as the
//! criterion falls. The sensitivities of all candidates are one pass over their Gram matrices, taken once in coordinates that
//! make the uniform design's information the identity. The reported numbers are computed afresh from the blocks, however the
//! weights were found.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use crate::numerics::dense::{
    add_gram, cholesky, dot, four_dots, inverse_transposed, log_determinant, multiply, multiply_upper, packed_gram, solve_lower,
    solve_lower_transposed,
};
use crate::quality::information::Blocks;

/// What a design is optimal for.
#[derive(Clone, Copy, Debug)]
pub enum Criterion<'a> {
    /// The largest log det M: the smallest ellipsoid of confidence of the parameters.
    D,
    /// The smallest tr(L M⁻¹), for a symmetric positive semidefinite L (rank × rank). With L the mean of PᵀP over a workspace, P
    /// the rows that turn parameters into a prediction, it is the mean variance of predictions (I-optimality).
    L(&'a [f64]),
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Gap that is good enough.
    pub gap: f64,
    /// Newton steps at most.
    pub max_iterations: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings { gap: 1e-3, max_iterations: 200 }
    }
}

/// Weights on candidates, and what is known about the optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct ApproximateDesign {
    /// A weight per candidate: none is negative, their sum is one.
    pub weights: Vec<f64>,
    /// The criterion at these weights: log det M, or tr(L M⁻¹).
    pub value: f64,
    /// What no weights on these candidates can beat: an upper bound of log det M, or a lower bound of tr(L M⁻¹).
    pub bound: f64,
    /// Largest sensitivity over the weighted mean, less one. (det M)^(1/rank), or 1 / tr(L M⁻¹), is at least 1 / (1 + gap) of the
    /// best.
    pub gap: f64,
    /// Newton steps made.
    pub iterations: usize,
    /// Whether the gap is the settings' or less.
    pub converged: bool,
    /// M of these weights (rank × rank, both triangles): the information per pose. The other numbers are as exact as its
    /// condition allows.
    pub information: Vec<f64>,
}

/// No design could be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ApproximateError {
    /// No weights make the information invertible.
    #[error("the {candidates} candidate configurations together determine {rank} of the {columns} parameters only")]
    RankDeficient {
        /// Number of candidates.
        candidates: usize,
        /// Parameters that all candidates together determine.
        rank: usize,
        /// Parameters to be determined.
        columns: usize,
    },
    /// A block or L has infinite or undefined numbers.
    #[error("a candidate's information or the criterion's matrix is not finite")]
    NotFinite,
    /// L has a negative eigenvalue.
    #[error("the criterion's matrix is not positive semidefinite")]
    NotSemidefinite,
}

/// Weights on the candidates of `blocks` that are optimal up to the settings' gap. The same bits for any number of threads.
///
/// # Errors
/// If the candidates together do not determine all parameters, numbers are not finite, or L is not positive semidefinite.
///
/// # Panics
/// If L is not rank × rank.
pub fn optimise(blocks: &Blocks, criterion: Criterion<'_>, settings: &Settings) -> Result<ApproximateDesign, ApproximateError> {
    let n = blocks.rank();
    if let Criterion::L(matrix) = criterion {
        assert_eq!(matrix.len(), n * n, "L is rank × rank");
        if !matrix.iter().all(|entry| entry.is_finite()) {
            return Err(ApproximateError::NotFinite);
        }
    }
    let pool = Pool::new(blocks)?;
    let matrix = match criterion {
        Criterion::D => None,
        Criterion::L(matrix) => Some(symmetrically_transformed(matrix, &pool.whitening, n)),
    };
    let (weights, iterations) = search(&pool, matrix.as_deref(), settings)?;
    certify(blocks, criterion, settings, weights, iterations).ok_or(ApproximateError::NotFinite)
}

impl ApproximateDesign {
    fn rank(&self) -> f64 {
        self.information.len().isqrt() as f64
    }

    /// What no set of `poses` candidates can beat, repeated ones allowed, where its information is the sum over its poses: an
    /// upper bound of its log det, or a lower bound of its tr(L M⁻¹). It is `poses` times the information of weights, after all.
    #[must_use]
    pub fn bound_of_set(&self, criterion: Criterion<'_>, poses: usize) -> f64 {
        let poses = poses as f64;
        match criterion {
            Criterion::D => self.bound + self.rank() * libm::log(poses),
            Criterion::L(_) => self.bound / poses,
        }
    }

    /// Efficiency that a set of `poses` candidates has at least, if `value` is the log det of its information, or its tr(L M⁻¹):
    /// 1 if no set can be better; (det M)^(1/rank), or 1 / tr(L M⁻¹), over the bound's.
    #[must_use]
    pub fn efficiency_of_set(&self, criterion: Criterion<'_>, poses: usize, value: f64) -> f64 {
        let bound = self.bound_of_set(criterion, poses);
        match criterion {
            Criterion::D => libm::exp((value - bound) / self.rank()),
            Criterion::L(_) => bound / value,
        }
    }

    /// Sensitivities of `candidates`, of the pool or further ones, over their weighted mean. Adding a candidate to the pool
    /// improves the optimum only if it has more than one. If none of a continuum has more than `1 + g`, then `g` is the gap over
    /// that continuum.
    ///
    /// # Panics
    /// If a candidate has another rank than the design, or L is not rank × rank.
    #[must_use]
    pub fn sensitivities(&self, criterion: Criterion<'_>, candidates: &Blocks) -> Vec<f64> {
        let n = candidates.rank();
        assert_eq!(self.information.len(), n * n, "candidates have the design's rank");
        let mut factor = self.information.clone();
        if !cholesky(&mut factor, n) {
            return vec![f64::INFINITY; candidates.len()];
        }
        let (sensitivities, mean) = sensitivities(candidates, criterion, &factor);
        sensitivities.into_iter().map(|sensitivity| relative(sensitivity, mean)).collect()
    }
}

/// A sensitivity over the mean, where the mean may be zero: if L is, any design is optimal.
fn relative(sensitivity: f64, mean: f64) -> f64 {
    if mean > 0.0 {
        sensitivity / mean
    } else if sensitivity > 0.0 {
        f64::INFINITY
    } else {
        1.0
    }
}

/// The design of `weights` with everything computed from `blocks`; none where the information is singular.
fn certify(
    blocks: &Blocks,
    criterion: Criterion<'_>,
    settings: &Settings,
    weights: Vec<f64>,
    iterations: usize,
) -> Option<ApproximateDesign> {
    let n = blocks.rank();
    let mut information = vec![0.0; n * n];
    for (block, weight) in blocks.iter().zip(&weights) {
        if *weight > 0.0 {
            add_gram(block, *weight, n, &mut information);
        }
    }
    let mut factor = information.clone();
    if !cholesky(&mut factor, n) {
        return None;
    }
    for i in 0..n {
        for j in 0..i {
            information[j * n + i] = information[i * n + j];
        }
    }
    let (sensitivities, mean) = sensitivities(blocks, criterion, &factor);
    let largest = sensitivities.into_iter().fold(0.0, f64::max);
    // The mean of the sensitivities is at most their largest, but for rounding.
    let ratio = relative(largest, mean).max(1.0);
    let (value, bound) = match criterion {
        Criterion::D => {
            let value = log_determinant(&factor, n);
            (value, value + n as f64 * libm::log(ratio))
        }
        Criterion::L(_) => (mean, mean / ratio),
    };
    let gap = ratio - 1.0;
    Some(ApproximateDesign { weights, value, bound, gap, iterations, converged: gap <= settings.gap, information })
}

/// Sensitivities of `blocks` where M has the Cholesky factor `factor`, and their weighted mean: the rank, or tr(L M⁻¹).
fn sensitivities(blocks: &Blocks, criterion: Criterion<'_>, factor: &[f64]) -> (Vec<f64>, f64) {
    let n = blocks.rank();
    let transform = inverse_transposed(factor, n);
    let matrix = match criterion {
        Criterion::D => None,
        Criterion::L(matrix) => {
            assert_eq!(matrix.len(), n * n, "L is rank × rank");
            Some(symmetrically_transformed(matrix, &transform, n))
        }
    };
    let of = |(rows, more): &mut (Vec<f64>, Vec<f64>), index: usize| {
        multiply_upper(blocks.get(index), &transform, n, rows);
        match &matrix {
            None => dot(rows, rows),
            Some(matrix) => {
                multiply(rows, matrix, n, more);
                dot(rows, more)
            }
        }
    };
    let scratch = || (vec![0.0; blocks.size()], vec![0.0; blocks.size()]);
    let sensitivities = (0..blocks.len()).into_par_iter().with_min_len(SHARE).map_init(scratch, of).collect();
    let mean = matrix.map_or(n as f64, |matrix| trace(&matrix, n));
    (sensitivities, mean)
}

/// Vᵀ A V for a symmetric `matrix` A and an upper triangular `transform` V (row-major `n × n`).
fn symmetrically_transformed(matrix: &[f64], transform: &[f64], n: usize) -> Vec<f64> {
    let mut half = vec![0.0; n * n];
    multiply_upper(matrix, transform, n, &mut half);
    let mut product = vec![0.0; n * n];
    multiply_upper(&transposed(&half, n), transform, n, &mut product);
    product
}

fn transposed(matrix: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|at| matrix[at % n * n + at / n]).collect()
}

fn trace(matrix: &[f64], n: usize) -> f64 {
    (0..n).map(|i| matrix[i * n + i]).sum()
}

/// Candidates that a thread takes at least at a time.
const SHARE: usize = 64;

/// The candidates in coordinates in which the uniform design's information is the identity. That design stands behind the last
/// candidate as one more, so that the search has where to start and never lacks information.
struct Pool {
    n: usize,
    count: usize,
    /// Numbers of a block.
    size: usize,
    /// V with XV the block in these coordinates (upper triangular).
    whitening: Vec<f64>,
    /// The blocks, then the identity.
    rows: Vec<f64>,
    /// Lower triangles of their Gram matrices.
    grams: Vec<f64>,
}

impl Pool {
    fn new(blocks: &Blocks) -> Result<Pool, ApproximateError> {
        let (n, count, size) = (blocks.rank(), blocks.len(), blocks.size());
        let packed = n * (n + 1) / 2;
        let deficient = |rank| ApproximateError::RankDeficient { candidates: count, rank, columns: n };
        if n == 0 || count == 0 {
            return Err(deficient(0));
        }
        // In shares, which are then added in their order, so that the bits do not depend on the threads.
        let shares: Vec<Vec<f64>> = (0..count.div_ceil(SHARE))
            .into_par_iter()
            .map(|share| {
                let (mut sum, mut gram) = (vec![0.0; packed], vec![0.0; packed]);
                for index in share * SHARE..((share + 1) * SHARE).min(count) {
                    packed_gram(blocks.get(index), n, &mut gram);
                    sum.iter_mut().zip(&gram).for_each(|(sum, value)| *sum += value);
                }
                sum
            })
            .collect();
        let mut uniform = vec![0.0; packed];
        for share in &shares {
            uniform.iter_mut().zip(share).for_each(|(sum, value)| *sum += value / count as f64);
        }
        if !uniform.iter().all(|entry| entry.is_finite()) {
            return Err(ApproximateError::NotFinite);
        }
        let mut factor = unpacked(&uniform, n);
        let rank = numerical_rank(&factor, n);
        if rank < n || !cholesky(&mut factor, n) {
            return Err(deficient(rank));
        }
        let whitening = inverse_transposed(&factor, n);
        let mut rows = vec![0.0; count * size + n * n];
        let mut grams = vec![0.0; (count + 1) * packed];
        rows.par_chunks_mut(size).zip(grams.par_chunks_mut(packed)).take(count).with_min_len(SHARE).enumerate().for_each(
            |(index, (rows, gram))| {
                multiply_upper(blocks.get(index), &whitening, n, rows);
                packed_gram(rows, n, gram);
            },
        );
        for i in 0..n {
            rows[count * size + i * n + i] = 1.0;
        }
        packed_gram(&rows[count * size..], n, &mut grams[count * packed..]);
        Ok(Pool { n, count, size, whitening, rows, grams })
    }

    fn rows(&self, index: usize) -> &[f64] {
        if index < self.count {
            &self.rows[index * self.size..(index + 1) * self.size]
        } else {
            &self.rows[self.count * self.size..]
        }
    }

    fn gram(&self, index: usize) -> &[f64] {
        let packed = self.n * (self.n + 1) / 2;
        &self.grams[index * packed..(index + 1) * packed]
    }

    /// Σ wᵢ Gᵢ, packed, over `set`.
    fn information(&self, set: &[usize], weights: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.n * (self.n + 1) / 2];
        for (index, weight) in set.iter().zip(weights) {
            if *weight != 0.0 {
                sum.iter_mut().zip(self.gram(*index)).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        sum
    }

    /// tr(S Gᵢ) of all, the uniform design last, where `slope` is a point's S.
    fn sensitivities(&self, slope: &[f64]) -> Vec<f64> {
        let packed = self.n * (self.n + 1) / 2;
        let mut sensitivities = vec![0.0; self.count + 1];
        sensitivities.par_chunks_mut(4).zip(self.grams.par_chunks(4 * packed)).with_min_len(SHARE / 4).for_each(
            |(four, grams)| {
                if four.len() == 4 {
                    let (first, second) = grams.split_at(2 * packed);
                    let ((a, b), (c, d)) = (first.split_at(packed), second.split_at(packed));
                    four.copy_from_slice(&four_dots(slope, [a, b, c, d]));
                } else {
                    four.iter_mut().zip(grams.chunks_exact(packed)).for_each(|(one, gram)| *one = dot(slope, gram));
                }
            },
        );
        sensitivities
    }
}

fn unpacked(packed: &[f64], n: usize) -> Vec<f64> {
    let mut full = vec![0.0; n * n];
    let mut start = 0;
    for i in 0..n {
        for j in 0..=i {
            full[i * n + j] = packed[start + j];
            full[j * n + i] = packed[start + j];
        }
        start += i + 1;
    }
    full
}

/// Rank of a positive semidefinite matrix (row-major `n × n`) by Cholesky's method with the largest pivot first, its columns
/// scaled to one: pivots of the size of rounding count as zero.
fn numerical_rank(matrix: &[f64], n: usize) -> usize {
    let scale: Vec<f64> = (0..n).map(|i| if matrix[i * n + i] > 0.0 { 1.0 / matrix[i * n + i].sqrt() } else { 0.0 }).collect();
    let mut rest: Vec<f64> = (0..n * n).map(|at| matrix[at] * scale[at / n] * scale[at % n]).collect();
    let mut left: Vec<usize> = (0..n).collect();
    let floor = 16.0 * n as f64 * f64::EPSILON;
    while let Some((position, pivot)) = left
        .iter()
        .map(|&i| rest[i * n + i])
        .enumerate()
        .max_by(|(_, a), (_, b)| a.total_cmp(b))
        .filter(|(_, pivot)| *pivot > floor)
    {
        let k = left.swap_remove(position);
        for &i in &left {
            let factor = rest[i * n + k] / pivot;
            for &j in &left {
                rest[i * n + j] -= factor * rest[k * n + j];
            }
        }
    }
    n - left.len()
}

/// What the criterion is at some weights, in a pool's coordinates.
struct Point {
    /// S such that a candidate's sensitivity is tr(S G): packed lower triangle, what is beside the diagonal twice.
    slope: Vec<f64>,
    /// Σ wᵢ sᵢ of weights that add up to one: the rank, or tr(L M⁻¹).
    mean: f64,
    /// V with VᵀMV the identity (upper triangular).
    whitening: Vec<f64>,
    /// VᵀLV.
    matrix: Option<Vec<f64>>,
}

impl Point {
    /// At the packed `information`, for D or for the L `matrix`; none where the information is singular.
    fn at(information: &[f64], matrix: Option<&[f64]>, n: usize) -> Option<Point> {
        let mut factor = unpacked(information, n);
        if !cholesky(&mut factor, n) {
            return None;
        }
        let upper = inverse_transposed(&factor, n);
        let lower = transposed(&upper, n);
        let mut full = vec![0.0; n * n];
        let matrix = matrix.map(|matrix| symmetrically_transformed(matrix, &upper, n));
        let mean = match &matrix {
            None => {
                multiply(&upper, &lower, n, &mut full);
                n as f64
            }
            Some(matrix) => {
                let mut half = vec![0.0; n * n];
                multiply(matrix, &lower, n, &mut half);
                multiply(&upper, &half, n, &mut full);
                trace(matrix, n)
            }
        };
        let entries = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let slope = entries.map(|(i, j)| if i == j { full[i * n + i] } else { 2.0 * full[i * n + j] }).collect();
        Some(Point { slope, mean, whitening: upper, matrix })
    }

    /// How the criterion bends: tr(GᵢGⱼ) for D, 2 tr(Λ GᵢGⱼ) = Σ (λₖ + λₗ) Gᵢₖₗ Gⱼₖₗ for L, in coordinates where the information
    /// is the identity and L is diagonal, Λ. None where its eigenvalues are not found.
    fn curvature(&self, n: usize) -> Option<Curvature> {
        let (transform, eigenvalues) = match &self.matrix {
            None => (self.whitening.clone(), None),
            Some(matrix) => {
                let eigen = SymmetricEigen::try_new(DMatrix::from_row_slice(n, n, matrix), f64::EPSILON, 100 * n)?;
                // nalgebra stores columns.
                let vectors = transposed(eigen.eigenvectors.as_slice(), n);
                let mut transform = vec![0.0; n * n];
                multiply(&self.whitening, &vectors, n, &mut transform);
                (transform, Some(eigen.eigenvalues.as_slice().to_vec()))
            }
        };
        Some(Curvature { transform, eigenvalues })
    }
}

/// Second derivatives of a criterion are inner products of transformed Gram matrices.
struct Curvature {
    /// V with XV the block in the derivatives' coordinates.
    transform: Vec<f64>,
    /// L's in these coordinates.
    eigenvalues: Option<Vec<f64>>,
}

impl Curvature {
    /// Whether L has no negative eigenvalue but for rounding.
    fn is_semidefinite(&self) -> bool {
        let values = self.eigenvalues.as_deref().unwrap_or_default();
        let largest = values.iter().copied().fold(0.0, f64::max);
        values.iter().all(|value| *value >= -1e-9 * largest)
    }

    /// Factors of the packed entries of transformed Gram matrices, which make the derivatives plain inner products.
    fn factors(&self, n: usize) -> Vec<f64> {
        let factor = |(i, j): (usize, usize)| {
            let twice = if i == j { 1.0 } else { 2.0 };
            let bend = self.eigenvalues.as_ref().map_or(1.0, |values| (values[i] + values[j]).max(0.0));
            f64::sqrt(twice * bend)
        };
        (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(factor).collect()
    }

    /// Second derivatives by the weights of `set` (row-major, both triangles).
    fn hessian(&self, pool: &Pool, set: &[usize]) -> Vec<f64> {
        let (n, k) = (pool.n, set.len());
        let packed = n * (n + 1) / 2;
        let factors = self.factors(n);
        let mut features = vec![0.0; k * packed];
        features.par_chunks_mut(packed).zip(set).with_min_len(8).for_each(|(feature, index)| {
            let rows = pool.rows(*index);
            let mut transformed = vec![0.0; rows.len()];
            if self.eigenvalues.is_none() {
                multiply_upper(rows, &self.transform, n, &mut transformed);
            } else {
                multiply(rows, &self.transform, n, &mut transformed);
            }
            packed_gram(&transformed, n, feature);
            feature.iter_mut().zip(&factors).for_each(|(entry, factor)| *entry *= factor);
        });
        let feature = |i: usize| &features[i * packed..(i + 1) * packed];
        let lines: Vec<Vec<f64>> = (0..k)
            .into_par_iter()
            .with_min_len(4)
            .map(|i| {
                let mut line = Vec::with_capacity(i + 4);
                let mut j = 0;
                while j + 4 <= i + 1 {
                    line.extend(four_dots(feature(i), [feature(j), feature(j + 1), feature(j + 2), feature(j + 3)]));
                    j += 4;
                }
                line.extend((j..=i).map(|j| dot(feature(i), feature(j))));
                line
            })
            .collect();
        let mut hessian = vec![0.0; k * k];
        for (i, line) in lines.iter().enumerate() {
            for (j, value) in line.iter().enumerate() {
                hessian[i * k + j] = *value;
                hessian[j * k + i] = *value;
            }
        }
        hessian
    }
}

/// The weights of the least gap found, and the number of steps.
fn search(pool: &Pool, matrix: Option<&[f64]>, settings: &Settings) -> Result<(Vec<f64>, usize), ApproximateError> {
    let n = pool.n;
    // The certificate's rounding differs from the search's.
    let goal = 0.99 * settings.gap;
    let mut support = vec![pool.count];
    let mut weights = vec![1.0];
    let mut best = (f64::INFINITY, support.clone(), weights.clone());
    let mut iterations = 0;
    loop {
        let information = pool.information(&support, &weights);
        let Some(point) = Point::at(&information, matrix, n) else { break };
        let Some(curvature) = point.curvature(n) else { break };
        // Later, where the information may be nearly singular, rounding may look like it.
        if iterations == 0 && !curvature.is_semidefinite() {
            return Err(ApproximateError::NotSemidefinite);
        }
        let sensitivities = pool.sensitivities(&point.slope);
        let largest = sensitivities.iter().copied().fold(0.0, f64::max);
        let gap = relative(largest, point.mean) - 1.0;
        if gap < best.0 {
            best = (gap, support.clone(), weights.clone());
        }
        if gap <= goal || iterations == settings.max_iterations {
            break;
        }
        iterations += 1;

        let set = working_set(&support, &sensitivities, point.mean, n + ENTRANTS);
        let mut start = vec![0.0; set.len()];
        for (index, weight) in support.iter().zip(&weights) {
            if let Ok(at) = set.binary_search(index) {
                start[at] = *weight;
            }
        }
        // Newton's model at w is ½ xᵀHx − bᵀx with b = Hw − gradient, and Hw is known, because the criterion is homogeneous.
        let multiple = if matrix.is_none() { 2.0 } else { 3.0 };
        let linear: Vec<f64> = set.iter().map(|&index| multiple * sensitivities[index] - point.mean).collect();
        let hessian = curvature.hessian(pool, &set);
        let step = nonnegative_minimum(&hessian, &linear, &start)
            .map(|minimum| minimum.iter().zip(&start).map(|(to, from)| to - from).collect::<Vec<f64>>())
            .and_then(|direction| line_search(pool, matrix, &set, &start, &direction, &information, &point));
        let moved = step.or_else(|| {
            // Towards the candidate of the largest sensitivity, which always improves (Fedorov, 1972; Wynn, 1970).
            let towards = set.iter().position(|&index| sensitivities[index] == largest)?;
            let direction: Vec<f64> =
                start.iter().enumerate().map(|(at, weight)| f64::from(u8::from(at == towards)) - weight).collect();
            line_search(pool, matrix, &set, &start, &direction, &information, &point)
        });
        let Some(moved) = moved else { break };
        let sum: f64 = moved.iter().sum();
        support.clear();
        weights.clear();
        for (index, weight) in set.iter().zip(moved) {
            if weight > 0.0 {
                support.push(*index);
                weights.push(weight / sum);
            }
        }
    }
    let (_, support, weights) = best;
    let mut all = vec![0.0; pool.count];
    for (index, weight) in support.into_iter().zip(weights) {
        if index < pool.count {
            all[index] += weight;
        } else {
            // The uniform design's weight is everybody's.
            all.iter_mut().for_each(|share| *share += weight / pool.count as f64);
        }
    }
    let sum: f64 = all.iter().sum();
    all.iter_mut().for_each(|weight| *weight /= sum);
    Ok((all, iterations))
}

/// Candidates without weight that a step considers at most, beside as many as the rank.
const ENTRANTS: usize = 4;

/// The candidates of `support` and the `entrants` best others whose sensitivity is above the mean, ascending.
fn working_set(support: &[usize], sensitivities: &[f64], mean: f64, entrants: usize) -> Vec<usize> {
    let mut others: Vec<usize> =
        (0..sensitivities.len()).filter(|index| sensitivities[*index] > mean && support.binary_search(index).is_err()).collect();
    others.sort_unstable_by(|a, b| sensitivities[*b].total_cmp(&sensitivities[*a]).then(a.cmp(b)));
    others.truncate(entrants);
    others.extend(support);
    others.sort_unstable();
    others
}

/// Weights `start + t · direction`, 0 < t ≤ 1, where the convex criterion still falls or nearly stopped falling; none where it
/// does not fall at all.
fn line_search(
    pool: &Pool,
    matrix: Option<&[f64]>,
    set: &[usize],
    start: &[f64],
    direction: &[f64],
    information: &[f64],
    point: &Point,
) -> Option<Vec<f64>> {
    let n = pool.n;
    let change = pool.information(set, direction);
    let penalty = point.mean * direction.iter().sum::<f64>();
    let initial = penalty - dot(&point.slope, &change);
    if initial.is_nan() || initial >= 0.0 {
        return None;
    }
    // Of the criterion along the line, at `t`.
    let derivative = |t: f64| {
        let information: Vec<f64> = information.iter().zip(&change).map(|(from, change)| from + t * change).collect();
        Point::at(&information, matrix, n).map_or(f64::INFINITY, |at| penalty - dot(&at.slope, &change))
    };
    let (mut falling, mut rising, mut t) = (0.0, 1.0, 1.0);
    for _ in 0..40 {
        let slope = derivative(t);
        if slope <= 0.0 {
            falling = t;
            if t == 1.0 || slope >= 0.2 * initial {
                break;
            }
        } else {
            rising = t;
        }
        t = 0.5 * (falling + rising);
    }
    (falling > 0.0).then(|| {
        // At the end of the line zeros are exact.
        start.iter().zip(direction).map(|(from, change)| (from + falling * change).max(0.0)).collect()
    })
}

/// The minimum of ½ xᵀHx − bᵀx over x ≥ 0, by block principal pivoting from the free variables of `start`; none where rounding
/// prevents it.
fn nonnegative_minimum(hessian: &[f64], linear: &[f64], start: &[f64]) -> Option<Vec<f64>> {
    let k = linear.len();
    let mut free: Vec<bool> = start.iter().map(|weight| *weight > 0.0).collect();
    let largest = (0..k).map(|i| hessian[i * k + i]).fold(0.0, f64::max);
    // Candidates may be alike.
    let ridge = 1e-12 * largest;
    let tolerance = 1e-12 * linear.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    let (mut fewest, mut patience) = (k + 1, PATIENCE);
    let mut factor = Vec::new();
    for _ in 0..200 {
        let set: Vec<usize> = (0..k).filter(|i| free[*i]).collect();
        let m = set.len();
        factor.clear();
        for (at, i) in set.iter().enumerate() {
            factor.extend(set.iter().map(|j| hessian[i * k + j]));
            factor[at * m + at] += ridge;
        }
        if !cholesky(&mut factor, m) {
            return None;
        }
        let mut values: Vec<f64> = set.iter().map(|i| linear[*i]).collect();
        solve_lower(&factor, m, &mut values);
        solve_lower_transposed(&factor, m, &mut values);
        let mut minimum = vec![0.0; k];
        set.iter().zip(&values).for_each(|(i, value)| minimum[*i] = *value);
        let wrong: Vec<usize> = (0..k)
            .filter(
                |&i| if free[i] { minimum[i] < 0.0 } else { dot(&hessian[i * k..(i + 1) * k], &minimum) < linear[i] - tolerance },
            )
            .collect();
        if wrong.is_empty() {
            return Some(minimum);
        }
        let exchanged = if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
            &wrong[..]
        } else if patience > 0 {
            patience -= 1;
            &wrong[..]
        } else {
            // One at a time, always the last, comes to an end (Murty, 1974).
            &wrong[wrong.len() - 1..]
        };
        exchanged.iter().for_each(|i| free[*i] = !free[*i]);
    }
    None
}

/// Exchanges of a block that may fail to reduce the number of wrong signs.
const PATIENCE: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::Arm;
    use crate::measurement::Weights;
    use crate::quality::information::{InformationModel, JacobianScratch};
    use crate::seed::stream;

    const CLOSE: Settings = Settings { gap: 1e-9, max_iterations: 200 };

    /// Candidates x of a polynomial regression: blocks 1, x, x², …
    fn polynomial(degree: usize, points: &[f64]) -> Blocks {
        let mut blocks = Blocks::new(degree + 1, 1);
        for x in points {
            blocks.push(&(0..=degree).map(|power| x.powi(power as i32)).collect::<Vec<f64>>());
        }
        blocks
    }

    fn grid(steps: i32) -> Vec<f64> {
        (0..=steps).map(|i| f64::from(2 * i - steps) / f64::from(steps)).collect()
    }

    fn weight_near(points: &[f64], weights: &[f64], x: f64) -> f64 {
        points.iter().zip(weights).filter(|(point, _)| (*point - x).abs() < 0.02).map(|(_, weight)| weight).sum()
    }

    fn paper() -> crate::scene::Scene {
        crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml")).unwrap().scene
    }

    /// `count` random configurations within `share` of the limits.
    fn configurations(arm: &Arm, count: usize, share: f64, label: &str) -> Vec<f64> {
        let mut stream = stream(1, label);
        (0..count).flat_map(|_| &arm.chain.joints).map(|joint| share * stream.uniform(joint.lower, joint.upper)).collect()
    }

    /// Candidates of the paper's arm; and the mean of PᵀP over other configurations, for the first `rows` rows of the Jacobian.
    fn pool(count: usize, share: f64, orientation: bool, rows: usize) -> (Blocks, Vec<f64>) {
        let mut scene = paper();
        if orientation {
            scene.sensor.orientation_sigma_rad = Some(0.001);
        } else {
            scene.sensor.orientation_sigma_rad = None;
        }
        let model = InformationModel::new(&scene.arm, &scene.sensor, Weights::Noise);
        let n = model.rank();
        let mut matrix = vec![0.0; n * n];
        let (mut scratch, mut jacobian) = (JacobianScratch::default(), vec![0.0; 6 * n]);
        for joints in configurations(&scene.arm, 100, 1.0, "test/approximate/workspace").chunks_exact(8) {
            model.unscaled_into(joints, &mut scratch, &mut jacobian);
            add_gram(&jacobian[..rows * n], 0.01, n, &mut matrix);
        }
        for i in 0..n {
            for j in 0..i {
                matrix[j * n + i] = matrix[i * n + j];
            }
        }
        (Blocks::of(&model, &configurations(&scene.arm, count, share, "test/approximate/pool"), 8), matrix)
    }

    fn information(blocks: &Blocks, weights: &[f64]) -> DMatrix<f64> {
        let mut sum = DMatrix::zeros(blocks.rank(), blocks.rank());
        for (block, weight) in blocks.iter().zip(weights) {
            let rows = DMatrix::from_row_slice(blocks.rows_per_pose(), blocks.rank(), block);
            sum += *weight * rows.transpose() * rows;
        }
        sum
    }

    /// Value and sensitivities by nalgebra.
    fn reference(blocks: &Blocks, criterion: Criterion<'_>, weights: &[f64]) -> (f64, Vec<f64>) {
        let n = blocks.rank();
        let factor = information(blocks, weights).cholesky().unwrap();
        let inverse = factor.inverse();
        let (value, slope) = match criterion {
            Criterion::D => (2.0 * factor.l().diagonal().map(f64::ln).sum(), inverse),
            Criterion::L(matrix) => {
                let matrix = DMatrix::from_row_slice(n, n, matrix);
                ((&matrix * &inverse).trace(), &inverse * matrix * &inverse)
            }
        };
        let sensitivity = |block| {
            let rows = DMatrix::from_row_slice(blocks.rows_per_pose(), n, block);
            (&rows * &slope * rows.transpose()).trace()
        };
        (value, blocks.iter().map(sensitivity).collect())
    }

    /// That the design is one, and that its numbers are true.
    fn check(blocks: &Blocks, criterion: Criterion<'_>, design: &ApproximateDesign) {
        assert!((design.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && design.weights.iter().all(|weight| *weight >= 0.0));
        let (value, sensitivities) = reference(blocks, criterion, &design.weights);
        let largest = sensitivities.iter().copied().fold(0.0, f64::max);
        let (mean, bound) = match criterion {
            Criterion::D => {
                let n = blocks.rank() as f64;
                (n, value + n * (largest / n).max(1.0).ln())
            }
            Criterion::L(_) => (value, value * value / largest.max(value)),
        };
        let tolerance = 1e-8 * value.abs().max(1e-3);
        assert!((design.value - value).abs() < tolerance, "{} is not {value}", design.value);
        assert!((design.bound - bound).abs() < tolerance, "{} is not {bound}", design.bound);
        assert!((design.gap - (largest / mean - 1.0).max(0.0)).abs() < 1e-8, "{} is not {}", design.gap, largest / mean - 1.0);
        for (ours, theirs) in design.sensitivities(criterion, blocks).iter().zip(sensitivities) {
            assert!((ours - theirs / mean).abs() < 1e-7 * ours.max(1.0));
        }
    }

    fn converged(blocks: &Blocks, criterion: Criterion<'_>, settings: &Settings) -> ApproximateDesign {
        let design = optimise(blocks, criterion, settings).unwrap();
        check(blocks, criterion, &design);
        assert!(design.converged && design.gap <= settings.gap, "{} after {}", design.gap, design.iterations);
        design
    }

    #[test]
    fn quadratic_regression_has_the_known_designs() {
        // Fedorov, 1972: D-optimal are thirds at −1, 0 and 1; the least mean variance over [−1, 1] have 1/4, 1/2, 1/4.
        let points = grid(200);
        let blocks = polynomial(2, &points);
        let design = converged(&blocks, Criterion::D, &CLOSE);
        let expected = (4.0f64 / 27.0).ln();
        assert!((design.value - expected).abs() < 1e-8 && design.bound >= expected - 1e-12);
        for x in [-1.0, 0.0, 1.0] {
            assert!((weight_near(&points, &design.weights, x) - 1.0 / 3.0).abs() < 1e-6);
        }
        let third = 1.0 / 3.0;
        let mean = [1.0, 0.0, third, 0.0, third, 0.0, third, 0.0, 0.2];
        let design = converged(&blocks, Criterion::L(&mean), &CLOSE);
        for (x, weight) in [(-1.0, 0.25), (0.0, 0.5), (1.0, 0.25)] {
            assert!((weight_near(&points, &design.weights, x) - weight).abs() < 1e-6);
        }
    }

    #[test]
    fn polynomial_regression_has_its_weight_at_legendres_zeros() {
        // Guest, Annals of Mathematical Statistics 29, 1958: the zeros of (1 − x²) P′(x), equally weighted.
        let (outer, inner) = (((7.0 + 2.0 * 7f64.sqrt()) / 21.0).sqrt(), ((7.0 - 2.0 * 7f64.sqrt()) / 21.0).sqrt());
        let zeros = [-1.0, -outer, -inner, inner, outer, 1.0];
        let mut points = grid(400);
        points.extend(&zeros[1..5]);
        let design = converged(&polynomial(5, &points), Criterion::D, &CLOSE);
        for zero in zeros {
            assert!((weight_near(&points, &design.weights, zero) - 1.0 / 6.0).abs() < 1e-4);
        }
    }

    #[test]
    fn the_multiplicative_algorithm_arrives_at_the_same() {
        let (blocks, matrix) = pool(60, 0.6, true, 3);
        for criterion in [Criterion::D, Criterion::L(&matrix)] {
            let design = converged(&blocks, criterion, &CLOSE);
            let mut weights = vec![1.0 / 60.0; 60];
            let mut value = 0.0;
            for _ in 0..1500 {
                let (at, sensitivities) = reference(&blocks, criterion, &weights);
                value = at;
                for (weight, sensitivity) in weights.iter_mut().zip(sensitivities) {
                    *weight *= if matches!(criterion, Criterion::D) { sensitivity } else { sensitivity.sqrt() };
                }
                let sum: f64 = weights.iter().sum();
                weights.iter_mut().for_each(|weight| *weight /= sum);
            }
            let worse = match criterion {
                Criterion::D => design.bound - value,
                Criterion::L(_) => value / design.bound - 1.0,
            };
            assert!((0.0..1e-3).contains(&worse), "{worse}");
        }
    }

    #[test]
    fn no_set_beats_the_bound() {
        let (blocks, matrix) = pool(200, 0.5, true, 3);
        let mut stream = stream(1, "test/approximate/sets");
        for criterion in [Criterion::D, Criterion::L(&matrix)] {
            let design = converged(&blocks, criterion, &Settings::default());
            for m in [12, 20, 40] {
                for trial in 0..30 {
                    let mut counts = vec![0.0; 200];
                    // Some of the sets are of candidates of much weight.
                    let chosen = |at: &usize| trial % 2 == 0 || design.weights[*at] > 0.0;
                    (0..).map(|_| stream.index(200)).filter(chosen).take(m).for_each(|at| counts[at] += 1.0);
                    let (value, _) = reference(&blocks, criterion, &counts);
                    let efficiency = design.efficiency_of_set(criterion, m, value);
                    assert!(efficiency > 0.0 && efficiency < 1.0, "{efficiency}");
                }
            }
            // The weights themselves, as if they were a set of one.
            let own = design.efficiency_of_set(criterion, 1, design.value);
            assert!((own * (1.0 + design.gap) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn pools_of_all_kinds_converge() {
        for (count, share, orientation, rows) in [
            (1000, 1.0, true, 6),
            (1000, 0.3, true, 3),
            (300, 0.1, true, 6),
            (500, 0.5, false, 3),
            (200, 0.2, false, 3),
            (7, 1.0, true, 6),
            (12, 1.0, false, 3),
        ] {
            let (blocks, matrix) = pool(count, share, orientation, rows);
            for criterion in [Criterion::D, Criterion::L(&matrix)] {
                converged(&blocks, criterion, &Settings::default());
                converged(&blocks, criterion, &Settings { gap: 1e-7, ..CLOSE });
            }
        }
    }

    #[test]
    fn candidates_may_be_alike_few_and_badly_scaled() {
        let (blocks, matrix) = pool(150, 0.3, true, 6);
        let once = converged(&blocks, Criterion::D, &CLOSE);
        let (mut twice, mut scaled) = (Blocks::new(36, 6), Blocks::new(36, 6));
        let unit: Vec<f64> = (0..36).map(|column| 10f64.powi(column % 9 - 4)).collect();
        for block in blocks.iter().chain(blocks.iter()) {
            twice.push(block);
        }
        for block in blocks.iter() {
            scaled.push(&block.iter().enumerate().map(|(at, entry)| entry * unit[at % 36]).collect::<Vec<f64>>());
        }
        assert!((converged(&twice, Criterion::D, &CLOSE).value - once.value).abs() < 1e-7);
        let design = optimise(&scaled, Criterion::D, &CLOSE).unwrap();
        let shift: f64 = 2.0 * unit.iter().map(|unit| unit.ln()).sum::<f64>();
        assert!(design.converged && (design.value - shift - once.value).abs() < 1e-6);
        converged(&twice, Criterion::L(&matrix), &CLOSE);

        // Six configurations of six rows have nothing to choose: each is needed.
        let mut six = Blocks::new(36, 6);
        blocks.iter().take(6).for_each(|block| six.push(block));
        let design = converged(&six, Criterion::D, &CLOSE);
        assert!(design.weights.iter().all(|weight| (weight - 1.0 / 6.0).abs() < 1e-9));

        let mut stream = stream(1, "test/approximate/two");
        let mut two = Blocks::new(2, 3);
        for _ in 0..500 {
            two.push(&[0; 6].map(|_| stream.normal()));
        }
        converged(&two, Criterion::D, &CLOSE);
        converged(&two, Criterion::L(&[1.0, 0.5, 0.5, 1.0]), &CLOSE);
        let constant = converged(&polynomial(0, &[1.0, 1.0, 0.5]), Criterion::D, &CLOSE);
        assert!(constant.value.abs() < 1e-12);
    }

    #[test]
    fn what_only_some_parameters_matter_for_has_a_design_as_well() {
        // Variance of the slope at 0 (Chebyshev: 9 with the weight at the extremes of his polynomial), and of the prediction at
        // 1, for which nothing but 1 need be measured: the information of the optimum is singular.
        let blocks = polynomial(3, &grid(100));
        for (direction, best) in [([0.0, 1.0, 0.0, 0.0], 9.0), ([1.0, 1.0, 1.0, 1.0], 1.0)] {
            let matrix: Vec<f64> = (0..16).map(|at| direction[at / 4] * direction[at % 4]).collect();
            let design = optimise(&blocks, Criterion::L(&matrix), &Settings::default()).unwrap();
            assert!(design.converged && (design.value / best - 1.0).abs() < 1e-3, "{} {}", design.value, design.gap);
            assert!(design.bound < best * (1.0 + 1e-6));
        }
        let nothing = optimise(&blocks, Criterion::L(&[0.0; 16]), &CLOSE).unwrap();
        assert_eq!((nothing.value, nothing.bound, nothing.gap), (0.0, 0.0, 0.0));
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let (blocks, matrix) = pool(700, 0.6, true, 3);
        for criterion in [Criterion::D, Criterion::L(&matrix)] {
            let with = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| optimise(&blocks, criterion, &Settings::default()).unwrap())
            };
            assert_eq!(with(1), with(2));
        }
    }

    #[test]
    fn a_search_cut_short_tells_its_gap() {
        let (blocks, matrix) = pool(300, 0.3, true, 6);
        for criterion in [Criterion::D, Criterion::L(&matrix)] {
            let mut best = optimise(&blocks, criterion, &CLOSE).unwrap().gap;
            for max_iterations in [3, 1, 0] {
                let design = optimise(&blocks, criterion, &Settings { gap: 0.0, max_iterations }).unwrap();
                check(&blocks, criterion, &design);
                assert!(!design.converged && design.iterations == max_iterations && design.gap > best);
                best = design.gap;
            }
        }
        // Where no step improves any more it ends, too.
        let endless = optimise(&blocks, Criterion::D, &Settings { gap: 0.0, max_iterations: 10_000 }).unwrap();
        assert!(endless.gap < 1e-9);
    }

    #[test]
    fn further_candidates_are_judged() {
        let (blocks, _) = pool(300, 0.5, true, 6);
        let (mut first, mut rest) = (Blocks::new(36, 6), Blocks::new(36, 6));
        blocks.iter().take(100).for_each(|block| first.push(block));
        blocks.iter().skip(100).for_each(|block| rest.push(block));
        let design = converged(&first, Criterion::D, &CLOSE);
        let largest = design.sensitivities(Criterion::D, &rest).into_iter().fold(0.0, f64::max);
        assert!(largest > 1.0 + design.gap);
        let all = converged(&blocks, Criterion::D, &CLOSE);
        assert!(all.value > design.value && all.value <= design.value + 36.0 * largest.ln());
    }

    #[test]
    fn pools_and_matrices_that_make_no_sense_are_refused() {
        let (blocks, _) = pool(5, 1.0, true, 6);
        let refused = |blocks: &Blocks, criterion| optimise(blocks, criterion, &Settings::default()).unwrap_err();
        assert_eq!(refused(&blocks, Criterion::D), ApproximateError::RankDeficient { candidates: 5, rank: 30, columns: 36 });
        assert_eq!(
            refused(&Blocks::new(3, 2), Criterion::D),
            ApproximateError::RankDeficient { candidates: 0, rank: 0, columns: 3 }
        );
        let points = [0.5, 0.5, 0.5, -0.5];
        assert_eq!(
            refused(&polynomial(2, &points), Criterion::D),
            ApproximateError::RankDeficient { candidates: 4, rank: 2, columns: 3 }
        );
        assert_eq!(refused(&polynomial(1, &[0.0, f64::NAN]), Criterion::D), ApproximateError::NotFinite);
        let line = polynomial(1, &[0.0, 1.0]);
        assert_eq!(refused(&line, Criterion::L(&[1.0, 0.0, 0.0, f64::INFINITY])), ApproximateError::NotFinite);
        assert_eq!(refused(&line, Criterion::L(&[1.0, 0.0, 0.0, -0.1])), ApproximateError::NotSemidefinite);
    }
}
