//! Gauss–Newton / Levenberg–Marquardt on the identifiable subspace (eqs. 5–7, on the parameters that can be told apart).

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Vector3, Vector6};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::outcome::{Combination, DeclaredNoise, Errors, Identification, ParameterEstimate, Residual, Summary};
use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::arm::frames::{Pose, pose_error};
use crate::measurement::Weights;
use crate::measurement::{Measurement, Sensor};
use crate::quality::subspace::{Subspace, late};

/// Steps after which a fit that has not settled is given up.
const MAX_STEPS: usize = 200;
/// The fit has converged when an undamped step changes the predictions of all measurements together by less than this many sigmas
/// (of the declared noise, or of the residuals where these are larger).
const STEP_TOLERANCE: f64 = 1e-6;
/// Relative change of the sum of squares that counts as rounding.
const ROUNDING: f64 = 1e-12;
/// A combination whose standard error would be above this (m or rad) cannot be told from this data: nobody's nominal arm is that
/// wrong, and letting it loose only spoils the fit.
const PLAUSIBLE_ERROR: f64 = 0.03;
/// The residuals may make the noise look so many times as large as declared when it is told what drowns in it.
const LARGEST_NOISE_FACTOR: f64 = 10.0;
/// Held-out errors so many times the fitted ones come from another cell.
const STRANGE: f64 = 10.0;
/// A change (m or rad) that no real arm needs.
const ABSURD_CHANGE: f64 = 0.06;
/// A residual so many times the median is a wild reading.
const WILD: f64 = 8.0;
/// Residuals (RMS, m or rad) that no calibrated arm leaves, if the noise does not explain them.
const ASTRAY: f64 = 0.02;
/// Residuals so many times the declared noise make one doubt that it is this robot.
const FOREIGN_ROBOT: f64 = 200.0;
/// Below this probability of the residuals under the declared noise, the noise is taken to be larger than declared.
const DECLARED_NOISE_REJECTED: f64 = 1e-3;

/// An identification that cannot be made.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum IdentificationError {
    /// Too few equations.
    #[error(
        "{equations} measured numbers ({poses} configurations to fit) cannot determine {rank} independent parameters; measure at \
         least {needed} configurations"
    )]
    TooFew {
        /// Configurations to fit.
        poses: usize,
        /// Residual components.
        equations: usize,
        /// Dimension of the identifiable subspace.
        rank: usize,
        /// Smallest number of configurations.
        needed: usize,
    },
    /// A measurement does not fit the arm.
    #[error("measurement {index} has {found} joint readings, the arm has {expected} joints")]
    JointCount {
        /// Index of the measurement.
        index: usize,
        /// Readings.
        found: usize,
        /// Joints.
        expected: usize,
    },
    /// Weighting by noise that is declared as zero.
    #[error(
        "the declared {what} noise is zero, so that residuals cannot be weighted by it: declare the sensor's noise, or use \
         weights = \"unit\""
    )]
    NoNoise {
        /// `position` or `orientation`.
        what: &'static str,
    },
}

/// Identifies the geometric parameters of `arm` from `measurements` with [`Role::Fit`](crate::measurement::Role), and reports the
/// errors of both models on these and, apart, on the held-out ones.
///
/// Residuals are measured minus predicted pose ([`pose_error`]). With [`Weights::Noise`] each is divided by its declared sigma;
/// with [`Weights::Unit`] metres and radians count alike and the standard errors follow from the declared noise all the same.
/// Where the residuals are larger than the declared noise allows (chi-square, 0.1 %), standard errors grow by the residual scale
/// and the intervals become Student's; the notes then say so.
///
/// # Errors
/// If there are too few measurements or they do not fit the arm. A fit that does not converge is no error: the outcome says so.
pub fn identify(
    arm: &Arm,
    sensor: &Sensor,
    weights: Weights,
    measurements: &[Measurement],
) -> Result<Identification, IdentificationError> {
    let structure = Subspace::of_structure(arm, sensor.orientation_sigma_rad.is_some() && measures_orientation(measurements));
    identify_on(&structure, arm, sensor, weights, measurements)
}

/// Whether every measurement to fit has an orientation: else positions are fitted only.
fn measures_orientation(measurements: &[Measurement]) -> bool {
    let mut fitted = measurements.iter().filter(|measurement| measurement.role == crate::measurement::Role::Fit);
    fitted.all(|measurement| measurement.orientation_xyzw.is_some())
}

