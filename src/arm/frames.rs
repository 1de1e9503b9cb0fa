//! Poses and their difference: the one place where conventions are fixed.
//!
//! A pose is named `a_from_b`: it maps coordinates of frame `b` into frame `a`, so that inner names cancel:
//! `base_from_tool = base_from_flange * flange_from_tool`. Lengths are metres, angles radians.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3, Vector6};

/// A rigid transform `a_from_b`.
pub type Pose = Isometry3<f64>;

/// The pose with a rotation matrix `rotation` and an origin `translation`.
#[must_use]
pub fn pose_from_parts(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Pose {
    let rotation = Rotation3::from_matrix_unchecked(*rotation);
    Pose::from_parts(Translation3::from(*translation), UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The difference of two poses of one frame, both given in `base`: metres for the origin, then the rotation vector (rad) that
/// turns `predicted` into `measured`; both expressed in `base`.
///
/// This is the residual of the identification and what every error in a report is the length of.
#[must_use]
pub fn pose_error(measured: &Pose, predicted: &Pose) -> Vector6<f64> {
    let position = measured.translation.vector - predicted.translation.vector;
    let rotation = rotation_vector(&(measured.rotation * predicted.rotation.inverse()));
    Vector6::new(position.x, position.y, position.z, rotation.x, rotation.y, rotation.z)
}

/// The rotation vector (axis times angle, rad, angle in `[0, π]`) of a rotation, accurate for small angles.
#[must_use]
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let sine = v.norm();
    if sine < 1e-150 {
        return Vector3::zeros();
    }
    v * (2.0 * libm::atan2(sine, w) / sine)
}

/// The rotation whose rotation vector is `vector` (rad).
#[must_use]
pub fn rotation_from_vector(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = vector.norm() / 2.0;
    let (sine, cosine) = libm::sincos(half);
    // sin(h)/(2h) → 1/2 as the angle vanishes.
    let factor = if half < 1e-9 { 0.5 } else { sine / (2.0 * half) };
    UnitQuaternion::new_normalize(nalgebra::Quaternion::from_parts(cosine, vector * factor))
}

/// The pose `to_from_from` that brings the points `from` (m) nearest to the points `to` in the least-squares sense (Kabsch 1976); `None` where
/// the points lie on a line.
#[must_use]
pub fn registration(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Pose> {
    let count = from.len() as f64;
    let (from_centre, to_centre) = (from.iter().sum::<Vector3<f64>>() / count, to.iter().sum::<Vector3<f64>>() / count);
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(from, to)| (to - to_centre) * (from - from_centre).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut values: Vec<f64> = svd.singular_values.iter().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    if values[1] <= values[0] * 1e-9 || !values[0].is_finite() || values[0] < 1e-12 {
        return None;
    }
    let mut signs = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    signs[(smallest, smallest)] = (u * v_t).determinant().signum();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * signs * v_t));
    Some(Pose::from_parts(Translation3::from(to_centre - rotation * from_centre), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_rotation_vector_is_the_inverse_of_the_exponential(
            x in -1.7..1.7f64, y in -1.7..1.7f64, z in -1.7..1.7f64, scale in prop::sample::select(vec![1.0, 1e-4, 1e-9, 1e-13]),
        ) {
            let vector = Vector3::new(x, y, z) * scale;
            let back = rotation_vector(&rotation_from_vector(&vector));
            prop_assert!((back - vector).norm() <= 1e-14 + 4e-15 * vector.norm(), "{vector} became {back}");
        }
    }

    #[test]
    fn the_error_of_a_turned_pose_is_its_rotation_vector_in_base() {
        let predicted = Pose::from_parts(Translation3::new(0.1, 0.2, 0.3), rotation_from_vector(&Vector3::new(0.4, -0.2, 1.0)));
        let turn = Vector3::new(1e-3, 2e-3, -1e-3);
        let measured = Pose::from_parts(Translation3::new(0.11, 0.2, 0.3), rotation_from_vector(&turn) * predicted.rotation);
        let error = pose_error(&measured, &predicted);
        assert!((error - Vector6::new(0.01, 0.0, 0.0, turn.x, turn.y, turn.z)).norm() < 1e-15);
    }
}
