//! The calibration of a real arm, whose frame of measurement and whose target nobody knows: the geometry that a diagnosis fits too
//! ([`super::geometry`]), told in the parameters of the arm's own description.

use nalgebra::{Cholesky, DMatrix};

use super::geometry::{self, FRAME_SHIFT, FRAME_TURN, FREE, Geometry, Readings};
use super::least_squares::{FOREIGN_ROBOT, IdentificationError, MAX_STEPS, Plain, Solved, check_joints, conclude};
use super::outcome::Identification;
use crate::arm::{Arm, Quantity};
use crate::measurement::equations::Equations;
use crate::measurement::{Measurement, Role, Sensor, Weights};
use crate::numerics;
use crate::quality::subspace::Subspace;
use crate::seed::stream;
use crate::solver::{Problem, robust, solve};

/// Configurations beside the measured ones at which the arm's own parameters must put the target where the fitted geometry has it.
const SAMPLES: usize = 60;
/// Largest distance (m) by which they may miss it.
const EXPRESSED: f64 = 1e-9;
/// Readings that are far off of which the number is said, at most.
const FAR_SAID: usize = 12;
/// A combination whose standard error is above this share of what was known of it beforehand is told by that, not by the data.
const HARDLY_SEEN: f64 = 0.5;

/// Identifies `robot` from `measurements` with [`Role::Fit`] in any frame, by the fit that a diagnosis makes with all weights one; `aligned`
/// is the same arm in the measurement frame with base and target fitted alone ([`super::alignment::align`]), whose parameters are
/// reported. Sessions may have bases of their own, and several targets may be read; the parameters of base and target are then those
/// of the first.
///
/// Readings that are far off from what the others say together (by the median of all) are left out, and named in the notes.
///
/// Parameters that the data hardly show stay near their nominal values, for a prior whose size the readings choose
/// ([`geometry::fit_shrunk`]) says how far this arm is off; the notes name them.
///
/// # Errors
/// If there are too few measurements or they do not fit the arm.
pub fn identify_real(
    robot: &Arm,
    aligned: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
) -> Result<Identification, IdentificationError> {
    check_joints(robot, measurements)?;
    let far = far_off(robot, sensor, measurements)?;
    if far.is_empty() {
        return identify_good(robot, aligned, sensor, measurements, Vec::new());
    }
    let good: Vec<Measurement> = measurements
        .iter()
        .enumerate()
        .filter(|(at, _)| !far.iter().any(|(row, _)| row == at))
        .map(|(_, row)| row.clone())
        .collect();
    let said = |(row, off): &(usize, f64)| format!("{} ({:.1} mm)", measurements[*row].index + 1, off * 1e3);
    let mut list: Vec<String> = far.iter().take(FAR_SAID).map(said).collect();
    if far.len() > FAR_SAID {
        list.push(format!("{} more", far.len() - FAR_SAID));
    }
    let note = format!(
        "{} of {} readings are far off from what the others say and were left out: number {}",
        far.len(),
        measurements.len(),
        list.join(", ")
    );
    identify_good(robot, aligned, sensor, &good, vec![note])
}

/// Smallest estimated noise over what is assumed first: below it readings are made by a computer, and any number would do.
const LEAST_NOISE: f64 = 1e-3;

/// As [`identify_real`], where nobody declared the noise: what is left of a first fit tells it, for positions and orientations in the
/// proportion that `sensor` has them.
///
/// # Errors
/// As [`identify_real`].
pub fn identify_real_without_noise(
    robot: &Arm,
    aligned: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
) -> Result<Identification, IdentificationError> {
    let first = identify_real(robot, aligned, sensor, measurements)?;
    let Some(scale) = first.residual_scale.filter(|scale| scale.is_finite()) else {
        return Ok(first);
    };
    let scale = scale.max(LEAST_NOISE);
    let estimated = Sensor {
        position_sigma_m: scale * sensor.position_sigma_m,
        position_sigma_per_m: scale * sensor.position_sigma_per_m,
        orientation_sigma_rad: sensor.orientation_sigma_rad.map(|sigma| scale * sigma),
        ..sensor.clone()
    };
    let mut identification = identify_real(robot, aligned, &estimated, measurements)?;
    identification.noise_estimated = true;
    identification.notes.insert(
        0,
        format!(
            "no noise was declared: it is estimated from what is left, {:.3} mm per axis, with all in it that is not modelled; \
             --position-noise-um says what the sensor's is",
            estimated.position_sigma_m * 1e3
        ),
    );
    if scale > FOREIGN_ROBOT {
        identification.notes.push(
            "if the sensor is better than that: is it this robot, are the units right, and are the joint readings in the robot's order?"
                .to_owned(),
        );
    }
    Ok(identification)
}