/// [`identify`] for many sets of measurements of one arm, whose structure (for what is measured of a pose) is told once.
///
/// # Errors
/// As [`identify`].
pub fn identify_on(
    structure: &Subspace,
    arm: &Arm,
    sensor: &Sensor,
    weights: Weights,
    measurements: &[Measurement],
) -> Result<Identification, IdentificationError> {
    use crate::measurement::Role;
    for measurement in measurements {
        if measurement.joints.len() != arm.joint_count() {
            return Err(IdentificationError::JointCount {
                index: measurement.index,
                found: measurement.joints.len(),
                expected: arm.joint_count(),
            });
        }
    }
    let of = |role| measurements.iter().filter(|measurement| measurement.role == role).collect::<Vec<_>>();
    let (fit, held_out) = (of(Role::Fit), of(Role::HeldOut));
    let problem = Problem::new(arm, sensor, weights, &fit)?;
    let nominal = arm.chain.nominal();

    let equations = problem.equations();
    let structural = structure.rank();
    if equations < structural {
        let needed = structural.div_ceil(problem.rows_per_pose);
        return Err(IdentificationError::TooFew { poses: fit.len(), equations, rank: structural, needed });
    }

    // How large the noise really is shows only in the residuals, and with it which combinations drown in it: the fit is made again
    // without the weakest until none does. What is far beyond the noise is the wrong robot, not noise.
    let mut limit = usize::MAX;
    let (subspace, solution, noise, scale, covariance) = loop {
        let start = problem.linearise(&nominal);
        let subspace = Subspace::reveal(&problem.in_sigmas(&start.jacobian), &late(arm), 1.0 / PLAUSIBLE_ERROR, limit);
        let solution = solve(&problem, &subspace.independent, nominal.clone(), start);
        let noise = problem.noise_scale(&solution.values);
        let degrees_of_freedom = equations - subspace.rank();
        let scale = if degrees_of_freedom > 0 { (noise.sum_of_squares / degrees_of_freedom as f64).sqrt() } else { 1.0 };
        let covariance = problem.covariance(&solution.jacobian, &subspace);
        let grown = if noise.known && scale.is_finite() { scale.clamp(1.0, LARGEST_NOISE_FACTOR) } else { 1.0 };
        let hopeless = |variance: &f64| variance.is_nan() || grown * variance.sqrt() > PLAUSIBLE_ERROR;
        let drowned = covariance.diagonal().iter().any(hopeless);
        if drowned && subspace.rank() > 0 {
            limit = subspace.rank() - 1;
        } else {
            break (subspace, solution, noise, scale, covariance);
        }
    };
    // The shares of the dropped parameters where the fit has ended, for large errors have turned them.
    let subspace = subspace.at(&solution.jacobian);
    let rank = subspace.rank();
    let mut notes = Vec::new();
    if rank < structural {
        let unseen = subspace.dropped.iter().filter(|column| structure.independent.contains(column));
        let names: Vec<&str> = unseen.map(|&column| arm.chain.parameters[column].name.as_str()).collect();
        notes.push(format!(
            "of the {structural} combinations that this arm's structure allows, these configurations show {rank}: others would be \
             uncertain by more than {:.0} mm or mrad, so that {} is held at nominal, and what it is off by is in no standard error; \
             measure more different configurations, or a target further from the last axis",
            PLAUSIBLE_ERROR * 1e3,
            if names.is_empty() { "more".to_owned() } else { names.join(", ") }
        ));
    }
    let degrees_of_freedom = equations - rank;
    let p_value = match (degrees_of_freedom, ChiSquared::new(degrees_of_freedom as f64)) {
        (1.., Ok(distribution)) => distribution.sf(noise.sum_of_squares),
        _ => 1.0,
    };
    // Only residuals weighted by their noise have this distribution.
    let tested = noise.known && degrees_of_freedom > 0 && weights == Weights::Noise;
    let inflated = tested && p_value < DECLARED_NOISE_REJECTED;
    if inflated {
        notes.push(format!(
            "residuals are {scale:.2} times what the declared noise allows (chi-square p {}): something is not \
             modelled; standard errors are scaled by {scale:.2}, and cannot show a bias",
            if p_value < 1e-300 { "below 1e-300".to_owned() } else { format!("= {p_value:.1e}") }
        ));
    }
    if noise.known && scale > FOREIGN_ROBOT {
        notes.push(format!(
            "residuals of {scale:.0} times the declared noise are no noise: is it this robot, are the units right, and are the joint \
             readings in the robot's order?"
        ));
    }
    if degrees_of_freedom == 0 {
        notes.push("as many equations as parameters: nothing is left to tell how good the fit is".to_owned());
    }
    let quantile = match StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1) as f64) {
        Ok(distribution) if inflated => distribution.inverse_cdf(0.975),
        _ => 1.959_963_984_540_054,
    };
    // Its last digits depend on the platform's mathematics, recordings must not.
    let quantile = (quantile * 1e9).round() * 1e-9;
    let factor = if inflated { scale } else { 1.0 };
    let standard_error = |position: usize| factor * covariance[(position, position)].max(0.0).sqrt();

    let parameters = arm
        .chain
        .parameters
        .iter()
        .enumerate()
        .map(|(column, parameter)| {
            let position = subspace.independent.binary_search(&column).ok();
            ParameterEstimate {
                name: parameter.name.clone(),
                nominal: parameter.nominal,
                identified: solution.values[column],
                standard_error: position.map(standard_error),
                unit: parameter.quantity.unit().to_owned(),
                dropped: position.is_none(),
            }
        })
        .collect();
    let combinations = subspace
        .independent
        .iter()
        .enumerate()
        .map(|(position, &column)| {
            let estimate = solution.values[column] - nominal[column];
            let error = standard_error(position);
            Combination {
                name: arm.chain.parameters[column].name.clone(),
                expression: expression(arm, &subspace, position),
                estimate,
                standard_error: error,
                interval95: [estimate - quantile * error, estimate + quantile * error],
                unit: arm.chain.parameters[column].quantity.unit().to_owned(),
            }
        })
        .collect();

    let (at_nominal, at_identified) = (arm.chain.at(&nominal), arm.chain.at(&solution.values));
    let residuals: Vec<Residual> = measurements
        .iter()
        .map(|measurement| Residual {
            index: measurement.index,
            position_m: measurement.position_m,
            nominal: residual(measurement, &at_nominal).into(),
            identified: residual(measurement, &at_identified).into(),
        })
        .collect();
    let fitted = errors(&fit, &at_identified);
    // Least squares also comes to rest in places that have nothing to do with the arm.
    let far = fitted.position_m.rms > ASTRAY || fitted.rotation_rad.is_some_and(|rotation| rotation.rms > ASTRAY);
    let astray = noise.known && scale > LARGEST_NOISE_FACTOR && far;
    let reason = if rank == 0 {
        "these configurations tell nothing apart".to_owned()
    } else if solution.converged && astray {
        format!("the fit came to rest where {:.0} mm RMS are left: this is no calibration", fitted.position_m.rms * 1e3)
    } else {
        solution.reason
    };
    let held_out_errors = (!held_out.is_empty()).then(|| errors(&held_out, &at_identified));
    let held_out_nominal = (!held_out.is_empty()).then(|| errors(&held_out, &at_nominal));
    notes.extend(doubts(arm, &solution.values, &fit, &at_identified, &fitted));
    match (&held_out_errors, &held_out_nominal) {
        (Some(after), Some(before)) => {
            if after.position_m.rms >= before.position_m.rms {
                notes.push("held-out configurations are predicted no better than by the nominal model".to_owned());
            }
            if after.position_m.rms > STRANGE * fitted.position_m.rms.max(noise.position_m) {
                notes.push(format!(
                    "held-out errors are {:.0} times the fitted ones: were they measured in the same frame, with the same target, on \
                     the same arm?",
                    after.position_m.rms / fitted.position_m.rms.max(noise.position_m)
                ));
            }
        }
        _ => notes.push("nothing is held out: the errors of fitted configurations flatter".to_owned()),
    }
    Ok(Identification {
        converged: solution.converged && rank > 0 && !astray,
        reason,
        iterations: solution.steps,
        rank,
        equations,
        residual_scale: (noise.known && degrees_of_freedom > 0).then_some(scale),
        parameters,
        combinations,
        nominal: errors(&fit, &at_nominal),
        fitted,
        held_out: held_out_errors,
        held_out_nominal,
        declared_noise: DeclaredNoise { position_m: noise.position_m, rotation_rad: noise.rotation_rad },
        residuals,
        notes,
    })
}

