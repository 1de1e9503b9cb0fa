//! Roll, pitch and yaw: `Rot(z, yaw) Rot(y, pitch) Rot(x, roll)`, as `[roll, pitch, yaw]`, rad.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// The rotation with roll, pitch and yaw.
pub(crate) fn rotation_from_rpy([roll, pitch, yaw]: [f64; 3]) -> UnitQuaternion<f64> {
    // Through libm, so that every machine gets the same bits.
    let about = |axis: usize, angle: f64| {
        let (sine, cosine) = libm::sincos(angle / 2.0);
        let mut vector = Vector3::zeros();
        vector[axis] = sine;
        UnitQuaternion::new_unchecked(Quaternion::from_parts(cosine, vector))
    };
    about(2, yaw) * about(1, pitch) * about(0, roll)
}

/// Roll, pitch and yaw of a rotation matrix. Where pitch is ±90° the split between roll and yaw is arbitrary, but the three still
/// multiply to the matrix up to rounding.
pub(crate) fn rpy_from_matrix(matrix: &Matrix3<f64>) -> [f64; 3] {
    let pitch = libm::atan2(-matrix[(2, 0)], libm::hypot(matrix[(0, 0)], matrix[(1, 0)]));
    let yaw = libm::atan2(matrix[(1, 0)], matrix[(0, 0)]);
    // Roll of what is left once yaw is undone: a yaw from rounded zeros is made up for here.
    let (sine, cosine) = libm::sincos(yaw);
    let roll = libm::atan2(sine * matrix[(0, 2)] - cosine * matrix[(1, 2)], cosine * matrix[(1, 1)] - sine * matrix[(0, 1)]);
    [roll, pitch, yaw]
}

/// The shortest turn that takes z to the unit vector `direction`.
pub(crate) fn z_onto(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    let across = direction.x * direction.x + direction.y * direction.y;
    // 1 + z, without cancellation near −z.
    let scalar = if direction.z < 0.0 { across / (1.0 - direction.z) } else { 1.0 + direction.z };
    if scalar == 0.0 && across == 0.0 {
        // Right round: any axis across z will do.
        return UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    }
    let half_way = Quaternion::new(scalar, -direction.y, direction.x, 0.0);
    UnitQuaternion::new_normalize(half_way)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn roll_pitch_and_yaw_multiply_to_the_matrix_they_were_taken_from() {
        let mut stream = stream(1, "test/rpy");
        let pitches = [0.3, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 - 1e-9, -FRAC_PI_2 + 1e-12, 0.0, 2.0];
        for index in 0..700 {
            let rpy = [stream.uniform(-PI, PI), pitches[index % 7], stream.uniform(-PI, PI)];
            let matrix = rotation_from_rpy(rpy).to_rotation_matrix().into_inner();
            let back = rotation_from_rpy(rpy_from_matrix(&matrix)).to_rotation_matrix().into_inner();
            assert!((matrix - back).norm() < 3e-15, "{rpy:?}");
        }
    }

    #[test]
    fn z_is_turned_onto_any_direction() {
        let mut stream = stream(2, "test/rpy/z");
        for index in 0..200 {
            let direction = match index {
                0 => -Vector3::z(),
                1 => Vector3::z(),
                2 => Vector3::new(1e-7, 0.0, -1.0).normalize(),
                _ => Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize(),
            };
            let turned = z_onto(&direction) * Vector3::z();
            assert!((turned - direction).norm() < 2e-15, "{direction} {turned}");
        }
    }
}
