//! Least squares on the identifiable subspace (eqs. 5–7, on the parameters that can be told apart), and what it says of the arm.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};

use super::feature;
use super::geometry::{Geometry, GeometryError, into_axes};
use super::outcome::{Combination, DeclaredNoise, Errors, Identification, ParameterEstimate, Residual, Summary};
use crate::arm::Arm;
use crate::arm::ChainAt;
use crate::arm::frames::{Pose, pose_error};
use crate::measurement::equations::Equations;
use crate::measurement::{Feature, Measurement, Role, Sensor, Weights};
use crate::numerics::distribution::{NORMAL_95, chi_squared_tail, student_quantile};
use crate::numerics::{gram, product, scaled_inverse};
use crate::quality::subspace::{Subspace, late};
use crate::solver::{Linearised, Problem, solve_from};

/// Steps after which a fit that has not settled is given up.
pub(super) const MAX_STEPS: usize = 200;
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
pub(super) const FOREIGN_ROBOT: f64 = 200.0;
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
    /// A geometry that cannot be fitted.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
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
    let fit: Vec<&Measurement> = measurements.iter().filter(|measurement| measurement.role == Role::Fit).collect();
    let structure = Subspace::of_components(arm, Equations::new(sensor, &fit).components());
    identify_on(&structure, arm, sensor, weights, measurements)
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
    check_joints(arm, measurements)?;
    let fit: Vec<&Measurement> = measurements.iter().filter(|measurement| measurement.role == Role::Fit).collect();
    let problem = Plain::new(arm, sensor, weights, &fit)?;
    let nominal = arm.chain.nominal();

    let equations = problem.equations.len();
    let structural = structure.rank();
    problem.enough(structural)?;

    // How large the noise really is shows only in the residuals, and with it which combinations drown in it: the fit is made again
    // without the weakest until none does. What is far beyond the noise is the wrong robot, not noise.
    let mut limit = usize::MAX;
    let (subspace, solution, covariance) = loop {
        let start = problem.linearise(&nominal);
        let subspace = Subspace::reveal(&problem.in_sigmas(&start.jacobian), &late(arm), 1.0 / PLAUSIBLE_ERROR, limit);
        let solution = solve_from(&problem, &subspace.independent, nominal.clone(), start, MAX_STEPS);
        let chain = arm.chain.at(&solution.point);
        let noise = problem.noise_scale(&|measurement| chain.forward(&measurement.joints));
        let degrees_of_freedom = equations - subspace.rank();
        let scale = noise.scale(degrees_of_freedom);
        let covariance = problem.covariance(&solution.linearised.jacobian, &subspace, None);
        let grown = if noise.known && scale.is_finite() { scale.clamp(1.0, LARGEST_NOISE_FACTOR) } else { 1.0 };
        let hopeless = |variance: &f64| variance.is_nan() || grown * variance.sqrt() > PLAUSIBLE_ERROR;
        let drowned = covariance.diagonal().iter().any(hopeless);
        if drowned && subspace.rank() > 0 {
            limit = subspace.rank() - 1;
        } else {
            break (subspace, solution, covariance);
        }
    };
    // The shares of the dropped parameters where the fit has ended, for large errors have turned them.
    let subspace = subspace.at(&solution.linearised.jacobian);
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
    let (chain, at_nominal) = (arm.chain.at(&solution.point), arm.chain.at_nominal());
    let solved = Solved {
        values: &solution.point,
        nominal: &|measurement| at_nominal.forward(&measurement.joints),
        errors: None,
        predict: &|measurement| chain.forward(&measurement.joints),
        degrees_of_freedom: equations - rank,
        subspace,
        covariance,
        converged: solution.converged(),
        reason: solution.stop.to_string(),
        steps: solution.steps,
        notes,
    };
    Ok(conclude(&problem, weights, measurements, solved))
}

/// Whether every measurement has a reading of each joint.
pub(super) fn check_joints(arm: &Arm, measurements: &[Measurement]) -> Result<(), IdentificationError> {
    let expected = arm.joint_count();
    match measurements.iter().find(|measurement| measurement.joints.len() != expected) {
        Some(other) => Err(IdentificationError::JointCount { index: other.index, found: other.joints.len(), expected }),
        None => Ok(()),
    }
}