/// The nominal values of `arm` with the parameters `free` (columns) fitted to `measurements` and all others held; `None` if that
/// does not converge. For frames that nobody has measured, such as the measurement frame and the target on the flange.
pub fn fit_some(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement], free: &[usize]) -> Option<Vec<f64>> {
    let problem = Problem::new(arm, sensor, Weights::Noise, measurements).ok()?;
    let nominal = arm.chain.nominal();
    let start = problem.linearise(&nominal);
    let seen = Subspace::reveal(&start.jacobian.select_columns(free), &vec![false; free.len()], 0.0, usize::MAX);
    let columns: Vec<usize> = seen.independent.iter().map(|position| free[*position]).collect();
    let solution = solve(&problem, &columns, nominal, start);
    solution.converged.then_some(solution.values)
}

/// What a careful reader would doubt about a fit: absurd parameters, single wild readings.
fn doubts(arm: &Arm, values: &[f64], fit: &[&Measurement], identified: &ChainAt, fitted: &Errors) -> Vec<String> {
    let mut doubts = Vec::new();
    let changes = arm.chain.parameters.iter().zip(values).map(|(parameter, value)| (parameter, value - parameter.nominal));
    let far = changes.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
    if let Some((parameter, change)) = far.filter(|(_, change)| change.abs() > ABSURD_CHANGE) {
        doubts.push(format!(
            "{} is {:.0} m{} from nominal: is it this robot, and are the units right?",
            parameter.name,
            change.abs() * 1e3,
            parameter.quantity.unit()
        ));
    }
    let mut wild: Vec<(f64, &&Measurement)> =
        fit.iter().map(|measurement| (residual(measurement, identified).fixed_rows::<3>(0).norm(), measurement)).collect();
    wild.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    // Against the median, which a few wild readings do not move.
    let usual = wild.get(wild.len() / 2).map_or(0.0, |(length, _)| *length).max(fitted.position_m.min);
    let wild: Vec<String> = wild
        .iter()
        .take_while(|(length, _)| *length > WILD * usual && *length > 1e-12)
        .take(5)
        .map(|(length, row)| format!("{} (pose_id {}) by {:.3} mm", row.index, row.pose_id, length * 1e3))
        .collect();
    if !wild.is_empty() {
        doubts.push(format!(
            "some readings are far off, the median being {:.3} mm: measurement {}; they pull the fit, look at them",
            usual * 1e3,
            wild.join(", ")
        ));
    }
    doubts
}

