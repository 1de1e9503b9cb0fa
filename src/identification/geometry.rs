//! Where an arm stands, where its target sits and how far its frames are off, from readings in a frame that nobody knows: the one fit
//! that a calibration of a real arm and a diagnosis share.
//!
//! Base and target are free, each session may have a base of its own and each target on the tool has its place. Every joint frame but the
//! first is off by six small errors ([`FrameErrors`]) with Gaussian priors of the size that machining and assembly leave.

mod relax;

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use rayon::prelude::*;

use super::feature;
use super::known::{Known, Place};
use super::least_squares::{difference, turn_to_residual};
use super::prior::{Evidence, NO_GROUP, Sizes, group};
use super::standing::{Standing, stand};
use crate::arm::chain::FrameErrors;
use crate::arm::frames::{Pose, pose_from_parts, registration, rotation_from_vector, rotation_vector};
use crate::arm::{Arm, ChainAt};
use crate::measurement::equations::{COMPONENTS, Equations};
use crate::measurement::{Distance, Feature, Measurement, Sensor};
use crate::numerics::gram;
use crate::solver::robust::Events;
use crate::solver::whitening::Whitening;
use crate::solver::{Fit, Linearised, Problem, STEP_TOLERANCE, Stop, robust, solve};

/// Base and target are free: so wide, about where the fit finds them, that it never binds; m and rad.
pub const FREE: f64 = 50e-3;
/// Rows that are looked at together, and rows from which on that is shared out.
const CHUNK: usize = 64;
const MANY: usize = 512;
/// Different configurations that a fit needs.
const CONFIGURATIONS: usize = 6;
/// Steps that place base and target, and steps of the whole fit.
const STEPS: [usize; 2] = [30, 60];
/// Rounds of fitting and weighing where readings are far off or the noise is not as declared.
const ROUNDS: usize = 12;
/// Last step of a fit that another one follows, in sigmas of all predictions together: far below what the readings tell.
const ROUGH: f64 = 1e-2;
/// Rounds of weighing so that no reading pulls more than a typical one.
const ROUNDS_OF_BOUNDED: usize = 40;
/// Mean square over that of most readings from which on some are further off than normal noise would be.
const LONG_TAILS: f64 = 1.2;
/// Mean square of what is left, in declared sigmas, from which on it is taken for the noise in what the prior counts for.
const LEVEL: f64 = 2.25;
/// Change of a row's weight, and relative change of the level, that is nothing.
const SETTLED: f64 = 0.05;
/// Smallest sigma of a reading, m or rad: what is declared exact is taken to a nanometre or nanoradian.
const SMALLEST_SIGMA: f64 = 1e-9;
/// Improvement over the noise's mean square, by parameter, from which on sessions have bases of their own (an F value).
const OWN_BASE: f64 = 6.0;
/// One sigma of an arm's size over its nominal one where nothing else tells it.
const SAME_SIZE: f64 = 1e-4;
/// Readings of a session from which on they alone say where to look for its base.
const OWN_START: usize = 4;

/// A geometry that cannot be fitted.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum GeometryError {
    /// Too few rows.
    #[error("{found} rows at {different} different configurations; at least {needed} different ones are needed")]
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

/// Readings to be fitted.
#[derive(Clone, Copy, Debug)]
pub struct Readings<'a> {
    /// The sensor.
    pub sensor: &'a Sensor,
    /// What was read.
    pub measurements: &'a [&'a Measurement],
    /// Weight of each row: 1 for a good one that stands for itself.
    pub weights: &'a [f64],
    /// What effects that are already known do to the target: shift (m) and turn (rad) in root, row by row; empty for nothing.
    pub displacement: &'a [[f64; COMPONENTS]],
    /// Joints (from 0) whose motion scatters, and one sigma of that, rad or m.
    pub scatter: &'a [(usize, f64)],
    /// Where the fit begins with each joint's zero, rad or m; empty for nominal.
    pub zeros: &'a [f64],
    /// What somebody knows of the arm beforehand.
    pub known: &'a [Known],
    /// What is made of readings that are far off in a row.
    pub events: Events,
}

impl<'a> Readings<'a> {
    /// What `sensor` read, each row weighted, of an arm of which nothing more is known.
    #[must_use]
    pub fn new(sensor: &'a Sensor, measurements: &'a [&'a Measurement], weights: &'a [f64]) -> Readings<'a> {
        Readings {
            sensor,
            measurements,
            weights,
            displacement: &[],
            scatter: &[],
            zeros: &[],
            known: &[],
            events: Events::LeftOut,
        }
    }
}

/// A fitted geometry, and what it leaves of the readings.
#[derive(Clone, Debug)]
pub struct Geometry {
    frames: FrameErrors,
    placed: Placed,
    /// Names of the sessions that have bases of their own; one for all where they share one.
    pub sessions: Vec<String>,
    /// Names of the targets.
    pub targets: Vec<String>,
    /// Points and planes on which the target was.
    pub features: Vec<Feature>,
    /// What known distances of fixed points say: whitened residuals, and what one prior sigma of each parameter does to them.
    distances: (DVector<f64>, DMatrix<f64>),
    /// Session of each row.
    pub session: Vec<usize>,
    /// Target of each row.
    pub target: Vec<usize>,
    /// What the rows tell.
    pub equations: Equations,
    /// What makes the equations alike in noise.
    pub whitening: Whitening,
    /// Measured minus predicted, m and rad in the measurement frame; of each equation.
    pub residual: DVector<f64>,
    /// What one prior sigma of each parameter does to the predictions: bases, frames, targets.
    pub jacobian: DMatrix<f64>,
    /// Which parameters are free (base and target).
    pub free: Vec<bool>,
    /// One sigma of each parameter's prior, m or rad; zero where it is held.
    sigma: Vec<f64>,
    /// What each parameter is about ([`group`]).
    group: Vec<usize>,
    /// Weight of each row beside those asked for: less than one where it is far off from what the others say.
    pub far: Vec<f64>,
    /// Mean square of the noise over the declared one, where it is larger than that; else one.
    pub level: f64,
    /// Sum of squares of whitened residuals and of the prior's pull.
    pub cost: f64,
    /// Why the fit ended.
    pub stop: Stop,
    /// Steps that it took.
    pub steps: usize,
    /// What is worth knowing about the sessions.
    pub notes: Vec<String>,
    /// Whether some reading is in the measurement frame.
    placed_in_frame: bool,
}

impl Geometry {
    /// Sigmas of the frames' priors over those of manufacturing.
    #[must_use]
    pub fn sizes(&self) -> Sizes {
        self.placed.sizes
    }

    /// Sizes of the frames' errors of which the readings are likeliest ([`super::prior`]).
    #[must_use]
    pub fn likeliest_sizes(&self) -> Sizes {
        let (residual, jacobian) = self.counted();
        let (of_distances, by_distances) = &self.distances;
        let evidence = Evidence {
            normal: gram(&jacobian) + gram(by_distances),
            with_residual: jacobian.tr_mul(&residual) + by_distances.tr_mul(of_distances),
            square: residual.norm_squared() + of_distances.norm_squared(),
            equations: self.equations_that_count() + of_distances.len(),
            parameters: &self.placed.parameters,
            free: &self.free,
            group: &self.group,
            sizes: self.placed.sizes,
        };
        evidence.likeliest()
    }