/// A fit whose outcome is to be told.
pub(super) struct Solved<'a> {
    /// Of all parameters.
    pub(super) values: &'a [f64],
    /// The nominal arm.
    pub(super) nominal: &'a dyn Fn(&Measurement) -> Pose,
    /// The identified arm.
    pub(super) predict: &'a dyn Fn(&Measurement) -> Pose,
    /// Standard error of each parameter that is estimated, where that is not the independent ones: m or rad.
    pub(super) errors: Option<Vec<Option<f64>>>,
    /// Equations that the parameters leave.
    pub(super) degrees_of_freedom: usize,
    /// With the shares at the solution.
    pub(super) subspace: Subspace,
    /// Of the independent parameters.
    pub(super) covariance: DMatrix<f64>,
    pub(super) converged: bool,
    pub(super) reason: String,
    pub(super) steps: usize,
    pub(super) notes: Vec<String>,
}

/// The outcome of a fit: errors, standard errors and intervals, and what is to be doubted. `measurements`: fitted and held out.
pub(super) fn conclude(
    problem: &Plain<'_>,
    weights: Weights,
    measurements: &[Measurement],
    solved: Solved<'_>,
) -> Identification {
    let arm = problem.arm;
    let nominal = arm.chain.nominal();
    let of = |role| measurements.iter().filter(|measurement| measurement.role == role).collect::<Vec<_>>();
    let (fit, held_out) = (of(Role::Fit), of(Role::HeldOut));
    let equations = problem.equations.len();
    let Solved { values, predict, degrees_of_freedom, subspace, covariance, .. } = solved;
    let mut notes = solved.notes;
    let rank = subspace.rank();
    let noise = problem.noise_scale(predict);
    let scale = noise.scale(degrees_of_freedom);
    let p_value = chi_squared_tail(noise.sum_of_squares, degrees_of_freedom as f64);
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
    } else if degrees_of_freedom < rank {
        notes.push(format!(
            "only {degrees_of_freedom} equations more than parameters: the errors of the fitted readings are far smaller than those of others"
        ));
    }
    let student = student_quantile(0.975, degrees_of_freedom.max(1) as f64).filter(|_| inflated);
    let quantile = student.unwrap_or(NORMAL_95);
    let factor = if inflated { scale } else { 1.0 };
    let standard_error = |position: usize| factor * covariance[(position, position)].max(0.0).sqrt();

    let parameters = arm
        .chain
        .parameters
        .iter()
        .enumerate()
        .map(|(column, parameter)| {
            let position = subspace.independent.binary_search(&column).ok();
            let standard_error = match &solved.errors {
                Some(errors) => errors[column].map(|error| factor * error),
                None => position.map(standard_error),
            };
            ParameterEstimate {
                name: parameter.name.clone(),
                nominal: parameter.nominal,
                identified: values[column],
                standard_error,
                unit: parameter.quantity.unit().to_owned(),
                dropped: standard_error.is_none() && values[column] == parameter.nominal,
            }
        })
        .collect();
    let combinations = subspace
        .independent
        .iter()
        .enumerate()
        .map(|(position, &column)| {
            let stood_in = subspace.dropped.iter().enumerate();
            let stood_in = stood_in.map(|(other, of)| subspace.share[(position, other)] * (values[*of] - nominal[*of]));
            let estimate = values[column] - nominal[column] + stood_in.sum::<f64>();
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

    let at_nominal = solved.nominal;
    let residuals: Vec<Residual> = measurements
        .iter()
        .map(|measurement| Residual {
            index: measurement.index,
            position_m: measurement.position_m,
            nominal: difference(measurement, &at_nominal(measurement)).into(),
            identified: difference(measurement, &predict(measurement)).into(),
        })
        .collect();
    let fitted = errors_of(&fit, predict);
    // Least squares also comes to rest in places that have nothing to do with the arm.
    let far = fitted.position_m.rms > ASTRAY || fitted.rotation_rad.is_some_and(|rotation| rotation.rms > ASTRAY);
    let astray = noise.known && scale > LARGEST_NOISE_FACTOR && far;
    let reason = if rank == 0 {
        "these configurations tell nothing apart".to_owned()
    } else if solved.converged && astray {
        format!("the fit came to rest where {:.0} mm RMS are left: this is no calibration", fitted.position_m.rms * 1e3)
    } else {
        solved.reason
    };
    let held_out_errors = (!held_out.is_empty()).then(|| errors_of(&held_out, predict));
    let held_out_nominal = (!held_out.is_empty()).then(|| errors_of(&held_out, at_nominal));
    notes.extend(doubts(arm, if solved.errors.is_some() { &nominal } else { values }, &fit, predict, &fitted));
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
        _ => notes.push("nothing is held out: the errors of fitted configurations are too optimistic".to_owned()),
    }
    Identification {
        converged: solved.converged && rank > 0 && !astray,
        reason,
        iterations: solved.steps,
        rank,
        equations,
        residual_scale: (noise.known && degrees_of_freedom > 0).then_some(scale),
        parameters,
        combinations,
        nominal: errors_of(&fit, at_nominal),
        fitted,
        held_out: held_out_errors,
        held_out_nominal,
        declared_noise: DeclaredNoise { position_m: noise.position_m, rotation_rad: noise.rotation_rad },
        noise_estimated: false,
        joint_frames: Vec::new(),
        left_out: Vec::new(),
        ladder: Vec::new(),
        residuals,
        notes,
    }
}

