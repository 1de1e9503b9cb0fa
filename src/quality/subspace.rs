//! Which parameters can be told apart: deterministic rank revelation of an error Jacobian.

use nalgebra::DMatrix;

use crate::arm::Arm;
use crate::measurement::equations::COMPONENTS;
use crate::seed::stream;

/// Singular values of the column-scaled Jacobian below this share of the largest count as zero. What rounding leaves of a
/// structural redundancy is near 1e-15, what a real arm shows is above 1e-6.
const RELATIVE_TOLERANCE: f64 = 1e-9;
/// Random configurations whose stacked Jacobian tells the structure of an arm.
const STRUCTURE_SAMPLES: usize = 60;
/// Share of the largest new part that a column must have to be taken.
const NEARLY_BEST: f64 = 0.7;
/// Whether late columns are looked at, and the least new part (of a column's length) that they must have: first the others as far
/// as they are clearly independent, then the late ones, then both with less and less.
const PASSES: [(bool, f64); 6] = [(false, 1e-3), (true, 1e-3), (false, 1e-7), (true, 1e-7), (false, 1e-12), (true, 1e-12)];

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

    /// Reveals the subspace of `jacobian` (rows × parameters). Of parameters that can stand in for each other, those that `late`
    /// marks are dropped first.
    ///
    /// The rank comes from the singular values of the column-scaled Jacobian. Columns are then taken one by one: of those whose
    /// part outside the span of the columns taken so far is at least 0.7 of the largest such part, the first. Parts
    /// are compared per metre and radian: of a target's offset and the angle of the joint that it nearly lies on, the offset is
    /// taken, for a parameter that hardly moves the poses can stand in for one that does only through absurd values. The answer
    /// does not hang on which of two nearly equal columns is larger.
    ///
    /// `floor` is the singular value of `jacobian` itself below which a direction counts as not seen at all; zero where only exact
    /// dependence counts. No more than `limit` columns are taken.
    #[must_use]
    pub fn reveal(jacobian: &DMatrix<f64>, late: &[bool], floor: f64, limit: usize) -> Subspace {
        let columns = jacobian.ncols();
        let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let scale: Vec<f64> =
            norms.iter().map(|norm| if *norm > largest * RELATIVE_TOLERANCE { 1.0 / norm } else { 0.0 }).collect();
        // The triangular factor has the same lengths and angles between columns, however many rows there are.
        let triangle = if jacobian.nrows() > columns { jacobian.clone().qr().unpack_r() } else { jacobian.clone() };
        let mut scaled = triangle.clone();
        for (mut column, scale) in scaled.column_iter_mut().zip(&scale) {
            column *= *scale;
        }
        let mut singular_values: Vec<f64> = scaled.singular_values().iter().copied().collect();
        singular_values.sort_by(|a, b| b.total_cmp(a));
        let threshold = singular_values.first().copied().unwrap_or(0.0) * RELATIVE_TOLERANCE;
        let exact = singular_values.iter().filter(|value| **value > threshold).count();
        let seen = || triangle.singular_values().iter().filter(|value| **value > floor).count();
        let rank = if floor > 0.0 { exact.min(seen()) } else { exact }.min(limit);

        let mut rest = triangle.clone();
        let mut independent = Vec::with_capacity(rank);
        for (class, least) in PASSES {
            while independent.len() < rank {
                let length = |column: usize| rest.column(column).norm();
                let candidates =
                    || (0..columns).filter(|column| late[*column] == class && length(*column) * scale[*column] > least);
                let longest = candidates().map(length).fold(0.0, f64::max);
                let Some(chosen) = candidates().find(|column| length(*column) >= NEARLY_BEST * longest) else {
                    break;
                };
                independent.push(chosen);
                let direction = rest.column(chosen).normalize();
                for mut column in rest.column_iter_mut() {
                    // Twice, so that rounding leaves nothing along the direction.
                    for _ in 0..2 {
                        let along = direction.dot(&column);
                        column.axpy(-along, &direction, 1.0);
                    }
                }
                rest.column_mut(chosen).fill(0.0);
            }
        }
        independent.sort_unstable();
        let dropped: Vec<usize> = (0..columns).filter(|column| !independent.contains(column)).collect();
        let share = share(&triangle, &independent, &dropped);
        Subspace { independent, dropped, share, singular_values }
    }

    /// The same choice of parameters with the shares of another Jacobian, such as that at the solution.
    #[must_use]
    pub fn at(self, jacobian: &DMatrix<f64>) -> Subspace {
        let share = share(jacobian, &self.independent, &self.dropped);
        Subspace { share, ..self }
    }

    /// The subspace that `arm`'s structure allows, whatever is measured within its joint limits: full poses if `orientation`, else
    /// positions only.
    #[must_use]
    pub fn of_structure(arm: &Arm, orientation: bool) -> Subspace {
        Subspace::of_components(arm, std::array::from_fn(|component| component < 3 || orientation))
    }

    /// The same where these components of a pose are measured: x, y, z, then the rotation vector, in base.
    #[must_use]
    pub fn of_components(arm: &Arm, measured: [bool; COMPONENTS]) -> Subspace {
        let chain = arm.chain.at_nominal();
        let columns = chain.parameter_count();
        let components: Vec<usize> = (0..COMPONENTS).filter(|component| measured[*component]).collect();
        let rows_per_pose = components.len();
        let mut stream = stream(0, "quality/structure");
        let mut stacked = DMatrix::zeros(rows_per_pose * STRUCTURE_SAMPLES.max(columns / 2), columns);
        let samples = STRUCTURE_SAMPLES.max(columns / 2);
        for sample in 0..samples {
            let joints: Vec<f64> = arm.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
            let (_, jacobian) = chain.jacobian(&joints);
            stacked.rows_mut(sample * rows_per_pose, rows_per_pose).copy_from(&jacobian.select_rows(&components));
        }
        Subspace::reveal(&stacked, &late(arm), 0.0, usize::MAX)
    }
}