    /// Residuals and Jacobian in sigmas, those of readings that are far off as little as they count.
    pub(super) fn counted(&self) -> (DVector<f64>, DMatrix<f64>) {
        let sigma = libm::sqrt(self.level);
        let mut residual = self.whitening.of_vector(&self.residual) / sigma;
        let mut jacobian = self.whitening.of(&self.jacobian) / sigma;
        for (row, far) in self.far.iter().enumerate().filter(|(_, far)| **far < 1.0) {
            let factor = libm::sqrt(*far);
            for equation in self.equations.of(row) {
                residual[equation] *= factor;
                jacobian.row_mut(equation).scale_mut(factor);
            }
        }
        (residual, jacobian)
    }

    /// How far each row is off from what a fit without it says, in sigmas of that, equation by equation: what is left of a row that was fitted
    /// is smaller than its error, by the row's leverage. And how many numbers are left to tell the noise. None where the equations do not
    /// tell.
    pub(super) fn errors_without(&self) -> Option<(Vec<DVector<f64>>, f64)> {
        let (residual, jacobian) = self.counted();
        let mut normal = gram(&jacobian) + gram(&self.distances.1);
        (0..normal.nrows()).for_each(|at| normal[(at, at)] += 1.0);
        // With the Cholesky factor L of the normal equations the leverage of rows J is (L^-1 J')' (L^-1 J').
        let spread = normal.cholesky()?.l().solve_lower_triangular(&jacobian.transpose())?;
        let of_row = |row: usize| {
            let equations = self.equations.of(row);
            let left = residual.rows_range(equations.clone()).into_owned();
            let far = self.far.get(row).copied().unwrap_or(1.0);
            if far < robust::FAR {
                return left / libm::sqrt(far.max(f64::MIN_POSITIVE));
            }
            let own = spread.columns_range(equations);
            let leverage = own.tr_mul(&own);
            // Where nothing but the row itself tells some parameter, nothing is known of its error.
            let rest = (DMatrix::identity(left.len(), left.len()) - leverage).cholesky();
            let error = rest.and_then(|factor| factor.l().solve_lower_triangular(&left));
            error.unwrap_or_else(|| DVector::zeros(left.len()))
        };
        let left = self.equations_that_count() as f64 - spread.norm_squared();
        Some(((0..self.equations.readings()).map(of_row).collect(), left))
    }

    /// Equations of readings that are not far off.
    fn equations_that_count(&self) -> usize {
        let off: usize =
            (0..self.far.len()).filter(|row| self.far[*row] < robust::FAR).map(|row| self.equations.of(row).len()).sum();
        self.residual.len() - off
    }

    /// The fitted parameters over the sigmas of their priors; zero where free.
    #[must_use]
    pub fn parameters(&self) -> &DVector<f64> {
        &self.placed.parameters
    }

    /// Where the root stands, session by session.
    #[must_use]
    pub fn measurement_from_root(&self) -> &[Pose] {
        &self.placed.measurement_from_root
    }

    /// Where each target sits on the tool.
    #[must_use]
    pub fn tool_from_target(&self) -> &[Pose] {
        &self.placed.tool_from_target
    }

    /// The fitted arm from its root to its tool.
    #[must_use]
    pub fn root_to_tool(&self) -> ChainAt {
        self.frames.at(&Pose::identity(), &self.placed.errors(), &Pose::identity())
    }

    /// The fitted arm from the measurement frame to the target: those of the first session and target.
    #[must_use]
    pub fn measurement_to_target(&self) -> ChainAt {
        self.frames.at(&self.placed.measurement_from_root[0], &self.placed.errors(), &self.placed.tool_from_target[0])
    }

    /// The pose of its target at which `measurement` should have found it. A session or target that was not fitted counts as the first.
    #[must_use]
    pub fn predict(&self, measurement: &Measurement) -> Pose {
        let number = |known: &[String], name: &Option<String>| {
            known.iter().position(|known| *known == name.clone().unwrap_or_default()).unwrap_or(0)
        };
        let (session, target) = (number(&self.sessions, &measurement.session), number(&self.targets, &measurement.target));
        let base = &self.placed.measurement_from_root[session];
        let arm = self.frames.at(base, &self.placed.errors(), &self.placed.tool_from_target[target]);
        let mut pose = arm.forward(&measurement.joints);
        let known = measurement.feature().and_then(|of| self.features.iter().position(|known| *known == of));
        if let Some(feature) = known {
            pose = self.placed.features[feature].inverse() * pose;
        }
        pose
    }

    /// Pose of each of [`Geometry::features`] in the measurement frame: of a point its place, of a plane with the normal as z.
    #[must_use]
    pub fn poses_of_features(&self) -> &[Pose] {
        &self.placed.features
    }

    /// With the points and planes of `measurements` that were not fitted, each through where the arm says that its readings are.
    #[must_use]
    pub fn with_features_of(mut self, measurements: &[Measurement]) -> Geometry {
        for of in measurements.iter().filter_map(Measurement::feature) {
            if self.features.contains(&of) {
                continue;
            }
            // What is not known yet is predicted in the measurement frame.
            let own = measurements.iter().filter(|row| row.feature().as_ref() == Some(&of));
            let points: Vec<Vector3<f64>> = own.map(|row| self.predict(row).translation.vector).collect();
            self.placed.features.push(feature::through(&of, &points));
            self.features.push(of);
        }
        self
    }

    /// Parameters of a target.
    #[must_use]
    pub fn per_target(&self) -> usize {
        if self.equations.has_orientation() { 6 } else { 3 }
    }

    /// Whether some reading is in the measurement frame, so that it can be told where the arm stands in it.
    #[must_use]
    pub fn is_placed(&self) -> bool {
        self.placed_in_frame
    }

    /// Largest error of a frame along an axis (m) and about one (rad).
    #[must_use]
    pub fn largest_errors(&self) -> [f64; 2] {
        let errors = self.placed.errors();
        let largest = |turns: bool| {
            let of = errors.iter().enumerate().filter(|(at, _)| (at % FrameErrors::PER_FRAME >= 3) == turns);
            of.map(|(_, value)| value.abs()).fold(0.0, f64::max)
        };
        [largest(false), largest(true)]
    }
}

/// Fits base, target and geometry of `arm` to `readings`. Sessions get bases of their own where that is worth it.
///
/// # Errors
/// If the readings cannot tell.
pub fn fit(arm: &Arm, readings: Readings<'_>) -> Result<Geometry, GeometryError> {
    fit_at(arm, readings, Sizes::MANUFACTURING)
}

/// The residual (m and rad) that is left with priors of the size that the readings speak for ([`Geometry::likeliest_sizes`]), where `loose`
/// is what [`fit`] makes of the same readings.
///
/// # Errors
/// As [`fit`].
pub fn shrunk_residual(arm: &Arm, readings: Readings<'_>, loose: &Geometry) -> Result<DVector<f64>, GeometryError> {
    let sizes = loose.likeliest_sizes();
    if sizes == loose.sizes() { Ok(loose.residual.clone()) } else { Ok(fit_at(arm, readings, sizes)?.residual) }
}

/// As [`fit`] with priors of the frames' errors of these sizes.
///
/// # Errors
/// As [`fit`].
pub fn fit_at(arm: &Arm, readings: Readings<'_>, sizes: Sizes) -> Result<Geometry, GeometryError> {
    fit_to(arm, readings, sizes, STEP_TOLERANCE)
}

/// As [`fit_at`], to where steps matter no more, but not further: for fits that another one follows.
pub(super) fn fit_roughly(arm: &Arm, readings: Readings<'_>, sizes: Sizes) -> Result<Geometry, GeometryError> {
    fit_to(arm, readings, sizes, ROUGH)
}