/// The nominal values of `arm` with the parameters `free` (columns) fitted to `measurements` and all others held; `None` if that
/// does not converge. For frames that nobody has measured, such as the measurement frame and the target on the flange.
pub fn fit_some(arm: &Arm, sensor: &Sensor, measurements: &[&Measurement], free: &[usize]) -> Option<Vec<f64>> {
    let problem = Plain::new(arm, sensor, Weights::Noise, measurements).ok()?;
    let nominal = arm.chain.nominal();
    let start = problem.linearise(&nominal);
    let seen = Subspace::reveal(&start.jacobian.select_columns(free), &vec![false; free.len()], 0.0, usize::MAX);
    let columns: Vec<usize> = seen.independent.iter().map(|position| free[*position]).collect();
    let solution = solve_from(&problem, &columns, nominal, start, MAX_STEPS);
    solution.converged().then_some(solution.point)
}

/// What a careful reader would doubt about a fit: absurd parameters, single wild readings.
fn doubts(
    arm: &Arm,
    values: &[f64],
    fit: &[&Measurement],
    predict: &dyn Fn(&Measurement) -> Pose,
    fitted: &Errors,
) -> Vec<String> {
    let mut doubts = Vec::new();
    let off = |measurement: &Measurement| difference(measurement, &predict(measurement)).fixed_rows::<3>(0).norm();
    let mut wild: Vec<(f64, &&Measurement)> = fit.iter().map(|measurement| (off(measurement), measurement)).collect();
    wild.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    // Against the median, which a few wild readings do not move.
    let usual = wild.get(wild.len() / 2).map_or(0.0, |(length, _)| *length).max(fitted.position_m.min);
    let wild: Vec<String> = wild
        .iter()
        .take_while(|(length, _)| *length > WILD * usual && *length > 1e-12)
        .take(5)
        .map(|(length, row)| format!("{} (pose_id {}) by {:.3} mm", row.index + 1, row.pose_id, length * 1e3))
        .collect();
    if !wild.is_empty() {
        doubts.push(format!(
            "some readings are far off, the median being {:.3} mm: reading {}; they pull the fit, look at them",
            usual * 1e3,
            wild.join(", ")
        ));
    }
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
    doubts
}

/// Errors of the model `chain` on `measurements`.
#[must_use]
pub fn errors(measurements: &[&Measurement], chain: &ChainAt) -> Errors {
    errors_of(measurements, &|measurement| chain.forward(&measurement.joints))
}

/// Errors of what `predict` says of `measurements`.
fn errors_of(measurements: &[&Measurement], predict: &dyn Fn(&Measurement) -> Pose) -> Errors {
    let residuals: Vec<Vector6<f64>> =
        measurements.iter().map(|measurement| difference(measurement, &predict(measurement))).collect();
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

/// Measured minus predicted pose (m, rad); zero in what was not read.
pub(super) fn difference(measurement: &Measurement, predicted: &Pose) -> Vector6<f64> {
    let mut error = match measurement.orientation() {
        Some(orientation) => pose_error(&Pose::from_parts(measurement.position().into(), orientation), predicted),
        None => {
            let difference = measurement.position().coords - predicted.translation.vector;
            Vector6::new(difference.x, difference.y, difference.z, 0.0, 0.0, 0.0)
        }
    };
    for (axis, unread) in measurement.unread.iter().enumerate() {
        if *unread {
            error[axis] = 0.0;
        }
    }
    error
}

/// The parameters of `arm`'s chain, without a prior.
pub(super) struct Plain<'a> {
    arm: &'a Arm,
    measurements: &'a [&'a Measurement],
    equations: Equations,
    /// Weight of each equation.
    weights: Vec<f64>,
    /// Points and planes on which the target was, and their poses in the measurement frame.
    features: Vec<(Feature, Pose)>,
}

struct NoiseScale {
    sum_of_squares: f64,
    known: bool,
    /// RMS length of the declared noise of a position (m) and, where it is measured, of an orientation (rad).
    position_m: f64,
    rotation_rad: Option<f64>,
}

