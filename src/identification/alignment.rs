//! The nominal arm in the measurement frame: where it stands, and where the target sits on its tool, are unknown and fitted before all else.

use super::geometry::{self, Geometry, GeometryError, Readings};
use super::prior::Sizes;
use crate::arm::Arm;
use crate::arm::frames::Pose;
use crate::arm::urdf::rpy::rpy_from_matrix;
use crate::measurement::{Measurement, Sensor};

/// `arm` with its chain in the measurement frame ([`crate::arm::Chain::in_measurement_frame`]): the six parameters of the
/// base and those of the target that can be seen have nominal values fitted to `measurements`, everything else stays nominal. This
/// is the "nominal model" of a real arm, whose frames no data sheet tells. Of several sessions and targets it is the first of each.
///
/// # Errors
/// If the measurements do not tell.
pub fn align(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement]) -> Result<Arm, GeometryError> {
    let weights = vec![1.0; measurements.len()];
    let readings = Readings::new(sensor, measurements, &weights);
    Ok(placed(arm, &geometry::fit_at(arm, readings, Sizes::NOMINAL)?))
}

/// `arm` in the measurement frame where `geometry` has it.
#[must_use]
pub fn placed(arm: &Arm, geometry: &Geometry) -> Arm {
    let mut aligned = arm.clone();
    aligned.chain = arm.chain.in_measurement_frame();
    // Silent knows where the cell is in the measurement frame.
    aligned.fixtures.clear();
    let parameters = &mut aligned.chain.parameters;
    let count = parameters.len();
    let mut set = |first: usize, pose: &Pose| {
        for (parameter, value) in parameters[first..first + 6].iter_mut().zip(six(pose)) {
            parameter.nominal = value;
        }
    };
    set(0, &geometry.measurement_from_root()[0]);
    set(count - 6, &geometry.tool_from_target()[0]);
    aligned
}

/// The six parameters of `pose`, in the order of [`crate::arm::Chain::six_parameters`].
#[must_use]
pub fn six(pose: &Pose) -> [f64; 6] {
    let [roll, pitch, yaw] = rpy_from_matrix(pose.rotation.to_rotation_matrix().matrix());
    let at = pose.translation.vector;
    [at.x, at.y, at.z, yaw, pitch, roll]
}
