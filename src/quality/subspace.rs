//! Which parameters can be told apart: deterministic rank revelation of an error Jacobian.

use nalgebra::DMatrix;

use crate::arm::Arm;
use crate::seed::stream;

/// Singular values of the column-scaled Jacobian below this share of the largest count as zero. What rounding leaves of a
/// structural redundancy is near 1e-15, what a real arm shows is above 1e-6.
const RELATIVE_TOLERANCE: f64 = 1e-9;
/// Random configurations whose stacked Jacobian tells the structure of an arm.
const STRUCTURE_SAMPLES: usize = 60;

/// The identifiable subspace of a set of parameters, by choice of independent ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Subspace {
    /// Columns that are estimated, ascending.
    pub independent: Vec<usize>,
    /// Columns held at their nominal values, ascending.
    pub dropped: Vec<usize>,
    /// `independent.len() × dropped.len()`: a unit of dropped parameter `j` acts on the poses as these amounts of the independent
    /// ones, so that what is estimated for independent parameter `i` is `Δp_i + Σ_j share(i, j) Δp_j`.
    pub share: DMatrix<f64>,
    /// Singular values of the column-scaled Jacobian, largest first.
    pub singular_values: Vec<f64>,
}

impl Subspace {
    /// Dimension of the identifiable subspace.
    #[must_use]
    pub fn rank(&self) -> usize {
        self.independent.len()
    }

    /// Reveals the subspace of `jacobian` (rows × parameters). Where parameters can stand in for each other, those later in
    /// `preference` (a permutation of the columns) are dropped.
    ///
    /// The rank comes from the singular values of the column-scaled Jacobian; the columns are then taken in order of preference as
    /// long as they are independent of those already taken (Gram–Schmidt, twice), so that the answer is the same every time and
    /// does not depend on pivots that are nearly equal.
    #[must_use]
    pub fn reveal(jacobian: &DMatrix<f64>, preference: &[usize]) -> Subspace {
        let columns = jacobian.ncols();
        let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let seen: Vec<bool> = norms.iter().map(|norm| *norm > largest * RELATIVE_TOLERANCE).collect();
        let mut scaled = jacobian.clone();
        for (column, norm) in norms.iter().enumerate() {
            if seen[column] {
                scaled.column_mut(column).scale_mut(1.0 / norm);
            } else {
                scaled.column_mut(column).fill(0.0);
            }
        }
        // The triangular factor has the same singular values and is small however many rows there are.
        let triangle = scaled.clone().qr().r();
        let mut singular_values: Vec<f64> = triangle.singular_values().iter().copied().collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        let threshold = singular_values.first().copied().unwrap_or(0.0) * RELATIVE_TOLERANCE;
        let rank = singular_values.iter().filter(|value| **value > threshold).count();

        let mut basis: Vec<nalgebra::DVector<f64>> = Vec::with_capacity(rank);
        let mut independent = Vec::with_capacity(rank);
        // A column may be kept only if what it adds is well above rounding; if near-dependences leave the basis short, the
        // threshold is lowered until the rank is reached.
        let mut threshold = 1e-6;
        while independent.len() < rank && threshold > 1e-14 {
            for &column in preference {
                if independent.len() == rank {
                    break;
                }
                if !seen[column] || independent.contains(&column) {
                    continue;
                }
                let mut rest = scaled.column(column).into_owned();
                for _ in 0..2 {
                    for direction in &basis {
                        let along = direction.dot(&rest);
                        rest.axpy(-along, direction, 1.0);
                    }
                }
                let norm = rest.norm();
                if norm > threshold {
                    basis.push(rest / norm);
                    independent.push(column);
                }
            }
            threshold *= 1e-2;
        }
        independent.sort_unstable();
        let dropped: Vec<usize> = (0..columns).filter(|column| !independent.contains(column)).collect();
        let kept = jacobian.select_columns(&independent);
        let others = jacobian.select_columns(&dropped);
        let share = if dropped.is_empty() || independent.is_empty() {
            DMatrix::zeros(independent.len(), dropped.len())
        } else {
            let qr = kept.qr();
            let mut right = qr.q().transpose() * others;
            qr.r().solve_upper_triangular_mut(&mut right);
            right
        };
        Subspace { independent, dropped, share, singular_values }
    }

    /// The subspace that `arm`'s structure allows, whatever is measured within its joint limits: full poses if `attitude`, else
    /// positions only.
    #[must_use]
    pub fn of_structure(arm: &Arm, attitude: bool) -> Subspace {
        let chain = arm.chain.at_nominal();
        let columns = chain.parameter_count();
        let rows_per_pose = if attitude { 6 } else { 3 };
        let mut stream = stream(0, "quality/structure");
        let mut stacked = DMatrix::zeros(rows_per_pose * STRUCTURE_SAMPLES.max(columns / 2), columns);
        let samples = stacked.nrows() / rows_per_pose;
        for sample in 0..samples {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let (_, jacobian) = chain.jacobian(&joints);
            stacked.rows_mut(sample * rows_per_pose, rows_per_pose).copy_from(&jacobian.rows(0, rows_per_pose));
        }
        Subspace::reveal(&stacked, &preference(arm))
    }
}

/// Order in which parameters are kept: as they stand, but β after all others. Between axes that are not parallel β stands in for
/// the others and is the one that nobody expects; between parallel axes it is independent and is kept.
#[must_use]
pub fn preference(arm: &Arm) -> Vec<usize> {
    let is_beta = |column: &usize| arm.chain.parameters[*column].name.starts_with("beta");
    let columns = 0..arm.chain.parameters.len();
    columns.clone().filter(|column| !is_beta(column)).chain(columns.filter(is_beta)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_redundant_column_is_dropped_and_its_share_told() {
        // Third column = 2 × first − second; the fourth is not seen at all.
        let jacobian = DMatrix::from_row_slice(3, 4, &[1.0, 0.0, 2.0, 0.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 1.0, 0.0]);
        let subspace = Subspace::reveal(&jacobian, &[0, 1, 2, 3]);
        assert_eq!((subspace.rank(), &subspace.independent, &subspace.dropped), (2, &vec![0, 1], &vec![2, 3]));
        assert!((subspace.share.column(0) - nalgebra::dvector![2.0, -1.0]).norm() < 1e-14);
        assert!(subspace.share.column(1).norm() < 1e-14);
        let other = Subspace::reveal(&jacobian, &[2, 0, 1, 3]);
        assert_eq!(other.independent, vec![0, 2]);
    }
}