/// Errors of the model `chain` on `measurements`.
#[must_use]
pub fn errors(measurements: &[&Measurement], chain: &ChainAt) -> Errors {
    let residuals: Vec<Vector6<f64>> = measurements.iter().map(|measurement| residual(measurement, chain)).collect();
    let orientation = measurements.iter().all(|measurement| measurement.orientation_xyzw.is_some());
    Errors {
        count: measurements.len(),
        position_m: summary(residuals.iter().map(|residual| residual.fixed_rows::<3>(0).norm())),
        rotation_rad: orientation.then(|| summary(residuals.iter().map(|residual| residual.fixed_rows::<3>(3).norm()))),
    }
}

/// Smallest, mean, RMS and largest of `values`; zeros if there are none.
#[must_use]
pub fn summary(values: impl Iterator<Item = f64>) -> Summary {
    let (mut count, mut min, mut max, mut sum, mut squares) = (0usize, f64::INFINITY, 0.0f64, 0.0, 0.0);
    for value in values {
        count += 1;
        min = min.min(value);
        max = max.max(value);
        sum += value;
        squares += value * value;
    }
    if count == 0 {
        return Summary { min: 0.0, mean: 0.0, rms: 0.0, max: 0.0 };
    }
    Summary { min, mean: sum / count as f64, rms: (squares / count as f64).sqrt(), max }
}

/// Measured minus predicted pose; the rotation part is zero where no orientation was measured.
fn residual(measurement: &Measurement, chain: &ChainAt) -> Vector6<f64> {
    let predicted = chain.forward(&measurement.joints);
    match measurement.orientation() {
        Some(orientation) => pose_error(&Pose::from_parts(measurement.position().into(), orientation), &predicted),
        None => {
            let difference = measurement.position().coords - predicted.translation.vector;
            Vector6::new(difference.x, difference.y, difference.z, 0.0, 0.0, 0.0)
        }
    }
}