/// The amounts of the independent parameters that act like a unit of each dropped one: least squares over the poses.
fn share(jacobian: &DMatrix<f64>, independent: &[usize], dropped: &[usize]) -> DMatrix<f64> {
    if dropped.is_empty() || independent.is_empty() {
        return DMatrix::zeros(independent.len(), dropped.len());
    }
    let qr = jacobian.select_columns(independent).qr();
    let mut right = jacobian.select_columns(dropped);
    qr.q_tr_mul(&mut right);
    let mut share = right.rows(0, independent.len()).into_owned();
    qr.unpack_r().solve_upper_triangular_mut(&mut share);
    share
}

/// Parameters to drop before others: every β. Between axes that are not parallel β stands in for the others and is the one that
/// nobody expects; between parallel axes it is independent and is kept.
#[must_use]
pub fn late(arm: &Arm) -> Vec<bool> {
    arm.chain.parameters.iter().map(|parameter| parameter.name.starts_with("beta")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_redundant_column_is_dropped_and_its_share_told() {
        // Third column = 0.2 × first − 0.1 × second; the fourth is not seen at all.
        let jacobian = DMatrix::from_row_slice(3, 4, &[1.0, 0.0, 0.2, 0.0, 0.0, 1.0, -0.1, 0.0, 1.0, 1.0, 0.1, 0.0]);
        let subspace = Subspace::reveal(&jacobian, &[false; 4], 0.0, usize::MAX);
        assert_eq!((subspace.rank(), &subspace.independent, &subspace.dropped), (2, &vec![0, 1], &vec![2, 3]));
        assert!((subspace.share.column(0) - nalgebra::dvector![0.2, -0.1]).norm() < 1e-14);
        assert!(subspace.share.column(1).norm() < 1e-14);
        let other = Subspace::reveal(&jacobian, &[true, false, false, false], 0.0, usize::MAX);
        assert_eq!(other.independent, vec![1, 2]);
        // What is seen less than the floor is not seen.
        assert_eq!(Subspace::reveal(&jacobian, &[false; 4], 1.1, usize::MAX).rank(), 1);
    }
}