impl NoiseScale {
    /// Root mean square of the residuals in declared sigmas, `degrees_of_freedom` of them; one where none is left.
    fn scale(&self, degrees_of_freedom: usize) -> f64 {
        if degrees_of_freedom > 0 { (self.sum_of_squares / degrees_of_freedom as f64).sqrt() } else { 1.0 }
    }
}

impl<'a> Plain<'a> {
    pub(super) fn new(
        arm: &'a Arm,
        sensor: &Sensor,
        weights: Weights,
        measurements: &'a [&'a Measurement],
    ) -> Result<Self, IdentificationError> {
        let equations = Equations::new(sensor, measurements);
        let of_equation = |(equation, sigma): (usize, &f64)| match weights {
            Weights::Unit => Ok(1.0),
            Weights::Noise if *sigma <= 0.0 => {
                Err(IdentificationError::NoNoise { what: ["position", "orientation"][equations.component(equation) / 3] })
            }
            Weights::Noise => Ok(1.0 / sigma),
        };
        let weights = equations.sigmas().iter().enumerate().map(of_equation).collect::<Result<_, _>>()?;
        Ok(Plain { arm, measurements, equations, weights, features: Vec::new() })
    }

    /// With the points and planes of `geometry`.
    pub(super) fn with_features(mut self, geometry: &Geometry) -> Self {
        self.features = geometry.features.iter().cloned().zip(geometry.poses_of_features().iter().copied()).collect();
        self
    }

    /// What the measurements tell.
    pub(super) fn equations(&self) -> &Equations {
        &self.equations
    }

    /// Takes out what the unknown pose of each point or plane does to its readings, where `targets` are the targets in its frame, m.
    fn about_features(&self, targets: &[Vector3<f64>], residuals: &mut DVector<f64>, jacobian: &mut DMatrix<f64>) {
        for (of, _) in &self.features {
            let rows = (0..self.measurements.len()).filter(|row| self.measurements[*row].feature().as_ref() == Some(of));
            let own: Vec<(usize, usize)> =
                rows.flat_map(|row| self.equations.of_position(row).map(move |equation| (row, equation))).collect();
            if own.is_empty() {
                // Only readings that are held out were there.
                continue;
            }
            let by_unknown = DMatrix::from_fn(own.len(), feature::UNKNOWNS, |at, unknown| {
                let (row, equation) = own[at];
                self.weights[equation] * feature::derivative(of, &targets[row])[(self.equations.component(equation), unknown)]
            });
            // An orthonormal basis of what the unknowns do; what is along it says nothing of the arm.
            let svd = by_unknown.svd(true, false);
            let largest = svd.singular_values.max();
            let Some(basis) = svd.u else {
                continue;
            };
            let seen: Vec<usize> = (0..basis.ncols()).filter(|at| svd.singular_values[*at] > largest * 1e-9).collect();
            let basis = basis.select_columns(&seen);
            let without = |values: DVector<f64>| &values - &basis * basis.tr_mul(&values);
            let left = without(DVector::from_iterator(own.len(), own.iter().map(|(_, equation)| residuals[*equation])));
            own.iter().zip(left.iter()).for_each(|((_, equation), value)| residuals[*equation] = *value);
            for mut column in jacobian.column_iter_mut() {
                let left = without(DVector::from_iterator(own.len(), own.iter().map(|(_, equation)| column[*equation])));
                own.iter().zip(left.iter()).for_each(|((_, equation), value)| column[*equation] = *value);
            }
        }
    }

    /// Whether there are enough equations for `rank` parameters.
    pub(super) fn enough(&self, rank: usize) -> Result<(), IdentificationError> {
        let (equations, poses) = (self.equations.len(), self.measurements.len());
        if equations >= rank {
            return Ok(());
        }
        Err(IdentificationError::TooFew { poses, equations, rank, needed: (rank * poses).div_ceil(equations.max(1)) })
    }

    /// Sum of squares of the residuals of `predict` over their declared sigmas, of the equations whose noise is declared.
    fn noise_scale(&self, predict: &dyn Fn(&Measurement) -> Pose) -> NoiseScale {
        let mut sum_of_squares = 0.0;
        let mut known = true;
        // Of a position and of an orientation.
        let mut declared = [0.0, 0.0];
        for (row, measurement) in self.measurements.iter().enumerate() {
            let error = difference(measurement, &predict(measurement));
            for equation in self.equations.of(row) {
                let (component, sigma) = (self.equations.component(equation), self.equations.sigmas()[equation]);
                declared[component / 3] += sigma.powi(2);
                if sigma > 0.0 {
                    sum_of_squares += (error[component] / sigma).powi(2);
                } else {
                    known = false;
                }
            }
        }
        let [position_m, rotation_rad] = declared.map(|squares| (squares / self.measurements.len().max(1) as f64).sqrt());
        let rotation_rad = self.equations.has_orientation().then_some(rotation_rad);
        NoiseScale { sum_of_squares, known, position_m, rotation_rad }
    }

    /// The weighted Jacobian with rows in units of the declared sigma instead.
    fn in_sigmas(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = jacobian.clone();
        for (equation, mut row) in scaled.row_iter_mut().enumerate() {
            // A reading that is declared exact is taken to a nanometre or nanoradian.
            row *= 1.0 / (self.weights[equation] * self.equations.sigmas()[equation].max(1e-9));
        }
        scaled
    }

    /// Covariance of the independent parameters from the declared noise: `A (Jᵀ W Σ W J + P) A` with `A = (Jᵀ J + P)⁻¹` of the weighted
    /// Jacobian and the prior's precision `P`, which is A itself where the weights are the sigmas; zero for no prior.
    pub(super) fn covariance(&self, jacobian: &DMatrix<f64>, subspace: &Subspace, prior: Option<&DMatrix<f64>>) -> DMatrix<f64> {
        let j = jacobian.select_columns(&subspace.independent);
        let rank = subspace.rank();
        let with_prior = |gram: DMatrix<f64>| match prior {
            Some(precision) => gram + precision,
            None => gram,
        };
        let Some(inverse) = scaled_inverse(&with_prior(gram(&j))) else {
            return DMatrix::from_element(rank, rank, f64::NAN);
        };
        let mut scaled = j.clone();
        for (equation, mut row) in scaled.row_iter_mut().enumerate() {
            row *= self.weights[equation] * self.equations.sigmas()[equation];
        }
        product(&product(&inverse, &with_prior(gram(&scaled))), &inverse)
    }
}