struct Problem<'a> {
    arm: &'a Arm,
    measurements: &'a [&'a Measurement],
    rows_per_pose: usize,
    /// Weight and declared sigma of the position and the orientation rows of each measurement.
    rows: Vec<RowWeights>,
}

#[derive(Clone, Copy)]
struct RowWeights {
    weight: [f64; 2],
    sigma: [f64; 2],
}

struct Linearised {
    /// Weighted residuals, measured minus predicted.
    residuals: DVector<f64>,
    /// Weighted change of the prediction per parameter (all columns).
    jacobian: DMatrix<f64>,
}

struct NoiseScale {
    sum_of_squares: f64,
    known: bool,
    /// RMS length of the declared noise of a position (m) and, where it is measured, of an orientation (rad).
    position_m: f64,
    rotation_rad: Option<f64>,
}

impl<'a> Problem<'a> {
    fn new(
        arm: &'a Arm,
        sensor: &Sensor,
        weights: Weights,
        measurements: &'a [&'a Measurement],
    ) -> Result<Self, IdentificationError> {
        // Mixed data are fitted as what all of them have.
        let orientation = sensor.orientation_sigma_rad.is_some()
            && measurements.iter().all(|measurement| measurement.orientation_xyzw.is_some());
        let rows = measurements
            .iter()
            .map(|measurement| {
                let sigma = [
                    sensor.position_sigma_at(&measurement.position().coords),
                    if orientation { sensor.orientation_sigma_rad.unwrap_or(0.0) } else { 1.0 },
                ];
                let weight = match weights {
                    Weights::Unit => [1.0, 1.0],
                    Weights::Noise => {
                        for (sigma, what) in sigma.iter().zip(["position", "orientation"]) {
                            if *sigma <= 0.0 {
                                return Err(IdentificationError::NoNoise { what });
                            }
                        }
                        sigma.map(|sigma| 1.0 / sigma)
                    }
                };
                Ok(RowWeights { weight, sigma })
            })
            .collect::<Result<_, _>>()?;
        Ok(Problem { arm, measurements, rows_per_pose: if orientation { 6 } else { 3 }, rows })
    }

    fn equations(&self) -> usize {
        self.rows_per_pose * self.measurements.len()
    }

    fn linearise(&self, values: &[f64]) -> Linearised {
        let chain = self.arm.chain.at(values);
        let (n, per_pose) = (chain.parameter_count(), self.rows_per_pose);
        let mut residuals = DVector::zeros(self.equations());
        // Built transposed: each pose then fills consecutive memory.
        let mut transposed = DMatrix::zeros(n, self.equations());
        let mut rows = vec![0.0; 6 * n];
        for (index, (measurement, row)) in self.measurements.iter().zip(&self.rows).enumerate() {
            let (axes, origin) = chain.jacobian_into(&measurement.joints, &mut rows, n);
            let predicted = crate::arm::frames::pose_from_parts(&axes, &origin);
            let error = match measurement.orientation() {
                Some(orientation) => pose_error(&Pose::from_parts(measurement.position().into(), orientation), &predicted),
                None => {
                    let difference = measurement.position().coords - origin;
                    Vector6::new(difference.x, difference.y, difference.z, 0.0, 0.0, 0.0)
                }
            };
            if per_pose == 6 {
                turn_to_residual(&mut rows[3 * n..], n, &error.fixed_rows::<3>(3).into_owned());
            }
            for component in 0..per_pose {
                let weight = row.weight[component / 3];
                let at = index * per_pose + component;
                residuals[at] = weight * error[component];
                for (entry, value) in transposed.column_mut(at).iter_mut().zip(&rows[component * n..(component + 1) * n]) {
                    *entry = weight * value;
                }
            }
        }
        Linearised { residuals, jacobian: transposed.transpose() }
    }

    /// Sum of squares of the residuals over their declared sigmas, of the components whose noise is declared.
    fn noise_scale(&self, values: &[f64]) -> NoiseScale {
        let chain = self.arm.chain.at(values);
        let mut sum_of_squares = 0.0;
        let mut known = true;
        for (measurement, row) in self.measurements.iter().zip(&self.rows) {
            let error = residual(measurement, &chain);
            for component in 0..self.rows_per_pose {
                let sigma = row.sigma[component / 3];
                if sigma > 0.0 {
                    sum_of_squares += (error[component] / sigma).powi(2);
                } else {
                    known = false;
                }
            }
        }
        let rms = |part: usize| {
            let squares: f64 = self.rows.iter().map(|row| 3.0 * row.sigma[part].powi(2)).sum();
            (squares / self.rows.len().max(1) as f64).sqrt()
        };
        let rotation_rad = (self.rows_per_pose == 6).then(|| rms(1));
        NoiseScale { sum_of_squares, known, position_m: rms(0), rotation_rad }
    }

    /// The weighted Jacobian with rows in units of the declared sigma instead.
    fn in_sigmas(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = jacobian.clone();
        for (index, mut row) in scaled.row_iter_mut().enumerate() {
            let weights = self.rows[index / self.rows_per_pose];
            let part = index % self.rows_per_pose / 3;
            // A reading that is declared exact is taken to a nanometre or nanoradian.
            row *= 1.0 / (weights.weight[part] * weights.sigma[part].max(1e-9));
        }
        scaled
    }

    /// Covariance of the independent parameters from the declared noise: `A Jᵀ W Σ W J A` with `A = (Jᵀ J)⁻¹` of the weighted
    /// Jacobian, which is A itself where the weights are the sigmas.
    fn covariance(&self, jacobian: &DMatrix<f64>, subspace: &Subspace) -> DMatrix<f64> {
        let j = jacobian.select_columns(&subspace.independent);
        let rank = subspace.rank();
        let Some(inverse) = scaled_inverse(&gram(&j)) else {
            return DMatrix::from_element(rank, rank, f64::NAN);
        };
        let mut scaled = j.clone();
        for (index, mut row) in scaled.row_iter_mut().enumerate() {
            let weights = self.rows[index / self.rows_per_pose];
            let part = index % self.rows_per_pose / 3;
            row *= weights.weight[part] * weights.sigma[part];
        }
        product(&product(&inverse, &gram(&scaled)), &inverse)
    }
}