/// Rows of `measurements` that are far off from what the fitted ones say together, and by how much (m).
fn far_off(robot: &Arm, sensor: &Sensor, measurements: &[Measurement]) -> Result<Vec<(usize, f64)>, IdentificationError> {
    let fit: Vec<&Measurement> = measurements.iter().filter(|row| row.role == Role::Fit).collect();
    let weights = vec![1.0; fit.len()];
    let readings = Readings { sensor, measurements: &fit, weights: &weights, displacement: &[], scatter: &[] };
    let geometry = geometry::fit_shrunk(robot, readings)?;
    let all: Vec<&Measurement> = measurements.iter().collect();
    let equations = Equations::new(sensor, &all);
    let left: Vec<_> = all.iter().map(|row| super::least_squares::difference(row, &geometry.predict(row))).collect();
    let square = |row: usize| -> f64 {
        let of = equations.of(row);
        of.map(|equation| (left[row][equations.component(equation)] / equations.sigmas()[equation].max(1e-9)).powi(2)).sum()
    };
    let squares: Vec<f64> = (0..all.len()).map(square).collect();
    let weights = robust::weights(&squares, &equations.counts());
    let far = (0..all.len()).filter(|row| weights[*row] < robust::FAR);
    Ok(far.map(|row| (row, left[row].fixed_rows::<3>(0).norm())).collect())
}

/// As [`identify_real`] of readings none of which is far off.
fn identify_good(
    robot: &Arm,
    aligned: &Arm,
    sensor: &Sensor,
    measurements: &[Measurement],
    mut notes: Vec<String>,
) -> Result<Identification, IdentificationError> {
    let fit: Vec<&Measurement> = measurements.iter().filter(|row| row.role == Role::Fit).collect();
    let problem = Plain::new(aligned, sensor, Weights::Noise, &fit)?;
    let structure = Subspace::of_components(aligned, problem.equations().components());
    problem.enough(structure.rank())?;
    let weights = vec![1.0; fit.len()];
    let readings = Readings { sensor, measurements: &fit, weights: &weights, displacement: &[], scatter: &[] };
    let geometry = geometry::fit_shrunk(robot, readings)?;

    notes.extend(geometry.notes.iter().cloned());
    let (values, missed) = expressed(aligned, sensor, &structure, &geometry, &fit);
    if missed > EXPRESSED {
        notes.push(format!(
            "the parameters of the robot's file cannot say all that was identified: the calibrated file is off by up to {:.3} mm",
            missed * 1e3
        ));
    }
    let linearised = problem.linearise(&values);
    let subspace = structure.at(&linearised.jacobian);
    let (precision, known) = prior(aligned, &subspace, geometry.scale());
    let covariance = problem.covariance(&linearised.jacobian, &subspace, Some(&precision));
    // What the prior tells is no equation's doing.
    let told: f64 = numerics::product(&precision, &covariance).trace();
    let seen = subspace.rank() - (told.max(0.0).round() as usize).min(subspace.rank());
    let hardly: Vec<&str> = (0..subspace.rank())
        .filter(|at| known[*at].is_some_and(|known| covariance[(*at, *at)].max(0.0).sqrt() > HARDLY_SEEN * known))
        .map(|at| aligned.chain.parameters[subspace.independent[at]].name.as_str())
        .collect();
    let [shift, turn] = [geometry.scale() * FRAME_SHIFT * 1e3, geometry.scale() * FRAME_TURN * 1e3];
    if 2 * hardly.len() > known.iter().flatten().count() {
        notes.push(format!(
            "these readings tell little of the arm's geometry: it is taken to be within about {shift:.2} mm and {turn:.2} mrad of nominal \
             frame by frame, which is what they speak for; a calibration needs more different configurations, or a better sensor"
        ));
    } else if !hardly.is_empty() {
        notes.push(format!(
            "these configurations hardly show {}: what is said there is mostly that this arm's frames are within about {shift:.2} mm and \
             {turn:.2} mrad of nominal; measure more different configurations, or a target further from the last axis",
            hardly.join(", ")
        ));
    }
    let unread: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .zip(problem.equations().components())
        .filter(|(_, read)| !read)
        .map(|(name, _)| name)
        .collect();
    if !unread.is_empty() {
        notes.push(format!(
            "{} was never read: where the arm stands along it is not known, and held at where it was taken to be",
            unread.join(", ")
        ));
    }
    let predict = |measurement: &Measurement| geometry.predict(measurement);
    Ok(conclude(
        &problem,
        Weights::Noise,
        measurements,
        Solved {
            values: &values,
            predict: &predict,
            degrees_of_freedom: problem.equations().len().saturating_sub(seen),
            subspace,
            covariance,
            converged: geometry.stop == crate::solver::Stop::Converged,
            reason: geometry.stop.to_string(),
            steps: geometry.steps,
            notes,
        },
    ))
}