fn fit_to(arm: &Arm, readings: Readings<'_>, sizes: Sizes, tolerance: f64) -> Result<Geometry, GeometryError> {
    let (mut names, mut session) = numbered(readings.measurements, |row| row.session.as_deref());
    if !readings.measurements.iter().any(|row| row.is_in_frame()) || readings.known.iter().any(|known| known.place == Place::Base)
    {
        // Features are in no frame but the arm's own, and a base that is held is the same in all sessions.
        names.truncate(1);
        session.fill(0);
    }
    let together = fit_with(arm, readings, &vec![0; session.len()], vec![String::new()], sizes, tolerance)?;
    if names.len() < 2 {
        return Ok(together);
    }
    let apart = fit_with(arm, readings, &session, names.clone(), sizes, tolerance)?;
    let added = (FrameErrors::PER_FRAME * (names.len() - 1)) as f64;
    let left = (apart.residual.len() as f64 - apart.jacobian.ncols() as f64).max(1.0);
    if (together.cost - apart.cost) / added < OWN_BASE * apart.cost / left {
        let notes = vec![format!("the {} sessions share one base: bases of their own would not fit better", names.len())];
        return Ok(Geometry { notes, ..together });
    }
    let bases = apart.measurement_from_root();
    let moved: Vec<String> = names[1..]
        .iter()
        .zip(&bases[1..])
        .map(|(name, base)| {
            let change = bases[0].inverse() * base;
            let (shift, turn) = (change.translation.vector.norm(), rotation_vector(&change.rotation).norm());
            format!("`{name}` {:.3} mm and {:.3} mrad", shift * 1e3, turn * 1e3)
        })
        .collect();
    let note = format!(
        "the sessions have bases of their own; against `{}` the base or the sensor has moved in session {}",
        names[0],
        moved.join(", ")
    );
    Ok(Geometry { notes: vec![note], ..apart })
}

impl Geometry {
    /// The same readings with priors of other sizes, from here on: sessions have the bases that they have here.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn refit(&self, arm: &Arm, readings: Readings<'_>, sizes: Sizes) -> Result<Geometry, GeometryError> {
        self.refit_to(arm, readings, sizes, STEP_TOLERANCE)
    }

    /// As [`Geometry::refit`], to where steps matter no more, but not further.
    pub(super) fn refit_roughly(&self, arm: &Arm, readings: Readings<'_>, sizes: Sizes) -> Result<Geometry, GeometryError> {
        self.refit_to(arm, readings, sizes, ROUGH)
    }

    fn refit_to(&self, arm: &Arm, readings: Readings<'_>, sizes: Sizes, tolerance: f64) -> Result<Geometry, GeometryError> {
        let mut problem = Placing::new(arm, readings, &self.session, self.sessions.len(), sizes)?;
        let errors = self.placed.errors();
        let mut start = Placed { sizes, sigma: problem.sigma_of_frames(), ..self.placed.clone() };
        // Features that were added afterwards are none of these readings.
        start.features.truncate(problem.features.len());
        for (at, error) in errors.iter().enumerate() {
            let sigma = start.sigma[at];
            start.parameters[start.before + at] = if sigma > 0.0 { error / sigma } else { 0.0 };
        }
        (problem.far, problem.level) = (self.far.clone(), self.level);
        problem.whiten(&start);
        Ok(Geometry { notes: self.notes.clone(), ..finish(problem, start, self.sessions.clone(), tolerance) })
    }

    /// Errors of the joint frames from the second on, six each (m, rad), in the frame in which the joint moves about or along z.
    #[must_use]
    pub fn frame_errors(&self) -> Vec<f64> {
        self.placed.errors()
    }

    /// What is known besides the readings (distances of fixed points, or the arm's size where nothing tells it): residuals in sigmas, and
    /// what one prior sigma of each parameter does to them.
    #[must_use]
    pub fn known(&self) -> &(DVector<f64>, DMatrix<f64>) {
        &self.distances
    }

    /// Which frames these are.
    #[must_use]
    pub fn frames(&self) -> &FrameErrors {
        &self.frames
    }

    /// First column of the frames' errors, those of the bases before it.
    #[must_use]
    pub fn first_of_frames(&self) -> usize {
        self.placed.before
    }

    /// Covariance of what is fitted from the sensor's noise (where that is larger than declared, as large as it is) and the prior, in m and
    /// rad: bases, frames, targets, each base and target in its own frame. `None` where the equations do not tell.
    #[must_use]
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let jacobian = self.counted().1;
        let mut normal = gram(&jacobian) + gram(&self.distances.1);
        (0..normal.nrows()).for_each(|at| normal[(at, at)] += 1.0);
        let mut covariance = normal.cholesky()?.inverse();
        for (row, of_row) in self.sigma.iter().enumerate() {
            for (column, of_column) in self.sigma.iter().enumerate() {
                covariance[(row, column)] *= of_row * of_column;
            }
        }
        Some(covariance)
    }

    /// One sigma of the prior of the frames' error number `at`, m or rad.
    #[must_use]
    pub fn sigma_of_frame_error(&self, at: usize) -> f64 {
        self.placed.sigma[at]
    }
}

/// The names that `of` gives the rows, sorted, and of each row the number of its own.
fn numbered<'a>(measurements: &[&'a Measurement], of: impl Fn(&'a Measurement) -> Option<&'a str>) -> (Vec<String>, Vec<usize>) {
    let own: Vec<&str> = measurements.iter().map(|row| of(row).unwrap_or_default()).collect();
    let mut names = own.clone();
    names.sort_unstable();
    names.dedup();
    let which = own.iter().map(|name| names.binary_search(name).unwrap_or(0)).collect();
    (names.into_iter().map(str::to_owned).collect(), which)
}

/// As [`fit_at`]; `session` of each row, which have these names.
fn fit_with(
    arm: &Arm,
    readings: Readings<'_>,
    session: &[usize],
    sessions: Vec<String>,
    sizes: Sizes,
    tolerance: f64,
) -> Result<Geometry, GeometryError> {
    let mut problem = Placing::new(arm, readings, session, sessions.len(), sizes)?;
    let start = problem.start(arm)?;
    let of_free: Vec<usize> = (0..problem.free.len()).filter(|column| problem.free[*column]).collect();
    // Base and target first: what is fitted with them far off would throw the frames about.
    let placed = if of_free.is_empty() { start } else { problem.robustly(&of_free, start, STEPS[0]).point };
    let all: Vec<usize> = (0..problem.free.len()).filter(|column| problem.sigma[*column] > 0.0).collect();
    // Errors that are larger than those of most readings, far off or hidden in the fit: they had better not pull at all.
    let plain = problem.robustly(&all, placed.clone(), STEPS[1]).point;
    let squares = problem.squares(&plain);
    let counts = problem.equations.counts();
    let mean = squares.iter().sum::<f64>() / counts.iter().sum::<usize>().max(1) as f64;
    let outliers = mean > LONG_TAILS * robust::level(&squares, &counts);
    let placed = if outliers { problem.bounded(&all, placed) } else { plain };
    Ok(finish(problem, placed, sessions, tolerance))
}