/// `matrixᵀ matrix`. Not nalgebra's product, whose kernels (and last bits) depend on the processor.
fn gram(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let columns = matrix.ncols();
    let mut gram = DMatrix::zeros(columns, columns);
    for first in 0..columns {
        for second in 0..=first {
            let value = matrix.column(first).dot(&matrix.column(second));
            gram[(first, second)] = value;
            gram[(second, first)] = value;
        }
    }
    gram
}

/// `left · right`; see [`gram`].
fn product(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(left.nrows(), right.ncols(), |row, column| {
        left.row(row).iter().zip(right.column(column).iter()).map(|(a, b)| a * b).sum()
    })
}

/// Inverse of a positive definite matrix whose rows have different units.
fn scaled_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|value| 1.0 / value.sqrt());
    let scaled =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| matrix[(row, column)] * scale[row] * scale[column]);
    let inverse = Cholesky::new(scaled)?.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| inverse[(row, column)] * scale[row] * scale[column]))
}

/// Turns the rotation rows of a Jacobian (change of the predicted orientation) into the change of the rotation residual `error`:
/// the inverse right Jacobian of the rotation group, exact however large the residual is.
fn turn_to_residual(rows: &mut [f64], n: usize, error: &Vector3<f64>) {
    let angle = error.norm();
    if angle < 1e-8 {
        return;
    }
    let cross = error.cross_matrix();
    let (sine, cosine) = libm::sincos(angle);
    let factor = 1.0 / (angle * angle) - (1.0 + cosine) / (2.0 * angle * sine);
    let turn = Matrix3::identity() + cross * 0.5 + cross * cross * factor;
    for column in 0..n {
        let turned = turn * Vector3::new(rows[column], rows[n + column], rows[2 * n + column]);
        rows[column] = turned.x;
        rows[n + column] = turned.y;
        rows[2 * n + column] = turned.z;
    }
}

struct Solution {
    values: Vec<f64>,
    jacobian: DMatrix<f64>,
    converged: bool,
    reason: String,
    steps: usize,
}

