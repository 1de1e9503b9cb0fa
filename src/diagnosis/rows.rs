//! Measurements as rows of a linear problem: the geometry fitted, residuals, and what each geometric error does to them.
//!
//! The arm stands at `measurement_from_root` and ends in a target on its tool; between its joints sit six small errors per frame
//! with weak Gaussian priors. Base and target are free. All vectors are in the root frame, the chain's first.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::mistake;
use super::scatter::{self, Scatter};
use super::whitening::Whitening;
use crate::arm::Arm;
use crate::arm::frames::{Pose, registration, rotation_from_vector, rotation_vector};
use crate::effects::signature::posture::{Mechanism, Posture};
use crate::effects::signature::shape::Displacement;
use crate::measurement::{Measurement, Sensor};

/// One sigma of a joint frame's position, m: machining and assembly are better than this.
const FRAME_SHIFT: f64 = 5e-3;
/// One sigma of a joint frame's orientation, rad.
const FRAME_TURN: f64 = 10e-3;
/// Base and target are free: so wide, about where the fit finds them, that it never binds.
const FREE_SHIFT: f64 = 50e-3;
const FREE_TURN: f64 = 50e-3;
/// Fitted errors of a frame over their prior's sigma beyond which it is another robot, or its readings are wrong.
const IMPLAUSIBLE: f64 = 12.0;
/// Steps of the fit.
const STEPS: usize = 30;

/// Why nothing can be diagnosed.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum DiagnosisError {
    /// Too few rows.
    #[error("{found} rows at {different} different configurations; a diagnosis needs at least {needed} different ones")]
    TooFew {
        /// Rows.
        found: usize,
        /// Different configurations.
        different: usize,
        /// Least.
        needed: usize,
    },
    /// All in one place.
    #[error(
        "the measured (or the nominal) positions lie in one point or on one line, so that they cannot tell where the arm stands; \
         are the joint units right, and is it this robot?"
    )]
    Degenerate,
    /// The fit went astray.
    #[error("no arm of this kind makes these readings: with base, target and geometry fitted, {rms_mm:.0} mm RMS remain. {hint}")]
    NotThisRobot {
        /// Remaining, mm.
        rms_mm: f64,
        /// What would fit, if anything simple does.
        hint: String,
    },
    /// The fit bent the arm out of shape.
    #[error(
        "these readings fit only an arm whose frames are up to {shift_mm:.0} mm and {turn_deg:.1}° off its nominal model, which no arm of \
         this kind is. {hint}"
    )]
    NotThisGeometry {
        /// Largest shift of a frame along an axis, mm.
        shift_mm: f64,
        /// Largest turn of a frame about an axis, degrees.
        turn_deg: f64,
        /// What would fit, if anything simple does.
        hint: String,
    },
    /// Rows with another number of joints.
    #[error("row {row} has {found} joint readings, the robot has {expected} joints")]
    Joints {
        /// From 1.
        row: usize,
        /// Readings.
        found: usize,
        /// Joints.
        expected: usize,
    },
}

/// The fitted geometry and what it leaves.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Fitted arm.
    pub mechanism: Mechanism,
    /// Where it stands, by session; one for all where they agree.
    pub measurement_from_root: Vec<Pose>,
    /// Session of each row, as far as they have bases of their own.
    pub session: Vec<usize>,
    /// Arm in each row.
    pub postures: Vec<Posture>,
    /// Target in root of each row, m.
    pub targets: Vec<Vector3<f64>>,
    /// Equations per row: 3, with orientations 6.
    pub per_row: usize,
    /// Residuals, m and rad.
    pub residual: DVector<f64>,
    /// What makes the equations alike in noise.
    pub whitening: Whitening,
    /// What each geometric parameter, scaled by its prior's sigma, does.
    pub jacobian: DMatrix<f64>,
    /// The fitted parameters over the sigmas of their priors.
    pub parameters: DVector<f64>,
    /// Which parameters are free (base and target).
    pub free: Vec<bool>,
    /// Names of the targets.
    pub targets_named: Vec<String>,
    /// Sum of squares of whitened residuals and of the prior's pull.
    pub cost: f64,
    /// What is worth knowing about the sessions.
    pub notes: Vec<String>,
}

/// Sigmas of the position (m) and the orientation (rad) of a reading.
fn sigmas(sensor: &Sensor, position: &Vector3<f64>) -> (f64, f64) {
    (sensor.position_sigma_at(position).max(1e-9), sensor.orientation_sigma_rad.unwrap_or(1.0).max(1e-9))
}

