//! All indexes of one set of configurations: what an optimiser calls thousands of times.

use nalgebra::{DMatrix, Vector3};

use super::Indexes;
use super::globality::{WorkspaceGrid, dispersion};
use super::observability::observability;
use super::subspace::Subspace;
use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::numerics::dense;
use crate::quality::{EvennessDomain, JacobianScaling};

/// Evaluates sets of configurations of one arm at its nominal parameters.
pub struct Evaluator {
    chain: ChainAt,
    subspace: Subspace,
    grid: WorkspaceGrid,
    scaling: JacobianScaling,
    /// 6 with orientation, 3 for positions only.
    rows_per_pose: usize,
    joint_count: usize,
}

/// Memory for the evaluations of one thread.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    rows: Vec<f64>,
    gram: Vec<f64>,
    end_points: Vec<Vector3<f64>>,
}

impl Evaluator {
    /// Prepares the evaluation: the identifiable subspace and the workspace grid.
    #[must_use]
    pub fn new(arm: &Arm, orientation: bool, domain: EvennessDomain, step_m: f64, scaling: JacobianScaling) -> Self {
        Evaluator {
            chain: arm.chain.at_nominal(),
            subspace: Subspace::of_structure(arm, orientation),
            grid: WorkspaceGrid::new(arm, domain, step_m),
            scaling,
            rows_per_pose: if orientation { 6 } else { 3 },
            joint_count: arm.joint_count(),
        }
    }

    /// The identifiable subspace of the arm's structure.
    #[must_use]
    pub fn subspace(&self) -> &Subspace {
        &self.subspace
    }

    /// The grid of the evenness.
    #[must_use]
    pub fn grid(&self) -> &WorkspaceGrid {
        &self.grid
    }

    /// Indexes of `configurations`, one after the other (`m × joints`, rad or m), on the identifiable subspace: as many singular
    /// values count as the arm's structure has independent parameters, and all indexes of observability are zero where the set
    /// has fewer.
    pub fn evaluate(&self, configurations: &[f64], scratch: &mut Scratch) -> Indexes {
        let squares = self.squared_singular_values(configurations, scratch);
        let rank = self.subspace.rank();
        self.indexes(squares, rank, &scratch.end_points)
    }

    /// The same with every parameter counted, the plain reading of eqs. 15–17: zero wherever parameters are redundant.
    pub fn evaluate_all_parameters(&self, configurations: &[f64], scratch: &mut Scratch) -> Indexes {
        let squares = self.squared_singular_values(configurations, scratch);
        let count = squares.len();
        let mut indexes = self.indexes(squares, count, &scratch.end_points);
        indexes.rank = self.subspace.rank();
        indexes
    }

    /// End points of the last evaluated set.
    #[must_use]
    pub fn end_points<'a>(&self, scratch: &'a Scratch) -> &'a [Vector3<f64>] {
        &scratch.end_points
    }

    /// Numbers that [`Evaluator::rows_into`] writes.
    #[must_use]
    pub fn row_size(&self) -> usize {
        self.rows_per_pose * self.parameter_count()
    }

    /// Number of parameters: columns of the Jacobian.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        self.chain.parameter_count()
    }

    /// Writes the error Jacobian of `joints` (`rows_per_pose × parameters`, row-major; m, rad) to `rows`; the end point in base, m.
    pub fn rows_into(&self, joints: &[f64], scratch: &mut Vec<f64>, rows: &mut [f64]) -> Vector3<f64> {
        let n = self.parameter_count();
        scratch.resize(6 * n, 0.0);
        let (_, end_point) = self.chain.jacobian_into(joints, scratch, n);
        rows.copy_from_slice(&scratch[..rows.len()]);
        end_point
    }

    /// The singular values that count, largest first: as many as the arm's structure has independent parameters; zeros where the
    /// set shows fewer. `gram` is the lower triangle of JᵀJ (unscaled) of the stacked Jacobian of `poses` configurations.
    #[must_use]
    pub fn singular_values(&self, gram: &[f64], poses: usize) -> Vec<f64> {
        nonzero(self.eigenvalues(gram, poses), self.subspace.rank())
    }

    fn indexes(&self, squares: Vec<f64>, count: usize, end_points: &[Vector3<f64>]) -> Indexes {
        let values = nonzero(squares, count);
        let o = observability(&values);
        let (d, u) = (dispersion(end_points), self.grid.evenness(end_points));
        Indexes {
            o1: o.o1,
            o2: o.o2,
            o3: o.o3,
            o4: o.o4,
            o5: o.o5,
            o6: o.o6,
            dispersion_m2: d,
            evenness: u,
            comprehensive: comprehensive(d, u, [o.o1, o.o2, o.o3]),
            rank: values.iter().filter(|value| **value > 0.0).count(),
        }
    }

    /// Eigenvalues of JᵀJ of the stacked Jacobian: squares of its singular values, in no order. Fills the scratch's end points.
    fn squared_singular_values(&self, configurations: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let n = self.chain.parameter_count();
        scratch.rows.resize(6 * n, 0.0);
        scratch.gram.clear();
        scratch.gram.resize(n * n, 0.0);
        scratch.end_points.clear();
        for joints in configurations.chunks_exact(self.joint_count) {
            let (_, end_point) = self.chain.jacobian_into(joints, &mut scratch.rows, n);
            scratch.end_points.push(end_point);
            dense::add_gram(&scratch.rows[..self.rows_per_pose * n], 1.0, n, &mut scratch.gram);
        }
        self.eigenvalues(&scratch.gram, scratch.end_points.len())
    }

    fn eigenvalues(&self, gram: &[f64], poses: usize) -> Vec<f64> {
        let n = self.parameter_count();
        let entry = |row: usize, column: usize| gram[row.max(column) * n + row.min(column)];
        let gram = match self.scaling {
            JacobianScaling::Si => DMatrix::from_fn(n, n, entry),
            JacobianScaling::PerPose => {
                let share = 1.0 / poses.max(1) as f64;
                DMatrix::from_fn(n, n, |row, column| share * entry(row, column))
            }
            JacobianScaling::Columns => {
                // A column that is zero stays so.
                let over = |column: usize| {
                    let square = entry(column, column);
                    if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 }
                };
                let scale: Vec<f64> = (0..n).map(over).collect();
                DMatrix::from_fn(n, n, |row, column| scale[row] * scale[column] * entry(row, column))
            }
        };
        gram.symmetric_eigenvalues().iter().copied().collect()
    }
}