fn solve(problem: &Problem<'_>, columns: &[usize], start: Vec<f64>, linearised: Linearised) -> Solution {
    let mut values = start;
    let mut here = linearised;
    let mut cost = here.residuals.norm_squared();
    // Damping and the factor by which it grows after a failure, after Nielsen 1999.
    let (mut damping, mut growth): (f64, f64) = (0.0, 2.0);
    let done = |values, here: Linearised, converged, reason: String, steps| Solution {
        values,
        jacobian: here.jacobian,
        converged,
        reason,
        steps,
    };
    for step_number in 1..=MAX_STEPS {
        let jacobian = here.jacobian.select_columns(columns);
        let Some(step) = step(&jacobian, &here.residuals, damping) else {
            return done(values, here, false, "the equations became singular".to_owned(), step_number);
        };
        let change = (&jacobian * &step).norm();
        let mut trial = values.clone();
        for (position, &column) in columns.iter().enumerate() {
            trial[column] += step[position];
        }
        let there = problem.linearise(&trial);
        let trial_cost = there.residuals.norm_squared();
        let sigma = (cost / problem.equations() as f64).sqrt().max(problem.one_sigma());
        let settled = change <= STEP_TOLERANCE * sigma;
        let undamped = damping == 0.0;
        if trial_cost.is_finite() && (trial_cost <= cost * (1.0 + ROUNDING) || settled) {
            // Gain over what the linear model, with its damping, promises.
            let promised = change * change + 2.0 * damping * scaled_square(&jacobian, &step);
            let gain = if promised > 0.0 { (cost - trial_cost) / promised } else { 1.0 };
            damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 2.0);
            growth = 2.0;
            if damping < 1e-9 || settled {
                damping = 0.0;
            }
            values = trial;
            here = there;
            cost = trial_cost;
            if settled && undamped {
                let reason = "the last step changed the predictions by less than a millionth of a standard deviation".to_owned();
                return done(values, here, true, reason, step_number);
            }
        } else {
            damping = if damping == 0.0 { 1e-4 } else { damping * growth };
            growth *= 2.0;
            if damping > 1e12 {
                return done(values, here, false, "no step makes the residuals smaller".to_owned(), step_number);
            }
        }
    }
    done(values, here, false, format!("not settled after {MAX_STEPS} steps"), MAX_STEPS)
}

/// Square of the step's length in units in which every column of the Jacobian has length one.
fn scaled_square(jacobian: &DMatrix<f64>, step: &DVector<f64>) -> f64 {
    jacobian.column_iter().zip(step.iter()).map(|(column, value)| column.norm_squared() * value * value).sum()
}

impl Problem<'_> {
    /// Length of a weighted residual vector in which one component is off by one declared sigma: what counts as nothing.
    fn one_sigma(&self) -> f64 {
        self.rows.first().map_or(0.0, |row| row.weight[0] * row.sigma[0])
    }
}

/// The step that minimises the linearised residuals, by QR of the column-scaled Jacobian, damped after Levenberg and Marquardt.
fn step(jacobian: &DMatrix<f64>, residuals: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let (rows, columns) = jacobian.shape();
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let extra = if damping > 0.0 { columns } else { 0 };
    let mut matrix = DMatrix::zeros(rows + extra, columns);
    for (column, norm) in norms.iter().enumerate() {
        if !norm.is_finite() || *norm == 0.0 {
            return None;
        }
        matrix.view_mut((0, column), (rows, 1)).copy_from(&(jacobian.column(column) / *norm));
        if damping > 0.0 {
            matrix[(rows + column, column)] = damping.sqrt();
        }
    }
    let mut right = DVector::zeros(rows + extra);
    right.rows_mut(0, rows).copy_from(residuals);
    let qr = matrix.qr();
    qr.q_tr_mul(&mut right);
    let mut step = right.rows(0, columns).into_owned();
    if !qr.unpack_r().solve_upper_triangular_mut(&mut step) {
        return None;
    }
    for (value, norm) in step.iter_mut().zip(&norms) {
        *value /= norm;
    }
    step.iter().all(|value| value.is_finite()).then_some(step)
}

/// The combination behind independent parameter number `position`, in words.
fn expression(arm: &Arm, subspace: &Subspace, position: usize) -> String {
    let mut text = arm.chain.parameters[subspace.independent[position]].name.clone();
    for (other, &column) in subspace.dropped.iter().enumerate() {
        let share = subspace.share[(position, other)];
        if share.abs() >= 5e-5 {
            let sign = if share < 0.0 { '−' } else { '+' };
            text.push_str(&format!(" {sign} {:.4}·{}", share.abs(), arm.chain.parameters[column].name));
        }
    }
    text
}

#[cfg(test)]
mod tests;