/// The values of all parameters of `aligned` with which it does what `geometry` does, those that others stand in for at nominal; and by
/// how much (m) it fails to.
fn expressed(aligned: &Arm, sensor: &Sensor, structure: &Subspace, geometry: &Geometry, fit: &[&Measurement]) -> (Vec<f64>, f64) {
    let mut stream = stream(0, "identification/expressed");
    let limits = &aligned.chain.joints;
    let first =
        Measurement { session: Some(geometry.sessions[0].clone()), target: Some(geometry.targets[0].clone()), ..fit[0].clone() };
    let drawn = (0..SAMPLES).map(|_| limits.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect::<Vec<f64>>());
    let perfect: Vec<Measurement> = fit
        .iter()
        .map(|row| row.joints.clone())
        .chain(drawn)
        .map(|joints| {
            let asked = Measurement { joints, ..first.clone() };
            let pose = geometry.predict(&asked);
            let orientation_xyzw = asked.orientation_xyzw.map(|_| pose.rotation.coords.into());
            Measurement { position_m: pose.translation.vector.into(), orientation_xyzw, ..asked }
        })
        .collect();
    let perfect: Vec<&Measurement> = perfect.iter().collect();
    let nominal = aligned.chain.nominal();
    let exact = Sensor { position_sigma_per_m: 0.0, ..sensor.clone() };
    let Ok(problem) = Plain::new(aligned, &exact, Weights::Noise, &perfect) else {
        return (nominal, 0.0);
    };
    let values = solve(&problem, &structure.independent, nominal, MAX_STEPS).point;
    let chain = aligned.chain.at(&values);
    let equations: &Equations = problem.equations();
    let missed = perfect.iter().enumerate().map(|(row, measurement)| {
        let off = super::least_squares::difference(measurement, &chain.forward(&measurement.joints));
        equations.of_position(row).map(|equation| off[equations.component(equation)].powi(2)).sum::<f64>().sqrt()
    });
    (values, missed.fold(0.0, f64::max))
}

/// The prior of the independent parameters, which stand for the others too, its sigmas `scale` times those of manufacturing: its
/// precision, and one sigma of each that is not free.
fn prior(aligned: &Arm, subspace: &Subspace, scale: f64) -> (DMatrix<f64>, Vec<Option<f64>>) {
    let parameters = &aligned.chain.parameters;
    // Base and target come first and last ([`crate::arm::Chain::in_measurement_frame`]).
    let free = |column: usize| column < 6 || column + 6 >= parameters.len();
    let sigma = |column: usize| match parameters[column].quantity {
        _ if free(column) => FREE,
        Quantity::Length => scale * FRAME_SHIFT,
        Quantity::Angle => scale * FRAME_TURN,
    };
    let rank = subspace.rank();
    let bound: Vec<usize> = (0..rank).filter(|at| !free(subspace.independent[*at])).collect();
    let covariance = DMatrix::from_fn(bound.len(), bound.len(), |i, j| {
        let (i, j) = (bound[i], bound[j]);
        let own = if i == j { sigma(subspace.independent[i]).powi(2) } else { 0.0 };
        let others = subspace.dropped.iter().enumerate();
        own + others.map(|(at, column)| subspace.share[(i, at)] * subspace.share[(j, at)] * sigma(*column).powi(2)).sum::<f64>()
    });
    let mut known = vec![None; rank];
    bound.iter().enumerate().for_each(|(at, of)| known[*of] = Some(covariance[(at, at)].sqrt()));
    let mut precision = DMatrix::zeros(rank, rank);
    if let Some(inverse) = Cholesky::new(covariance).map(|cholesky| cholesky.inverse()) {
        for (i, row) in bound.iter().enumerate() {
            for (j, column) in bound.iter().enumerate() {
                precision[(*row, *column)] = inverse[(i, j)];
            }
        }
    }
    (precision, known)
}