/// Improvement over the noise's mean square, by parameter, from which on sessions have bases of their own (an F value).
const OWN_BASE: f64 = 6.0;

/// Readings to be fitted.
#[derive(Clone, Copy)]
pub struct Readings<'a> {
    /// The sensor.
    pub sensor: &'a Sensor,
    /// What was read.
    pub measurements: &'a [&'a Measurement],
    /// Weight of each row: 1 for a good one that stands for itself.
    pub weights: &'a [f64],
    /// What effects that are already known do to the target: shift (m) and turn (rad) in root, row by row; empty for nothing.
    pub displacement: &'a [Displacement],
    /// Joints that do not repeat.
    pub scatter: &'a [Scatter],
}

/// Fits base, target and geometry of `arm` to `readings`. Sessions get bases of their own where that is worth it.
///
/// # Errors
/// If the measurements cannot tell.
pub fn fit(arm: &Arm, readings: Readings<'_>) -> Result<Rows, DiagnosisError> {
    let name = |row: &Measurement| row.session.clone().unwrap_or_default();
    let mut names: Vec<String> = readings.measurements.iter().map(|row| name(row)).collect();
    names.sort();
    names.dedup();
    let together = fit_with(arm, readings, &vec![0; readings.measurements.len()], 1);
    if names.len() < 2 {
        return together;
    }
    let session: Vec<usize> =
        readings.measurements.iter().map(|row| names.iter().position(|known| *known == name(row)).unwrap_or(0)).collect();
    let apart = fit_with(arm, readings, &session, names.len())?;
    let added = 6.0 * (names.len() - 1) as f64;
    let left = (apart.residual.len() as f64 - apart.jacobian.ncols() as f64).max(1.0);
    match together {
        Ok(together) if (together.cost - apart.cost) / added < OWN_BASE * apart.cost / left => {
            let notes = vec![format!("the {} sessions share one base: bases of their own would not fit better", names.len())];
            Ok(Rows { notes, ..together })
        }
        _ => {
            let first = &apart.measurement_from_root[0];
            let moved: Vec<String> = names[1..]
                .iter()
                .zip(&apart.measurement_from_root[1..])
                .map(|(name, base)| {
                    let change = first.inverse() * base;
                    let (shift, turn) = (change.translation.vector.norm(), rotation_vector(&change.rotation).norm());
                    format!("`{name}` {:.3} mm and {:.3} mrad", shift * 1e3, turn * 1e3)
                })
                .collect();
            let note = format!(
                "the sessions have bases of their own; against `{}` the base or the sensor has moved in session {}",
                names[0],
                moved.join(", ")
            );
            Ok(Rows { notes: vec![note], ..apart })
        }
    }
}