/// Fits all that `problem` leaves free, from `start`.
fn finish(mut problem: Placing<'_>, start: Placed, sessions: Vec<String>, tolerance: f64) -> Geometry {
    let free = problem.free.clone();
    let moves = |column: &usize| free[*column] || problem.sigma[*column] > 0.0;
    let all: Vec<usize> = (0..free.len()).filter(moves).collect();
    let mut fit = problem.robustly(&all, start, STEPS[1]);
    let mut steps = fit.steps;
    if tolerance < problem.tolerance {
        problem.tolerance = tolerance;
        fit = problem.robustly(&all, fit.point, STEPS[1]);
        steps += fit.steps;
    }
    if !problem.readings.scatter.is_empty() {
        // What scatter does was that of the nominal arm.
        problem.whiten(&fit.point);
        fit = problem.robustly(&all, fit.point, STEPS[1]);
        steps += fit.steps;
    }
    let far = std::mem::take(&mut problem.far);
    problem.whiten(&fit.point);
    let (residual, jacobian) = problem.raw(&fit.point);
    let distances = problem.distances(&fit.point);
    let placed_in_frame = problem.readings.measurements.iter().any(|row| row.is_in_frame());
    Geometry {
        far,
        level: problem.level,
        cost: problem.level * fit.linearised.cost(),
        stop: fit.stop,
        steps,
        placed: fit.point,
        residual,
        jacobian,
        free,
        sigma: problem.sigma,
        group: problem.group,
        sessions,
        session: problem.session.to_vec(),
        targets: problem.targets,
        features: problem.features,
        distances,
        placed_in_frame,
        target: problem.target,
        equations: problem.equations,
        whitening: problem.whitening,
        frames: problem.frames,
        notes: Vec::new(),
    }
}

/// All that is fitted.
#[derive(Clone, Debug)]
struct Placed {
    measurement_from_root: Vec<Pose>,
    tool_from_target: Vec<Pose>,
    /// Points and planes in the measurement frame.
    features: Vec<Pose>,
    /// Of the frames, over the sigmas of their priors; zero for bases and targets, which are in the poses above.
    parameters: DVector<f64>,
    /// Bases, which come before the frames.
    before: usize,
    /// Frame errors.
    count: usize,
    /// Sizes of the frames' priors.
    sizes: Sizes,
    /// One sigma of each frame error's prior, m or rad.
    sigma: Vec<f64>,
}

impl Placed {
    /// Errors of the frames, m and rad.
    fn errors(&self) -> Vec<f64> {
        self.parameters.rows(self.before, self.count).iter().zip(&self.sigma).map(|(value, sigma)| value * sigma).collect()
    }
}

/// The problem of placing an arm.
struct Placing<'a> {
    frames: FrameErrors,
    readings: Readings<'a>,
    session: &'a [usize],
    targets: Vec<String>,
    target: Vec<usize>,
    features: Vec<Feature>,
    /// Feature of each row.
    feature: Vec<Option<usize>>,
    equations: Equations,
    whitening: Whitening,
    bases: usize,
    /// Columns of a target: its turn shows only where orientations are read.
    per_target: usize,
    free: Vec<bool>,
    /// Of each column's prior, m or rad; zero where it is held.
    sigma: Vec<f64>,
    /// What each column is about ([`group`]).
    group: Vec<usize>,
    /// Weight of each row for being far off; empty for one.
    far: Vec<f64>,
    /// Mean square of the noise over the declared one: the prior's sigmas are true ones, so that they count for more where the noise is
    /// larger than declared.
    level: f64,
    /// Sizes of the frames' priors.
    sizes: Sizes,
    /// Largest last step, see [`Problem::tolerance`].
    tolerance: f64,
}

impl<'a> Placing<'a> {
    fn new(arm: &Arm, readings: Readings<'a>, session: &'a [usize], bases: usize, sizes: Sizes) -> Result<Self, GeometryError> {
        let measurements = readings.measurements;
        let expected = arm.joint_count();
        for (row, measurement) in measurements.iter().enumerate() {
            let found = measurement.joints.len();
            if found != expected {
                return Err(GeometryError::Joints { row: row + 1, found, expected });
            }
        }
        let mut different: Vec<&[f64]> = measurements.iter().map(|row| row.joints.as_slice()).collect();
        different.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        different.dedup();
        if different.len() < CONFIGURATIONS {
            let (found, different) = (measurements.len(), different.len());
            return Err(GeometryError::TooFew { found, different, needed: CONFIGURATIONS });
        }
        let frames = FrameErrors::new(&arm.chain);
        let (targets, target) = numbered(measurements, |row| row.target.as_deref());
        let equations = Equations::new(readings.sensor, measurements);
        let per_target = if equations.has_orientation() { 6 } else { 3 };
        let (before, count) = (FrameErrors::PER_FRAME * bases, FrameErrors::PER_FRAME * frames.frames());
        let mut features: Vec<Feature> = measurements.iter().filter_map(|row| row.feature()).collect();
        features.sort_unstable();
        features.dedup();
        let of_row = |row: &&Measurement| row.feature().and_then(|of| features.binary_search(&of).ok());
        let feature: Vec<Option<usize>> = measurements.iter().map(of_row).collect();
        let width = before + count + per_target * targets.len() + feature::UNKNOWNS * features.len();
        let is_of_frames = |column: usize| (before..before + count).contains(&column);
        let mut free: Vec<bool> = (0..width).map(|column| !is_of_frames(column)).collect();
        let mut sigma: Vec<f64> =
            (0..width).map(|column| if free[column] { FREE } else { sizes.sigma(&frames, column - before) }).collect();
        let mut groups: Vec<usize> =
            (0..width).map(|column| if free[column] { NO_GROUP } else { group(&frames, column - before) }).collect();
        let of_targets = before + count..before + count + per_target * targets.len();
        for Known { place, sigma: known } in readings.known {
            let columns = match place {
                Place::Base => 0..before,
                Place::Target => of_targets.clone(),
                Place::Frame(at) => before + at..before + at + usize::from(*at < count),
            };
            for column in columns {
                (free[column], sigma[column], groups[column]) = (false, *known, NO_GROUP);
            }
        }
        let whitening = Whitening::new(&equations, inverse_sigmas(&equations), readings.weights);
        let (far, level) = (Vec::new(), 1.0);
        Ok(Placing {
            frames,
            readings,
            session,
            targets,
            target,
            features,
            feature,
            equations,
            whitening,
            bases,
            per_target,
            free,
            sigma,
            group: groups,
            far,
            level,
            sizes,
            tolerance: ROUGH,
        })
    }

