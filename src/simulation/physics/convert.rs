//! Between nalgebra's poses and rapier's (glam's): the only place that knows both.

use nalgebra::{Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::math::{Matrix, Pose as RapierPose, Rotation, Vector};

use crate::arm::frames::Pose;

/// The same vector for rapier.
pub(super) fn vector_to_rapier(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// The same matrix for rapier.
pub(super) fn matrix_to_rapier(m: &Matrix3<f64>) -> Matrix {
    let column = |index: usize| Vector::new(m[(0, index)], m[(1, index)], m[(2, index)]);
    Matrix::from_cols(column(0), column(1), column(2))
}

/// The same pose for rapier.
pub(super) fn pose_to_rapier(pose: &Pose) -> RapierPose {
    let q = pose.rotation.quaternion();
    RapierPose::from_parts(vector_to_rapier(&pose.translation.vector), Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

/// The same pose from rapier. The quaternion is normalised: products along the chain lose a few ulp of its length.
pub(super) fn pose_from_rapier(pose: &RapierPose) -> Pose {
    let (r, t) = (pose.rotation, pose.translation);
    Pose::from_parts(Translation3::new(t.x, t.y, t.z), UnitQuaternion::new_normalize(Quaternion::new(r.w, r.x, r.y, r.z)))
}