/// As [`fit`]; `session` of each row, `bases` of them.
fn fit_with(arm: &Arm, readings: Readings<'_>, session: &[usize], bases: usize) -> Result<Rows, DiagnosisError> {
    let Readings { sensor, measurements, weights, displacement, scatter } = readings;
    let mut mechanism = Mechanism::new(arm);
    let count = mechanism.joint_count();
    for (row, measurement) in measurements.iter().enumerate() {
        let found = measurement.joints.len();
        if found != count {
            return Err(DiagnosisError::Joints { row: row + 1, found, expected: count });
        }
    }
    let mut different: Vec<&[f64]> = measurements.iter().map(|row| row.joints.as_slice()).collect();
    different.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    different.dedup();
    if different.len() < 6 {
        return Err(DiagnosisError::TooFew { found: measurements.len(), different: different.len(), needed: 6 });
    }
    let orientation = sensor.orientation_sigma_rad.is_some() && measurements.iter().all(|row| row.orientation_xyzw.is_some());
    let per_row = if orientation { 6 } else { 3 };
    let name = |row: &Measurement| row.target.clone().unwrap_or_default();
    let mut targets_named: Vec<String> = measurements.iter().map(|row| name(row)).collect();
    targets_named.sort();
    targets_named.dedup();
    let which: Vec<usize> =
        measurements.iter().map(|row| targets_named.iter().position(|known| *known == name(row)).unwrap_or(0)).collect();
    let mut offsets = vec![Vector3::zeros(); targets_named.len()];
    let mut turns = vec![UnitQuaternion::identity(); targets_named.len()];
    let per_target = if orientation { 6 } else { 3 };

    let from: Vec<Vector3<f64>> = measurements.iter().map(|row| mechanism.posture(&row.joints, 0.0).tool).collect();
    let to: Vec<Vector3<f64>> = measurements.iter().map(|row| row.position().coords).collect();
    let of_all = registration(&from, &to).ok_or(DiagnosisError::Degenerate)?;
    let mut measurement_from_root: Vec<Pose> = (0..bases)
        .map(|base| {
            let own = |points: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
                points.iter().zip(session).filter(|(_, of)| **of == base).map(|(point, _)| *point).collect()
            };
            let (from, to) = (own(&from), own(&to));
            if bases == 1 || from.len() < 4 { of_all } else { registration(&from, &to).unwrap_or(of_all) }
        })
        .collect();
    if orientation {
        // The first reading of each target tells its orientation well enough to start from.
        for (target, turn) in turns.iter_mut().enumerate() {
            if let Some(row) = which.iter().position(|known| *known == target) {
                let posture = mechanism.posture(&measurements[row].joints, 0.0);
                let tool = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(posture.tool_axes));
                let measured = measurements[row].orientation().unwrap_or_default();
                *turn = (measurement_from_root[session[row]].rotation * tool).inverse() * measured;
            }
        }
    }

    let frames = count - 1;
    // Bases, then frames from that of joint 2 on, then targets.
    let frame_at = |joint: usize| 6 * bases + 6 * (joint - 1);
    let target_at = |target: usize| 6 * bases + 6 * frames + per_target * target;
    let width = target_at(targets_named.len());
    let free: Vec<bool> = (0..width).map(|column| column < 6 * bases || column >= target_at(0)).collect();
    let prior = |column: usize| {
        let is_turn = if column < target_at(0) { column % 6 >= 3 } else { (column - target_at(0)) % per_target >= 3 };
        match (free[column], is_turn) {
            (true, false) => FREE_SHIFT,
            (true, true) => FREE_TURN,
            (false, false) => FRAME_SHIFT,
            (false, true) => FRAME_TURN,
        }
    };
    let prior: Vec<f64> = (0..width).map(prior).collect();
    let mut parameters: DVector<f64> = DVector::zeros(width);
    let reach: f64 = mechanism.segments.iter().map(|segment| segment.translation.vector.norm()).sum();
    let equations = per_row * measurements.len();
    let mut damping = 0.0;
    let mut best = f64::INFINITY;
    for step in 0.. {
        // Base and target first: what is fitted with them far off would throw the frames about.
        let coarse = step < 8;
        let mut jacobian = DMatrix::zeros(equations, width);
        let mut residual = DVector::zeros(equations);
        let mut inverse_sigmas = DVector::zeros(equations);
        let (mut postures, mut targets) = (Vec::new(), Vec::new());
        let root_from_measurement: Vec<Pose> = measurement_from_root.iter().map(Pose::inverse).collect();
        for (row, measurement) in measurements.iter().enumerate() {
            let posture = mechanism.posture(&measurement.joints, measurement.payload_kg.unwrap_or(0.0));
            let target = posture.tool + posture.tool_axes * offsets[which[row]];
            let first = row * per_row;
            let root_from_measurement = &root_from_measurement[session[row]];
            let [x, y, z, rx, ry, rz] = displacement.get(row).copied().unwrap_or_default();
            let measured = (root_from_measurement * measurement.position()).coords;
            residual.fixed_rows_mut::<3>(first).copy_from(&(measured - target - Vector3::new(x, y, z)));
            let (position, turn) = sigmas(sensor, &measurement.position().coords);
            for equation in 0..per_row {
                inverse_sigmas[first + equation] = 1.0 / if equation < 3 { position } else { turn };
            }
            if let (true, Some(measured)) = (orientation, measurement.orientation()) {
                let tool = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(posture.tool_axes));
                let predicted = rotation_from_vector(&Vector3::new(rx, ry, rz)) * tool * turns[which[row]];
                let difference = rotation_vector(&(root_from_measurement.rotation * measured * predicted.inverse()));
                residual.fixed_rows_mut::<3>(first + 3).copy_from(&difference);
            }
            let mut put = |column: usize, shift: Vector3<f64>, turn: Vector3<f64>| {
                for axis in 0..3 {
                    jacobian[(first + axis, column)] = shift[axis] * prior[column];
                    if orientation {
                        jacobian[(first + 3 + axis, column)] = turn[axis] * prior[column];
                    }
                }
            };
            let mut frame = |column: usize, axes: &Matrix3<f64>, origin: &Vector3<f64>| {
                for axis in 0..3 {
                    let direction: Vector3<f64> = axes.column(axis).into();
                    put(column + axis, direction, Vector3::zeros());
                    put(column + 3 + axis, direction.cross(&(target - origin)), direction);
                }
            };
            frame(6 * session[row], &Matrix3::identity(), &Vector3::zeros());
            if !coarse {
                for joint in 1..count {
                    let moved = &posture.frames[joint - 1];
                    let axes = moved * mechanism.segments[joint].rotation.to_rotation_matrix().into_inner();
                    frame(frame_at(joint), &axes, &posture.origins[joint]);
                }
            }
            let column = target_at(which[row]);
            for axis in 0..3 {
                let direction: Vector3<f64> = posture.tool_axes.column(axis).into();
                put(column + axis, direction, Vector3::zeros());
                if orientation {
                    put(column + 3 + axis, Vector3::zeros(), direction);
                }
            }
            postures.push(posture);
            targets.push(target);
        }
        let mut whitening = Whitening::new(inverse_sigmas, weights);
        if !scatter.is_empty() {
            whitening = whitening.with(&scatter::displaced(&mechanism, &postures, &targets, per_row, scatter));
        }
        let whitened = whitening.of(&jacobian);
        let errors = whitening.of_vector(&residual);
        // The prior pulls the frames' errors to zero, and base and target to where they are.
        let pull = DVector::from_fn(width, |column, _| if free[column] { 0.0 } else { -parameters[column] });
        let cost = errors.norm_squared() + pull.norm_squared();
        let mut normal = whitened.transpose() * &whitened;
        for column in 0..width {
            normal[(column, column)] += 1.0;
            normal[(column, column)] *= 1.0 + damping;
        }
        let gradient = whitened.transpose() * &errors + &pull;
        let change = normal.cholesky().map(|cholesky| cholesky.solve(&gradient));
        let done = change.as_ref().is_none_or(|change| change.norm() < 1e-9) || step >= STEPS;
        if (done && !coarse) || step >= STEPS {
            let rms = libm::sqrt(
                measurements
                    .iter()
                    .enumerate()
                    .map(|(row, _)| residual.fixed_rows::<3>(row * per_row).norm_squared())
                    .sum::<f64>()
                    / measurements.len() as f64,
            );
            if rms.is_nan() || rms >= 0.05 * reach.max(0.1) {
                return Err(DiagnosisError::NotThisRobot { rms_mm: rms * 1e3, hint: mistake::hint(arm, measurements) });
            }
            let largest = |turn: bool| {
                let of = |column: &usize| !free[*column] && (column % 6 >= 3) == turn;
                (0..width).filter(of).map(|column| (parameters[column] * prior[column]).abs()).fold(0.0, f64::max)
            };
            if parameters.iter().zip(&free).any(|(value, free)| !free && value.abs() > IMPLAUSIBLE) {
                return Err(DiagnosisError::NotThisGeometry {
                    shift_mm: largest(false) * 1e3,
                    turn_deg: largest(true).to_degrees(),
                    hint: mistake::hint(arm, measurements),
                });
            }
            return Ok(Rows {
                mechanism,
                measurement_from_root,
                session: session.to_vec(),
                postures,
                targets,
                per_row,
                residual,
                whitening,
                jacobian,
                parameters,
                free,
                targets_named,
                cost,
                notes: Vec::new(),
            });
        }
        damping = if cost > best && step > 8 { (10.0 * damping).max(1e-3) } else { damping / 10.0 };
        best = cost;
        let change = change.unwrap_or_else(|| DVector::zeros(width));
        parameters += &change;
        let part = |column: usize| {
            let at = |offset: usize| change[column + offset] * prior[column + offset];
            (Vector3::new(at(0), at(1), at(2)), column + 3)
        };
        let pose = |column: usize| {
            let (shift, next) = part(column);
            let turn = Vector3::from_fn(|axis, _| change[next + axis] * prior[next + axis]);
            Pose::from_parts(Translation3::from(shift), rotation_from_vector(&turn))
        };
        for (base, measurement_from_root) in measurement_from_root.iter_mut().enumerate() {
            *measurement_from_root *= pose(6 * base);
        }
        for joint in 1..count {
            mechanism.segments[joint] *= pose(frame_at(joint));
        }
        for target in 0..targets_named.len() {
            let column = target_at(target);
            offsets[target] += part(column).0;
            if orientation {
                let turn = Vector3::from_fn(|axis, _| change[column + 3 + axis] * prior[column + 3 + axis]);
                turns[target] = rotation_from_vector(&turn) * turns[target];
            }
        }
    }
    unreachable!("the loop ends by returning")
}
