//! Where a real arm stands in the measurement frame, and where the target sits on its tool: unknown, and fitted before all else.

use nalgebra::{UnitQuaternion, Vector3};

use super::least_squares::fit_some;
use crate::arm::Arm;
use crate::arm::frames::registration;
use crate::measurement::{Measurement, Sensor};

/// The measurement frame and the target could not be found.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum AlignmentError {
    /// Too few rows.
    #[error(
        "{found} measurements to fit cannot tell where the arm stands in the measurement frame; at least 4 different ones are needed"
    )]
    TooFew {
        /// Rows.
        found: usize,
    },
    /// All in one place.
    #[error(
        "the measured (or the nominal) positions lie in one point or on one line, so that they cannot tell where the arm stands; \
         are the joint units right, and is it this robot?"
    )]
    Degenerate,
    /// The fit failed.
    #[error("fitting the measurement frame and the target did not converge; are the units right, and is it this robot?")]
    NotConverged,
}

/// `arm` with its chain in the measurement frame ([`crate::arm::Chain::in_measurement_frame`]): the six parameters of the
/// base and those of the target that can be seen have nominal values fitted to `measurements`, everything else stays nominal. This
/// is the "nominal model" of a real arm, whose frames no data sheet tells.
///
/// # Errors
/// If the measurements do not tell.
pub fn align(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement]) -> Result<Arm, AlignmentError> {
    if measurements.len() < 4 {
        return Err(AlignmentError::TooFew { found: measurements.len() });
    }
    let nominal = arm.chain.at_nominal();
    let poses: Vec<_> = measurements.iter().map(|measurement| nominal.forward(&measurement.joints)).collect();
    let register = |rows: &dyn Fn(&&Measurement) -> bool| {
        let (predicted, measured): (Vec<Vector3<f64>>, Vec<Vector3<f64>>) = (measurements.iter().zip(&poses))
            .filter(|(row, _)| rows(row))
            .map(|(row, pose)| (pose.translation.vector, row.position().coords))
            .unzip();
        if measured.is_empty() { None } else { registration(&predicted, &measured) }
    };
    // A coordinate that was not read is taken as zero where there are no others: near enough to begin with.
    let registered =
        register(&|row| row.unread == [false; 3]).or_else(|| register(&|_| true)).ok_or(AlignmentError::Degenerate)?;
    let (rotation, translation) = (registered.rotation, registered.translation.vector);

    let mut aligned = arm.clone();
    aligned.chain = arm.chain.in_measurement_frame();
    // Silent knows where the cell is in the measurement frame.
    aligned.fixtures.clear();
    let parameters = &mut aligned.chain.parameters;
    let count = parameters.len();
    let mut set = |first: usize, translation: Vector3<f64>, rotation: UnitQuaternion<f64>| {
        let (roll, pitch, yaw) = rotation.euler_angles();
        let values = [translation.x, translation.y, translation.z, yaw, pitch, roll];
        for (parameter, value) in parameters[first..first + 6].iter_mut().zip(values) {
            parameter.nominal = value;
        }
    };
    set(0, translation, rotation);
    // Where orientations are measured, the first tells the target's well enough to start from.
    if let (Some(orientation), Some(pose)) = (measurements[0].orientation(), poses.first()) {
        set(count - 6, Vector3::zeros(), (rotation * pose.rotation).inverse() * orientation);
    }
    let free: Vec<usize> = (0..6).chain(count - 6..count).collect();
    let values = fit_some(&aligned, sensor, measurements, &free).ok_or(AlignmentError::NotConverged)?;
    for (parameter, value) in aligned.chain.parameters.iter_mut().zip(values) {
        parameter.nominal = value;
    }
    Ok(aligned)
}