impl Problem for Plain<'_> {
    type Point = Vec<f64>;

    fn linearise(&self, values: &Vec<f64>) -> Linearised {
        let chain = self.arm.chain.at(values);
        let n = chain.parameter_count();
        let mut residuals = DVector::zeros(self.equations.len());
        // Built transposed: each pose then fills consecutive memory.
        let mut transposed = DMatrix::zeros(n, self.equations.len());
        let mut rows = vec![0.0; 6 * n];
        let mut targets = vec![Vector3::zeros(); self.measurements.len()];
        for (row, measurement) in self.measurements.iter().enumerate() {
            let (axes, origin) = chain.jacobian_into(&measurement.joints, &mut rows, n);
            let mut predicted = crate::arm::frames::pose_from_parts(&axes, &origin);
            let known = measurement.feature().and_then(|of| self.features.iter().find(|(known, _)| *known == of));
            if let Some((_, pose)) = known {
                into_axes(&mut rows, n, &pose.rotation.to_rotation_matrix().into_inner());
                predicted = pose.inverse() * predicted;
                targets[row] = predicted.translation.vector;
            }
            let error = difference(measurement, &predicted);
            turn_to_residual(&mut rows[3 * n..], n, &error.fixed_rows::<3>(3).into_owned());
            for equation in self.equations.of(row) {
                let (component, weight) = (self.equations.component(equation), self.weights[equation]);
                residuals[equation] = weight * error[component];
                for (entry, value) in transposed.column_mut(equation).iter_mut().zip(&rows[component * n..(component + 1) * n]) {
                    *entry = weight * value;
                }
            }
        }
        let mut jacobian = transposed.transpose();
        self.about_features(&targets, &mut residuals, &mut jacobian);
        Linearised { residuals, jacobian, departures: None }
    }

    fn moved(&self, from: &Vec<f64>, columns: &[usize], step: &DVector<f64>) -> Vec<f64> {
        let mut to = from.clone();
        for (column, change) in columns.iter().zip(step.iter()) {
            to[*column] += change;
        }
        to
    }

    fn one_sigma(&self) -> f64 {
        self.weights.first().map_or(0.0, |weight| weight * self.equations.sigmas()[0])
    }
}

/// Turns the rotation rows of a Jacobian (change of the predicted orientation) into the change of the rotation residual `error`:
/// the inverse right Jacobian of the rotation group, exact however large the residual is.
pub(super) fn turn_to_residual(rows: &mut [f64], n: usize, error: &Vector3<f64>) {
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