    /// Where base and target are before anything is fitted.
    fn start(&self, arm: &Arm) -> Result<Placed, GeometryError> {
        let measurements = self.readings.measurements;
        let nominal = arm.chain.at_nominal();
        let zero = |joint: usize| self.readings.zeros.get(joint).copied().unwrap_or(0.0);
        let pose = |row: &&Measurement| {
            let joints: Vec<f64> = row.joints.iter().enumerate().map(|(joint, value)| value + zero(joint)).collect();
            nominal.forward(&joints)
        };
        let poses: Vec<Pose> = measurements.iter().map(pose).collect();
        let of = |rows: &[usize]| {
            let tools: Vec<Pose> = rows.iter().map(|row| poses[*row]).collect();
            let read: Vec<&Measurement> = rows.iter().map(|row| measurements[*row]).collect();
            let target: Vec<usize> = rows.iter().map(|row| self.target[*row]).collect();
            stand(&tools, &read, &target, self.targets.len())
        };
        let of_session = |base: usize| {
            let own = |row: &usize| self.session[*row] == base && self.feature[*row].is_none();
            (0..measurements.len()).filter(own).collect::<Vec<usize>>()
        };
        // Of sessions with bases of their own the longest tells where the targets are.
        let rows = (0..self.bases).map(of_session).max_by_key(Vec::len).unwrap_or_default();
        let all = if rows.is_empty() { self.on_features(&poses) } else { of(&rows) };
        let mut all = all.ok_or(GeometryError::Degenerate)?;
        let is_held = |place: Place| self.readings.known.iter().any(|known| known.place == place);
        if is_held(Place::Target) {
            all.tool_from_target.iter_mut().for_each(|target| *target = Pose::identity());
        }
        if is_held(Place::Base) {
            all.measurement_from_root = Pose::identity();
        }
        let tool_from_target = all.tool_from_target;
        let base_of = |base: usize| {
            let rows = of_session(base);
            let whole: Vec<usize> = rows.iter().copied().filter(|row| measurements[*row].unread == [false; 3]).collect();
            let rows = if whole.is_empty() { rows } else { whole };
            if self.bases == 1 || rows.len() < OWN_START || is_held(Place::Base) {
                return None;
            }
            let from: Vec<Vector3<f64>> =
                rows.iter().map(|row| (poses[*row] * tool_from_target[self.target[*row]]).translation.vector).collect();
            let to: Vec<Vector3<f64>> = rows.iter().map(|row| measurements[*row].position().coords).collect();
            registration(&from, &to)
        };
        let measurement_from_root = (0..self.bases).map(|base| base_of(base).unwrap_or(all.measurement_from_root)).collect();
        let measurement_from_root: Vec<Pose> = measurement_from_root;
        let mut points = vec![Vec::new(); self.features.len()];
        for (row, feature) in self.feature.iter().enumerate() {
            if let Some(points) = feature.map(|feature| &mut points[feature]) {
                let base = &measurement_from_root[self.session[row]];
                points.push((base * poses[row] * tool_from_target[self.target[row]]).translation.vector);
            }
        }
        let mut parameters = DVector::zeros(self.free.len());
        for (joint, zero) in self.readings.zeros.iter().enumerate() {
            if let Some(column) = self.frames.zero_of(joint).map(|at| FrameErrors::PER_FRAME * self.bases + at) {
                parameters[column] = if self.sigma[column] > 0.0 { zero / self.sigma[column] } else { 0.0 };
            }
        }
        Ok(Placed {
            measurement_from_root,
            tool_from_target,
            features: self.features.iter().zip(&points).map(|(of, points)| feature::through(of, points)).collect(),
            parameters,
            before: FrameErrors::PER_FRAME * self.bases,
            count: FrameErrors::PER_FRAME * self.frames.frames(),
            sizes: self.sizes,
            sigma: self.sigma_of_frames(),
        })
    }

    fn sigma_of_frames(&self) -> Vec<f64> {
        let before = FrameErrors::PER_FRAME * self.bases;
        self.sigma[before..before + FrameErrors::PER_FRAME * self.frames.frames()].to_vec()
    }

    /// The arm at its root, and targets on the tool at which the readings of each feature come nearest to one another.
    fn on_features(&self, poses: &[Pose]) -> Option<Standing> {
        let targets = feature::targets(poses, &self.target, &self.feature, &self.features, self.targets.len())?;
        Some(Standing {
            measurement_from_root: Pose::identity(),
            tool_from_target: targets.into_iter().map(|at| Pose::translation(at.x, at.y, at.z)).collect(),
            left_m: 0.0,
            spread_m: 0.0,
        })
    }

    /// First column of the features.
    fn first_of_features(&self) -> usize {
        self.free.len() - feature::UNKNOWNS * self.features.len()
    }

    /// What the known distances of fixed points say about `placed`: whitened residuals and Jacobian.
    fn distances(&self, placed: &Placed) -> (DVector<f64>, DMatrix<f64>) {
        let known: Vec<(usize, usize, &Distance)> = self
            .readings
            .sensor
            .distances
            .iter()
            .filter_map(|of| {
                let point = |label: &String| self.features.binary_search(&Feature::Point(label.clone())).ok();
                Some((point(&of.point_a)?, point(&of.point_b)?, of))
            })
            .collect();
        // Readings on features alone leave the size of the arm open, and least squares would shrink it to a point.
        let sized = !known.is_empty() || self.feature.iter().any(Option::is_none);
        let (count, more) = (known.len(), usize::from(!sized));
        let mut residual = DVector::zeros(count + more);
        let mut jacobian = DMatrix::zeros(count + more, self.free.len());
        if !sized {
            let growth = self.frames.growth();
            let total: f64 = growth.iter().map(|value| value * value).sum::<f64>().max(SMALLEST_SIGMA);
            for (at, value) in growth.iter().enumerate() {
                let column = placed.before + at;
                let share = value / total / SAME_SIZE;
                residual[count] -= share * placed.parameters[column] * self.sigma[column];
                jacobian[(count, column)] = share * self.sigma[column];
            }
        }
        for (row, (a, b, of)) in known.into_iter().enumerate() {
            let apart = placed.features[a].translation.vector - placed.features[b].translation.vector;
            let length = apart.norm().max(SMALLEST_SIGMA);
            let sigma = of.sigma_m.max(SMALLEST_SIGMA);
            residual[row] = (of.distance_m - length) / sigma;
            for axis in 0..3 {
                let change = apart[axis] / length / sigma * FREE;
                jacobian[(row, self.first_of_features() + feature::UNKNOWNS * a + axis)] = change;
                jacobian[(row, self.first_of_features() + feature::UNKNOWNS * b + axis)] = -change;
            }
        }
        (residual, jacobian)
    }

    /// The chain of each pair of session and target, and where its Jacobian's columns belong.
    fn chains(&self, placed: &Placed) -> Vec<(ChainAt, Vec<Option<usize>>)> {
        let errors = placed.errors();
        let mut chains = Vec::with_capacity(self.bases * self.targets.len());
        for (session, base) in placed.measurement_from_root.iter().enumerate() {
            for (target, of_target) in placed.tool_from_target.iter().enumerate() {
                let of_base = (0..FrameErrors::PER_FRAME).map(|at| Some(FrameErrors::PER_FRAME * session + at));
                let of_frames = (placed.before..placed.before + placed.count).map(Some);
                let first = placed.before + placed.count + self.per_target * target;
                let of_this = (0..FrameErrors::PER_FRAME).map(|at| (at < self.per_target).then_some(first + at));
                chains.push((self.frames.at(base, &errors, of_target), of_base.chain(of_frames).chain(of_this).collect()));
            }
        }
        chains
    }

    /// Chain of a row in [`Placing::chains`].
    fn chain_of(&self, row: usize) -> usize {
        self.session[row] * self.targets.len() + self.target[row]
    }

    /// Measured minus predicted (m and rad) of a row, where the arm alone predicts `predicted`.
    fn difference(&self, row: usize, placed: &Placed, mut predicted: Pose) -> Vector6<f64> {
        if let Some([x, y, z, rx, ry, rz]) = self.readings.displacement.get(row) {
            let turn = placed.measurement_from_root[self.session[row]].rotation;
            predicted.translation.vector += turn * Vector3::new(*x, *y, *z);
            predicted.rotation = rotation_from_vector(&(turn * Vector3::new(*rx, *ry, *rz))) * predicted.rotation;
        }
        if let Some(feature) = self.feature[row] {
            predicted = placed.features[feature].inverse() * predicted;
        }
        difference(self.readings.measurements[row], &predicted)
    }

    /// Residuals: measured minus predicted, m and rad.
    fn residual(&self, placed: &Placed) -> DVector<f64> {
        let chains = self.chains(placed);
        let mut residual = DVector::zeros(self.equations.len());
        for (row, measurement) in self.readings.measurements.iter().enumerate() {
            let error = self.difference(row, placed, chains[self.chain_of(row)].0.forward(&measurement.joints));
            for equation in self.equations.of(row) {
                residual[equation] = error[self.equations.component(equation)];
            }
        }
        residual
    }

