//! Points and planes on which the target was and of which nobody knows where they are ([`Feature`]).
//!
//! Each has a pose in the measurement frame with three unknowns: of a point the place (its axes are the frame's own); of a plane, whose normal
//! is its z axis, the shift along that and the turns about the other two. A reading says that the target is at the pose's origin, or
//! that its z in the pose's frame is nothing.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

use crate::arm::frames::{Pose, rotation_from_vector};
use crate::arm::urdf::rpy::z_onto;
use crate::measurement::Feature;

/// Unknowns of a feature.
pub(super) const UNKNOWNS: usize = 3;
/// Rounds of laying planes through points and placing the targets in turn.
const ROUNDS: usize = 40;
/// How much a target's place counts that nothing tells.
const RIDGE: f64 = 1e-9;

/// Pose of `feature` where the target was at these points of the measurement frame, m.
pub(super) fn through(feature: &Feature, points: &[Vector3<f64>]) -> Pose {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    match feature {
        Feature::Point(_) => Pose::translation(centre.x, centre.y, centre.z),
        Feature::Plane(_) => {
            let spread: Matrix3<f64> = points.iter().map(|point| (point - centre) * (point - centre).transpose()).sum();
            let eigen = SymmetricEigen::new(spread);
            let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            Pose::from_parts(centre.into(), z_onto(&normal))
        }
    }
}

/// What the unknowns of `feature` do to its reading, component by component (rows) of the target's place in its frame, which is `target` (m).
pub(super) fn derivative(feature: &Feature, target: &Vector3<f64>) -> Matrix3<f64> {
    match feature {
        Feature::Point(_) => -Matrix3::identity(),
        Feature::Plane(_) => {
            let mut matrix = Matrix3::zeros();
            matrix.set_row(2, &nalgebra::RowVector3::new(-1.0, -target.y, target.x));
            matrix
        }
    }
}

/// `pose` of `feature`, moved by its unknowns: m, or m and rad.
pub(super) fn moved(feature: &Feature, pose: &Pose, by: &Vector3<f64>) -> Pose {
    match feature {
        Feature::Point(_) => Pose::translation(by.x, by.y, by.z) * pose,
        Feature::Plane(_) => {
            let turn = rotation_from_vector(&Vector3::new(by.y, by.z, 0.0));
            pose * Pose::from_parts(Vector3::new(0.0, 0.0, by.x).into(), turn)
        }
    }
}

/// Places of the targets on the tool at which the readings come nearest to their features, the arm at its root. `poses` of the tool, which
/// `target` each has and on which of `features` it was.
pub(super) fn targets(
    poses: &[Pose],
    target: &[usize],
    feature: &[Option<usize>],
    features: &[Feature],
    count: usize,
) -> Option<Vec<Vector3<f64>>> {
    let width = 3 * count;
    let mut offsets = vec![Vector3::zeros(); count];
    let rounds = if features.iter().any(|feature| matches!(feature, Feature::Plane(_))) { ROUNDS } else { 1 };
    for _ in 0..rounds {
        let mut normal = DMatrix::identity(width, width) * RIDGE;
        let mut right = DVector::zeros(width);
        for (number, kind) in features.iter().enumerate() {
            let rows: Vec<usize> = (0..poses.len()).filter(|row| feature[*row] == Some(number)).collect();
            let points: Vec<Vector3<f64>> =
                rows.iter().map(|row| poses[*row] * nalgebra::Point3::from(offsets[target[*row]])).map(|at| at.coords).collect();
            // Along a plane the target may be anywhere.
            let seen = match kind {
                Feature::Point(_) => Matrix3::identity(),
                Feature::Plane(_) => {
                    let axis = through(kind, &points).rotation * Vector3::z();
                    axis * axis.transpose()
                }
            };
            let lines: Vec<(Vector3<f64>, DMatrix<f64>)> = rows
                .iter()
                .map(|row| {
                    let mut matrix = DMatrix::zeros(3, width);
                    let turn = seen * poses[*row].rotation.to_rotation_matrix().into_inner();
                    matrix.view_mut((0, 3 * target[*row]), (3, 3)).copy_from(&turn);
                    (seen * poses[*row].translation.vector, matrix)
                })
                .collect();
            let share = 1.0 / lines.len().max(1) as f64;
            let middle = lines.iter().map(|(at, _)| at).sum::<Vector3<f64>>() * share;
            let of_middle = lines.iter().fold(DMatrix::zeros(3, width), |sum, (_, matrix)| sum + matrix) * share;
            for (at, matrix) in &lines {
                let (off, matrix) = (at - middle, matrix - &of_middle);
                normal += matrix.tr_mul(&matrix);
                right -= matrix.tr_mul(&DMatrix::from_column_slice(3, 1, off.as_slice())).column(0);
            }
        }
        let found = normal.cholesky()?.solve(&right);
        offsets = (0..count).map(|target| found.fixed_rows::<3>(3 * target).into_owned()).collect();
    }
    Some(offsets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    #[test]
    fn a_plane_goes_through_its_points_and_its_unknowns_move_it_as_they_say() {
        let mut draws = stream(1, "test/feature");
        let mut three = |size: f64| Vector3::from_fn(|_, _| draws.uniform(-size, size));
        let plane = Feature::Plane("table".to_owned());
        for _ in 0..20 {
            let true_one = Pose::from_parts(three(1.0).into(), rotation_from_vector(&three(1.5)));
            let points: Vec<Vector3<f64>> =
                (0..9).map(|_| three(0.5)).map(|at| (true_one * nalgebra::Point3::new(at.x, at.y, 0.0)).coords).collect();
            let found = through(&plane, &points);
            let height = |pose: &Pose, at: &Vector3<f64>| (pose.inverse() * nalgebra::Point3::from(*at)).coords;
            assert!(points.iter().all(|at| height(&found, at).z.abs() < 1e-12));
            let (by, at) = (three(1e-6), three(1.0));
            let expected = height(&found, &at).z + (derivative(&plane, &height(&found, &at)) * by).z;
            assert!((height(&moved(&plane, &found, &by), &at).z - expected).abs() < 1e-11);
        }
    }
}