/// Roots of the `count` largest of the eigenvalues `squares`, zero where these are rounding.
fn nonzero(mut squares: Vec<f64>, count: usize) -> Vec<f64> {
    squares.sort_unstable_by(|a, b| b.total_cmp(a));
    // Below this share of the largest, an eigenvalue of JᵀJ is rounding.
    let floor = squares.first().copied().unwrap_or(0.0) * squares.len() as f64 * f64::EPSILON;
    squares[..count].iter().map(|square| if *square > floor { square.sqrt() } else { 0.0 }).collect()
}

/// Comprehensive quality index O_C (eq. 27): at most 5.
#[must_use]
pub fn comprehensive(dispersion: f64, evenness: f64, o: [f64; 3]) -> f64 {
    let sum = libm::atan(dispersion) + libm::atan(evenness) + o.iter().map(|index| libm::atan(*index)).sum::<f64>();
    std::f64::consts::FRAC_2_PI * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneFile;
    use crate::seed::stream;

    fn paper() -> SceneFile {
        crate::scene::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper.toml")).unwrap()
    }

    fn random_set(arm: &Arm, count: usize, label: &str) -> Vec<f64> {
        let mut stream = stream(1, label);
        (0..count).flat_map(|_| &arm.chain.joints).map(|joint| stream.uniform(joint.lower, joint.upper)).collect()
    }

    #[test]
    fn indexes_are_those_of_the_singular_values_of_the_stacked_jacobian() {
        let arm = paper().scene.arm;
        for orientation in [true, false] {
            let evaluator = Evaluator::new(&arm, orientation, EvennessDomain::Reachable, 0.1, JacobianScaling::Si);
            let rank = evaluator.subspace().rank();
            assert_eq!(rank, if orientation { 36 } else { 33 });
            let set = random_set(&arm, 40, "test/evaluator");
            let ours = evaluator.evaluate(&set, &mut Scratch::default());
            let per_pose = if orientation { 6 } else { 3 };
            let mut stacked = DMatrix::zeros(per_pose * 40, 45);
            let chain = arm.chain.at_nominal();
            for (pose, joints) in set.chunks_exact(8).enumerate() {
                let (_, jacobian) = chain.jacobian(joints);
                stacked.rows_mut(per_pose * pose, per_pose).copy_from(&jacobian.rows(0, per_pose));
            }
            let mut values: Vec<f64> = stacked.singular_values().iter().copied().collect();
            values.sort_by(|a, b| b.total_cmp(a));
            assert!(values[rank - 1] > 1e-3 && values[rank] < 1e-13, "no gap at {rank}");
            let expected = observability(&values[..rank]);
            for (ours, expected) in [
                (ours.o1, expected.o1),
                (ours.o2, expected.o2),
                (ours.o3, expected.o3),
                (ours.o4, expected.o4),
                (ours.o5, expected.o5),
                (ours.o6, expected.o6),
            ] {
                assert!((ours - expected).abs() < 1e-9 * expected, "{ours} is not {expected}");
            }
            let all = evaluator.evaluate_all_parameters(&set, &mut Scratch::default());
            assert_eq!((all.o1, all.o2, all.o3), (0.0, 0.0, 0.0), "redundant parameters make the plain reading zero");
        }
    }

    #[test]
    fn scaling_does_what_its_name_says() {
        let arm = paper().scene.arm;
        let set = random_set(&arm, 40, "test/scaling");
        let with =
            |scaling| Evaluator::new(&arm, true, EvennessDomain::Reachable, 0.1, scaling).evaluate(&set, &mut Scratch::default());
        let (si, per_pose, columns) = (with(JacobianScaling::Si), with(JacobianScaling::PerPose), with(JacobianScaling::Columns));
        assert!((per_pose.o3 * 40f64.sqrt() - si.o3).abs() < 1e-12 * si.o3);
        assert!((per_pose.o2 - si.o2).abs() < 1e-12);
        // The squares of the singular values of 45 columns of length one add up to 45.
        assert!(columns.o3 <= (45.0f64 / 36.0).sqrt() && columns.o3 > 0.01 && columns.rank == 36);
    }

    #[test]
    fn too_few_configurations_observe_nothing() {
        let arm = paper().scene.arm;
        let evaluator = Evaluator::new(&arm, true, EvennessDomain::Reachable, 0.1, JacobianScaling::Si);
        let indexes = evaluator.evaluate(&random_set(&arm, 5, "test/few"), &mut Scratch::default());
        assert_eq!((indexes.rank, indexes.o1, indexes.o3), (30, 0.0, 0.0));
    }
}