    /// Residuals (measured minus predicted, m and rad) and what one sigma of each parameter does to the predictions.
    fn raw(&self, placed: &Placed) -> (DVector<f64>, DMatrix<f64>) {
        let chains = self.chains(placed);
        let (count, width, equations) = (self.readings.measurements.len(), self.free.len(), self.equations.len());
        let chunks: Vec<Range<usize>> = (0..count).step_by(CHUNK).map(|first| first..(first + CHUNK).min(count)).collect();
        let of_chunk = |rows: &Range<usize>| self.raw_of(placed, &chains, rows.clone());
        let parts: Vec<(Vec<f64>, Vec<f64>)> =
            if count >= MANY { chunks.par_iter().map(of_chunk).collect() } else { chunks.iter().map(of_chunk).collect() };
        let mut residual = DVector::zeros(equations);
        let mut jacobian = DMatrix::zeros(equations, width);
        for (rows, (left, by_equation)) in chunks.iter().zip(&parts) {
            let first = self.equations.of(rows.start).start;
            residual.as_mut_slice()[first..first + left.len()].copy_from_slice(left);
            for (column, values) in jacobian.as_mut_slice().chunks_exact_mut(equations.max(1)).enumerate() {
                let own = by_equation.iter().skip(column).step_by(width);
                values[first..first + left.len()].iter_mut().zip(own).for_each(|(to, from)| *to = *from);
            }
        }
        (residual, jacobian)
    }

    /// [`Placing::raw`] of some rows, equation by equation.
    fn raw_of(&self, placed: &Placed, chains: &[(ChainAt, Vec<Option<usize>>)], rows: Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let columns = FrameErrors::PER_FRAME * (self.frames.frames() + 2);
        let mut buffer = vec![0.0; COMPONENTS * columns];
        let width = self.free.len();
        let first = self.equations.of(rows.start).start;
        let total = self.equations.of(rows.end - 1).end - first;
        let (mut residual, mut jacobian) = (vec![0.0; total], vec![0.0; total * width]);
        for row in rows {
            let measurement = self.readings.measurements[row];
            let (chain, place) = &chains[self.chain_of(row)];
            let (axes, origin) = chain.jacobian_into(&measurement.joints, &mut buffer, columns);
            let error = self.difference(row, placed, pose_from_parts(&axes, &origin));
            let mut of_feature = Matrix3::zeros();
            if let Some(number) = self.feature[row] {
                let (of, pose) = (&self.features[number], &placed.features[number]);
                of_feature = feature::derivative(of, &(pose.inverse() * nalgebra::Point3::from(origin)).coords);
                if let Feature::Plane(_) = of {
                    into_axes(&mut buffer, columns, &pose.rotation.to_rotation_matrix().into_inner());
                }
            }
            turn_to_residual(&mut buffer[3 * columns..], columns, &error.fixed_rows::<3>(3).into_owned());
            for equation in self.equations.of(row) {
                let component = self.equations.component(equation);
                let at = equation - first;
                residual[at] = error[component];
                let own = &mut jacobian[at * width..(at + 1) * width];
                for (value, place) in buffer[component * columns..(component + 1) * columns].iter().zip(place) {
                    if let Some(column) = place {
                        own[*column] = value * self.sigma[*column];
                    }
                }
                if let (Some(feature), 0..3) = (self.feature[row], component) {
                    for unknown in 0..feature::UNKNOWNS {
                        let column = self.first_of_features() + feature::UNKNOWNS * feature + unknown;
                        own[column] = of_feature[(component, unknown)] * self.sigma[column];
                    }
                }
            }
        }
        (residual, jacobian)
    }

    /// Weighs the rows by what is left at `start`, fits `columns` from there and estimates the noise, until that changes no more. Where no
    /// row is far off and the noise is as declared, this is one least squares.
    fn robustly(&mut self, columns: &[usize], start: Placed, most: usize) -> Fit<Placed> {
        // A start that is off by itself tells which rows are further off, but not the noise.
        self.far = self.far_off(&start).0;
        self.whiten(&start);
        let mut fit = solve(self, columns, start, most);
        // While the frames are held, no prior counts.
        let bound = columns.iter().any(|column| !self.free[*column]);
        for _ in 0..ROUNDS {
            let (far, level) = self.far_off(&fit.point);
            let level = if level > LEVEL && bound { level } else { 1.0 };
            let same = far.iter().zip(&self.far).all(|(weight, before)| (weight - before).abs() < SETTLED)
                && (level / self.level - 1.0).abs() < SETTLED;
            if same {
                break;
            }
            (self.far, self.level) = (far, level);
            self.whiten(&fit.point);
            let steps = fit.steps;
            fit = solve(self, columns, fit.point, most);
            fit.steps += steps;
        }
        fit
    }

    /// From `start`, where no reading pulls more than a typical one: what a fit that leaves out readings can begin with.
    fn bounded(&mut self, columns: &[usize], start: Placed) -> Placed {
        let counts = self.equations.counts();
        let mut point = start;
        for _ in 0..ROUNDS_OF_BOUNDED {
            let weights = robust::bounded(&self.squares(&point), &counts);
            let same = self.far.len() == weights.len()
                && weights.iter().zip(&self.far).all(|(weight, before)| (weight - before).abs() < SETTLED);
            if same {
                break;
            }
            self.far = weights;
            self.whiten(&point);
            point = solve(self, columns, point, 1).point;
        }
        point
    }

    /// Square of each row's residual in declared sigmas.
    fn squares(&self, placed: &Placed) -> Vec<f64> {
        let counts = self.equations.counts();
        let sensor = Whitening::new(&self.equations, inverse_sigmas(&self.equations), &vec![1.0; counts.len()]);
        let whitened = sensor.of_vector(&self.residual(placed));
        (0..counts.len()).map(|row| whitened.rows_range(self.equations.of(row)).norm_squared()).collect()
    }

    /// Weight of each row for how far off it is at `placed`, and the mean square of the noise over the declared one.
    fn far_off(&self, placed: &Placed) -> (Vec<f64>, f64) {
        let (counts, squares) = (self.equations.counts(), self.squares(placed));
        let mut far = robust::weights(&squares, &counts, self.readings.events);
        far.iter_mut().filter(|weight| **weight >= robust::FAR).for_each(|weight| *weight = 1.0);
        (far, robust::level(&squares, &counts))
    }

    /// Axes of the features on which rows are that have axes of their own; empty where none has.
    fn axes(&self, placed: &Placed) -> Vec<Option<Matrix3<f64>>> {
        if !self.features.iter().any(|of| matches!(of, Feature::Plane(_))) {
            return Vec::new();
        }
        let of = |feature: usize| placed.features[feature].rotation.to_rotation_matrix().into_inner();
        self.feature.iter().map(|feature| feature.map(of)).collect()
    }

    /// Whitens with what scatter does about `placed`.
    fn whiten(&mut self, placed: &Placed) {
        self.equations.set_axes(self.axes(placed));
        let far = |row: usize| self.far.get(row).copied().unwrap_or(1.0);
        let weights: Vec<f64> = self.readings.weights.iter().enumerate().map(|(row, weight)| weight * far(row)).collect();
        let whitening = Whitening::new(&self.equations, inverse_sigmas(&self.equations), &weights);
        if self.readings.scatter.is_empty() {
            self.whitening = whitening;
            return;
        }
        let chains = self.chains(placed);
        let of_row = |(row, measurement): (usize, &&Measurement)| -> Vec<DVector<f64>> {
            let motion = chains[self.chain_of(row)].0.joint_jacobian(&measurement.joints);
            let moved = |(joint, sigma): &(usize, f64)| {
                let picked: Vec<f64> = self.equations.pick(row, motion[*joint].into()).map(|value| value * sigma).collect();
                DVector::from_vec(picked)
            };
            self.readings.scatter.iter().map(moved).collect()
        };
        let scattered: Vec<Vec<DVector<f64>>> = self.readings.measurements.iter().enumerate().map(of_row).collect();
        self.whitening = whitening.with(&scattered);
    }
}

/// Turns the rows of a pose's Jacobian (linear, then angular, of this many columns) into components along `axes` (columns).
pub(super) fn into_axes(rows: &mut [f64], columns: usize, axes: &Matrix3<f64>) {
    for half in rows.chunks_exact_mut(3 * columns) {
        for column in 0..columns {
            let turned = axes.tr_mul(&Vector3::new(half[column], half[columns + column], half[2 * columns + column]));
            (0..3).for_each(|axis| half[axis * columns + column] = turned[axis]);
        }
    }
}

/// One over the sigma of each equation.
fn inverse_sigmas(equations: &Equations) -> DVector<f64> {
    DVector::from_iterator(equations.len(), equations.sigmas().iter().map(|sigma| 1.0 / sigma.max(SMALLEST_SIGMA)))
}

impl Problem for Placing<'_> {
    type Point = Placed;

    fn linearise(&self, at: &Placed) -> Linearised {
        let (residual, mut jacobian) = self.raw(at);
        let sigma = libm::sqrt(self.level);
        let mut residuals = self.whitening.of_vector(&residual) / sigma;
        self.whitening.apply_to(&mut jacobian, 1.0 / sigma);
        let (of_distances, by_distances) = self.distances(at);
        if !of_distances.is_empty() {
            let (read, known) = (residuals.len(), of_distances.len());
            residuals = residuals.resize_vertically(read + known, 0.0);
            jacobian = jacobian.resize_vertically(read + known, 0.0);
            residuals.rows_mut(read, known).copy_from(&of_distances);
            jacobian.rows_mut(read, known).copy_from(&by_distances);
        }
        Linearised { residuals, jacobian, departures: Some(at.parameters.clone()) }
    }

    fn moved(&self, from: &Placed, columns: &[usize], step: &DVector<f64>) -> Placed {
        let mut change = DVector::zeros(self.free.len());
        for (column, value) in columns.iter().zip(step.iter()) {
            change[*column] = *value;
        }
        let mut to = from.clone();
        let after = from.before + from.count;
        let pose = |first: usize, count: usize| {
            let mut errors = [0.0; FrameErrors::PER_FRAME];
            (0..count).for_each(|at| errors[at] = change[first + at] * self.sigma[first + at]);
            FrameErrors::pose(&errors)
        };
        for (session, base) in to.measurement_from_root.iter_mut().enumerate() {
            *base *= pose(FrameErrors::PER_FRAME * session, FrameErrors::PER_FRAME);
        }
        for (target, place) in to.tool_from_target.iter_mut().enumerate() {
            *place *= pose(after + self.per_target * target, self.per_target);
        }
        for column in from.before..after {
            to.parameters[column] += change[column];
        }
        for (number, pose) in to.features.iter_mut().enumerate() {
            let first = self.first_of_features() + feature::UNKNOWNS * number;
            let by = Vector3::from_fn(|unknown, _| change[first + unknown] * self.sigma[first + unknown]);
            *pose = feature::moved(&self.features[number], pose, &by);
        }
        to
    }

    fn one_sigma(&self) -> f64 {
        1.0
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::arm::mdh;
    use crate::arm::{Joint, JointKind};
    use crate::seed::{Stream, stream};

    /// An arm of `count` joints whose frames are drawn; some joints slide.
    pub(super) fn arm(count: usize, stream: &mut Stream) -> Arm {
        let mut frame = || mdh::Frame {
            alpha: stream.uniform(-2.0, 2.0),
            a: stream.uniform(-0.4, 0.4),
            theta: stream.uniform(-2.0, 2.0),
            d: stream.uniform(-0.4, 0.4),
            beta: 0.0,
        };
        let frames: Vec<mdh::Frame> = (0..=count).map(|_| frame()).collect();
        let joint = |number: usize| {
            let kind = if number % 4 == 2 { JointKind::Prismatic } else { JointKind::Revolute };
            Joint { name: format!("j{number}"), kind, lower: -1.5, upper: 1.5, mimic: None }
        };
        Arm {
            name: "drawn".to_owned(),
            chain: mdh::chain(&frames, (0..count).map(joint).collect(), None, None),
            links: Vec::new(),
            fixtures: Vec::new(),
            uncollidable: Vec::new(),
            gravity_in_base: Vector3::new(0.0, 0.0, -9.81),
        }
    }

    pub(super) fn sensor(orientation: bool) -> Sensor {
        Sensor {
            position_in_base: nalgebra::Point3::origin(),
            position_sigma_m: 2e-5,
            position_sigma_per_m: 0.0,
            orientation_sigma_rad: orientation.then_some(5e-5),
            temperature_sigma_k: None,
            distances: Vec::new(),
            view: None,
        }
    }

    /// Readings of `arm` with frame errors of `wrong` prior sigmas, in sessions of which each has its base.
    pub(super) fn readings(
        arm: &Arm,
        count: usize,
        sessions: usize,
        wrong: f64,
        noise: f64,
        stream: &mut Stream,
    ) -> Vec<Measurement> {
        let frames = FrameErrors::new(&arm.chain);
        let mut six = |size: f64| -> Vec<f64> { (0..6).map(|_| stream.uniform(-size, size)).collect() };
        let bases: Vec<Pose> = (0..sessions).map(|_| FrameErrors::pose(&six(2.0))).collect();
        let target = FrameErrors::pose(&six(0.1));
        let errors: Vec<f64> =
            (0..6 * frames.frames()).map(|at| wrong * Sizes::MANUFACTURING.sigma(&frames, at) * stream.normal()).collect();
        (0..count)
            .map(|index| {
                let joints: Vec<f64> = arm.chain.joints.iter().map(|of| stream.uniform(of.lower, of.upper)).collect();
                let pose = frames.at(&bases[index % sessions], &errors, &target).forward(&joints);
                let position = pose.translation.vector + Vector3::from_fn(|_, _| noise * stream.normal());
                let turn = rotation_from_vector(&Vector3::from_fn(|_, _| noise * stream.normal()));
                Measurement {
                    index,
                    pose_id: index,
                    joints,
                    position_m: position.into(),
                    orientation_xyzw: Some((turn * pose.rotation).coords.into()),
                    session: Some(format!("s{}", index % sessions)),
                    ..Measurement::default()
                }
            })
            .collect()
    }

    #[test]
    fn readings_of_an_arm_with_wrong_frames_are_predicted_at_poses_that_were_not_used() {
        let mut stream = stream(1, "test/geometry");
        for (sessions, orientation) in [(1, true), (1, false), (2, false)] {
            let arm = arm(6, &mut stream);
            let rows = readings(&arm, 160, sessions, 0.3, 1e-9, &mut stream);
            let (fitted, others): (Vec<&Measurement>, Vec<&Measurement>) = rows.iter().partition(|row| row.index < 120);
            let weights = vec![1.0; fitted.len()];
            let exact = sensor(orientation);
            let of = Readings::new(&exact, &fitted, &weights);
            let found = fit(&arm, of).unwrap();
            assert_eq!((found.stop, found.sessions.len()), (Stop::Converged, sessions));
            let worst =
                others.iter().map(|row| difference(row, &found.predict(row)).fixed_rows::<3>(0).norm()).fold(0.0, f64::max);
            // What the prior pulls is far below the noise that is declared.
            assert!(worst < 2e-6, "{worst}");
        }
    }

    #[test]
    fn known_effects_are_taken_out_in_root() {
        let mut stream = stream(2, "test/geometry");
        let arm = arm(5, &mut stream);
        let mut rows = readings(&arm, 60, 1, 0.1, 0.0, &mut stream);
        let (unmoved, weights, sensor) = (rows.clone(), vec![1.0; rows.len()], sensor(true));
        let read: Vec<&Measurement> = unmoved.iter().collect();
        let whole = Readings::new(&sensor, &read, &weights);
        let before = fit(&arm, whole).unwrap();
        let turn = before.measurement_from_root()[0].rotation;
        let displacement: Vec<[f64; 6]> = (0..60).map(|_| std::array::from_fn(|_| stream.uniform(-1e-3, 1e-3))).collect();
        for (row, [x, y, z, rx, ry, rz]) in rows.iter_mut().zip(&displacement) {
            row.position_m = (Vector3::from(row.position_m) + turn * Vector3::new(*x, *y, *z)).into();
            let orientation = rotation_from_vector(&(turn * Vector3::new(*rx, *ry, *rz))) * row.orientation().unwrap();
            row.orientation_xyzw = Some(orientation.coords.into());
        }
        let read: Vec<&Measurement> = rows.iter().collect();
        let after = fit(&arm, Readings { measurements: &read, displacement: &displacement, ..whole }).unwrap();
        assert!((after.residual - before.residual).amax() < 1e-8);
    }

    /// Few readings by a camera leave an arm that is nominal so, which priors of manufacturing do not; and errors of the size of
    /// those are found where the sensor sees them.
    #[test]
    fn an_arm_is_kept_as_near_to_nominal_as_the_readings_speak_for() {
        let mut stream = stream(4, "test/shrunk");
        let camera = Sensor { position_sigma_m: 1e-3, orientation_sigma_rad: Some(1e-3), ..sensor(true) };
        let (mut loose_m, mut shrunk_m, mut nominal_m) = (0.0, 0.0, 0.0);
        for _ in 0..6 {
            let arm = arm(6, &mut stream);
            let mut rows = readings(&arm, 60, 1, 0.0, 0.0, &mut stream);
            let others = rows.split_off(15);
            for row in &mut rows {
                row.position_m = (Vector3::from(row.position_m) + Vector3::from_fn(|_, _| 1e-3 * stream.normal())).into();
                let turn = rotation_from_vector(&Vector3::from_fn(|_, _| 1e-3 * stream.normal()));
                row.orientation_xyzw = row.orientation().map(|orientation| (turn * orientation).coords.into());
            }
            let fitted: Vec<&Measurement> = rows.iter().collect();
            let of = Readings::new(&camera, &fitted, &[1.0; 15]);
            let square = |found: &Geometry| -> f64 {
                others.iter().map(|row| difference(row, &found.predict(row)).fixed_rows::<3>(0).norm_squared()).sum()
            };
            loose_m += square(&fit(&arm, of).unwrap());
            let loose = fit(&arm, of).unwrap();
            shrunk_m += square(&loose.refit(&arm, of, loose.likeliest_sizes()).unwrap());
            nominal_m += square(&fit_at(&arm, of, Sizes::NOMINAL).unwrap());
        }
        assert!(shrunk_m < 1.1 * nominal_m && loose_m > 2.0 * nominal_m, "{loose_m} {shrunk_m} {nominal_m}");
        let arm = arm(6, &mut stream);
        let rows = readings(&arm, 80, 1, 0.3, 2e-5, &mut stream);
        let fitted: Vec<&Measurement> = rows.iter().collect();
        let exact = sensor(true);
        let of = Readings::new(&exact, &fitted, &[1.0; 80]);
        let sizes = fit(&arm, of).unwrap().likeliest_sizes();
        assert_eq!((sizes.lengths, sizes.turns), (0.3, 0.3), "{sizes:?}");
    }

    /// A quarter of the readings a quarter of a millimetre to a metre off: the arm is nearly as good as without them.
    #[test]
    fn bad_readings_do_not_spoil_a_fit() {
        let mut stream = stream(6, "test/outliers");
        let sensor = Sensor { position_sigma_m: 5e-5, ..sensor(false) };
        let (mut with, mut without) = (0.0, 0.0);
        for _ in 0..6 {
            let arm = arm(6, &mut stream);
            let mut rows = readings(&arm, 120, 1, 0.05, 0.0, &mut stream);
            let others = rows.split_off(60);
            for row in &mut rows {
                let size = if row.index % 4 == 1 { 2.5e-4 * libm::exp(stream.uniform(0.0, 8.3)) } else { 0.0 };
                let way = Vector3::from_fn(|_, _| stream.normal()).normalize();
                let noise = Vector3::from_fn(|_, _| 5e-5 * stream.normal());
                row.position_m = (Vector3::from(row.position_m) + noise + way * size).into();
            }
            let good: Vec<&Measurement> = rows.iter().filter(|row| row.index % 4 != 1).collect();
            let all: Vec<&Measurement> = rows.iter().collect();
            let square = |fitted: &[&Measurement]| -> f64 {
                let weights = vec![1.0; fitted.len()];
                let of = Readings::new(&sensor, fitted, &weights);
                let found = fit(&arm, of).unwrap();
                others.iter().map(|row| difference(row, &found.predict(row)).fixed_rows::<3>(0).norm_squared()).sum()
            };
            with += square(&all);
            without += square(&good);
        }
        assert!(with < 1.5 * without, "{} {}", libm::sqrt(with / 360.0), libm::sqrt(without / 360.0));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Whatever the arm, the readings (sound or not), what was read of them, the weights and the start.
        #[test]
        fn no_step_of_a_geometry_raises_the_cost(
            seed in 0u64..1_000_000, joints in 2usize..8, count in 8usize..24, wrong in 0.0..20.0f64, noise in 0.0..0.3f64,
            orientation: bool, sessions in 1usize..3, away in 0.0..1.5f64, scale in 0.003..3.0f64,
        ) {
            let mut stream = stream(seed, "test/geometry/descent");
            let arm = arm(joints, &mut stream);
            let mut rows = readings(&arm, count, sessions, wrong, noise, &mut stream);
            for row in &mut rows {
                row.unread[2] = stream.unit() < 0.3;
            }
            let read: Vec<&Measurement> = rows.iter().collect();
            let weights: Vec<f64> = (0..count).map(|_| stream.unit()).collect();
            let session: Vec<usize> = (0..count).map(|row| row % sessions).collect();
            let exact = sensor(orientation);
            let of = Readings::new(&exact, &read, &weights);
            let problem = Placing::new(&arm, of, &session, sessions, Sizes { zeros: scale, lengths: scale, turns: scale }).unwrap();
            let all: Vec<usize> = (0..problem.free.len()).collect();
            let start = problem.start(&arm).unwrap();
            let step = DVector::from_fn(all.len(), |_, _| away * stream.normal());
            let start = problem.moved(&start, &all, &step);
            let mut before = problem.linearise(&start).cost();
            for most in 1..16 {
                let cost = solve(&problem, &all, start.clone(), most).linearised.cost();
                prop_assert!(cost <= before * (1.0 + 1e-11), "{before} became {cost} in step {most}");
                before = cost;
            }
        }
    }
}
