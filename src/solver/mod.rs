//! One least squares for everything that is fitted: Gauss–Newton, damped after Levenberg and Marquardt where a step fails, with a
//! Gaussian prior on the parameters where there is one (by normal equations), else by QR.
//!
//! Where a step along a valley fails because the valley bends, it is corrected to second order by what it was seen to miss (Transtrum and
//! Sethna 2012, geodesic acceleration, taken from the failed step itself).
//!
//! What is minimised is the sum of squares of a problem's weighted residuals and of the departures of its parameters from where the
//! prior has them, both in sigmas. A step that raises it is never taken.

pub mod robust;
pub mod whitening;

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::numerics::gram;

/// The fit has converged when an undamped step changes all predictions together by less than this many sigmas (of the noise, or of the
/// residuals where these are larger).
pub(crate) const STEP_TOLERANCE: f64 = 1e-6;
/// Relative change of the cost that counts as rounding.
const ROUNDING: f64 = 1e-12;
/// Damping from which on no step is worth trying.
const HOPELESS: f64 = 1e12;

/// What is to be fitted.
pub trait Problem {
    /// A choice of all that is fitted.
    type Point: Clone;

    /// Residuals and their derivatives at a point.
    fn linearise(&self, at: &Self::Point) -> Linearised;

    /// `from` with the parameters number `columns` changed by `step`, in the units of the Jacobian's columns.
    fn moved(&self, from: &Self::Point, columns: &[usize], step: &DVector<f64>) -> Self::Point;

    /// Length of a weighted residual that is off by one sigma of the declared noise: what counts as nothing.
    fn one_sigma(&self) -> f64;

    /// The fit has converged when an undamped step changes all predictions together by less than this many sigmas.
    fn tolerance(&self) -> f64 {
        STEP_TOLERANCE
    }
}

/// A problem about one point.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// Weighted residuals, measured minus predicted.
    pub residuals: DVector<f64>,
    /// Weighted change of the predictions per unit of each parameter (all of them): equations × parameters.
    pub jacobian: DMatrix<f64>,
    /// Where there is a prior: by how many of its sigmas each parameter departs from it. The unit of each column is then that sigma. A
    /// parameter that is free departs by nothing wherever it is: its prior goes where the fit goes, and keeps steps within what data
    /// tell nothing about from growing.
    pub departures: Option<DVector<f64>>,
}

impl Linearised {
    /// Sum of squares that is minimised.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.residuals.norm_squared() + self.departures.as_ref().map_or(0.0, DVector::norm_squared)
    }
}

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The last undamped step changed next to nothing.
    Converged,
    /// The equations became singular.
    Singular,
    /// However small, every step makes the residuals larger.
    NoDescent,
    /// So many steps were not enough.
    StepLimit(usize),
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stop::Converged => {
                f.write_str("the last step changed the predictions by less than a millionth of a standard deviation")
            }
            Stop::Singular => f.write_str("the equations became singular"),
            Stop::NoDescent => f.write_str("no step makes the residuals smaller"),
            Stop::StepLimit(steps) => write!(f, "not settled after {steps} steps"),
        }
    }
}

/// Where a fit ended.
#[derive(Clone, Debug)]
pub struct Fit<P> {
    /// The best point.
    pub point: P,
    /// The problem about it.
    pub linearised: Linearised,
    /// Why no further.
    pub stop: Stop,
    /// Steps tried.
    pub steps: usize,
}

impl<P> Fit<P> {
    /// Whether it converged.
    #[must_use]
    pub fn converged(&self) -> bool {
        self.stop == Stop::Converged
    }
}

/// Fits the parameters number `columns` of `problem` from `start` on, all others held, with at most `most` steps. The cost of what is
/// returned is at most that of the start (but for rounding).
pub fn solve<P: Problem>(problem: &P, columns: &[usize], start: P::Point, most: usize) -> Fit<P::Point> {
    let here = problem.linearise(&start);
    solve_from(problem, columns, start, here, most)
}

/// As [`solve`], for a start about which the problem is known already.
pub fn solve_from<P: Problem>(problem: &P, columns: &[usize], start: P::Point, here: Linearised, most: usize) -> Fit<P::Point> {
    let (mut point, mut here) = (start, here);
    let mut cost = here.cost();
    // Damping and the factor by which it grows after a failure, after Nielsen 1999.
    let (mut damping, mut growth): (f64, f64) = (0.0, 2.0);
    for step_number in 1..=most {
        let every = columns.len() == here.jacobian.ncols();
        let jacobian = if every { Cow::Borrowed(&here.jacobian) } else { Cow::Owned(here.jacobian.select_columns(columns)) };
        let jacobian = jacobian.as_ref();
        let departures = here.departures.as_ref().map(|departures| departures.select_rows(columns));
        let Some(step) = step(jacobian, &here.residuals, departures.as_ref(), damping) else {
            return Fit { point, linearised: here, stop: Stop::Singular, steps: step_number };
        };
        let change = (jacobian * &step).norm();
        let mut trial = problem.moved(&point, columns, &step);
        let mut there = problem.linearise(&trial);
        if there.cost() > cost {
            // A valley that bends: what the step missed by bending, taken back.
            let bent = &there.residuals - &here.residuals + jacobian * &step;
            let none = departures.as_ref().map(|departures| DVector::zeros(departures.len()));
            let back = self::step(jacobian, &bent, none.as_ref(), damping).filter(|back| back.norm() <= step.norm());
            if let Some(back) = back {
                let corrected = problem.moved(&point, columns, &(&step + back));
                let problem_there = problem.linearise(&corrected);
                if problem_there.cost() < there.cost() {
                    (trial, there) = (corrected, problem_there);
                }
            }
        }
        let trial_cost = there.cost();
        let sigma = (cost / here.residuals.len() as f64).sqrt().max(problem.one_sigma());
        let settled = change <= problem.tolerance() * sigma;
        let undamped = damping == 0.0;
        let rounding = cost * ROUNDING;
        if trial_cost.is_finite() && trial_cost <= cost + rounding {
            // Gain over what the linear model, with its prior and damping, promises.
            let of_prior = if departures.is_some() { step.norm_squared() } else { 0.0 };
            let promised = change * change + of_prior + 2.0 * damping * scaled_square(jacobian, &step);
            let gain = if promised > 0.0 { (cost - trial_cost) / promised } else { 1.0 };
            damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 2.0);
            growth = 2.0;
            if damping < 1e-9 || settled {
                damping = 0.0;
            }
            (point, here, cost) = (trial, there, trial_cost);
            if settled && undamped {
                return Fit { point, linearised: here, stop: Stop::Converged, steps: step_number };
            }
        } else if settled && undamped {
            // Rounding makes the cost of so small a step: where it was is as good.
            return Fit { point, linearised: here, stop: Stop::Converged, steps: step_number };
        } else {
            damping = if damping == 0.0 { 1e-4 } else { damping * growth };
            growth *= 2.0;
            if damping > HOPELESS {
                return Fit { point, linearised: here, stop: Stop::NoDescent, steps: step_number };
            }
        }
    }
    Fit { point, linearised: here, stop: Stop::StepLimit(most), steps: most }
}

/// Square of the step's length in units in which every column of the Jacobian has length one.
fn scaled_square(jacobian: &DMatrix<f64>, step: &DVector<f64>) -> f64 {
    jacobian.column_iter().zip(step.iter()).map(|(column, value)| column.norm_squared() * value * value).sum()
}

/// The step that minimises the linearised residuals (and departures), damped after Levenberg and Marquardt. `None` where the equations do
/// not tell.
fn step(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    departures: Option<&DVector<f64>>,
    damping: f64,
) -> Option<DVector<f64>> {
    match departures {
        Some(departures) => step_with_prior(jacobian, residuals, departures, damping),
        None => step_alone(jacobian, residuals, damping),
    }
}

/// Normal equations: with a prior they are never singular, their rounding is far below what a step needs (the next one starts from
/// the true residuals), and they cost a fraction of a QR.
fn step_with_prior(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    departures: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let mut normal = gram(jacobian);
    let right = jacobian.tr_mul(residuals) - departures;
    (0..normal.nrows()).for_each(|at| normal[(at, at)] = (normal[(at, at)] + 1.0) * (1.0 + damping));
    // Columns of like length: the smallest parameter keeps its digits.
    let scale: Vec<f64> = (0..normal.nrows()).map(|at| 1.0 / normal[(at, at)].sqrt()).collect();
    for (column, of_column) in scale.iter().enumerate() {
        for (row, of_row) in scale.iter().enumerate() {
            normal[(row, column)] *= of_row * of_column;
        }
    }
    let scaled = DVector::from_fn(right.len(), |at, _| right[at] * scale[at]);
    let solved = normal.cholesky()?.solve(&scaled);
    let step = DVector::from_fn(solved.len(), |at, _| solved[at] * scale[at]);
    step.iter().all(|value| value.is_finite()).then_some(step)
}

/// By QR of the column-scaled Jacobian.
fn step_alone(jacobian: &DMatrix<f64>, residuals: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let (rows, columns) = jacobian.shape();
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
    let extra = if damping > 0.0 { columns } else { 0 };
    let mut matrix = DMatrix::zeros(rows + extra, columns);
    let mut right = DVector::zeros(rows + extra);
    right.rows_mut(0, rows).copy_from(residuals);
    for (column, norm) in norms.iter().enumerate() {
        if !norm.is_finite() || *norm == 0.0 {
            return None;
        }
        matrix.view_mut((0, column), (rows, 1)).copy_from(&(jacobian.column(column) / *norm));
        if damping > 0.0 {
            matrix[(rows + column, column)] = damping.sqrt();
        }
    }
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `residuals = right − matrix · (x + bend · x²)`, with the departures of a prior about zero.
    #[derive(Debug)]
    struct Bent {
        matrix: DMatrix<f64>,
        right: DVector<f64>,
        bend: f64,
        prior: bool,
    }

    impl Problem for Bent {
        type Point = DVector<f64>;

        fn linearise(&self, at: &DVector<f64>) -> Linearised {
            let bent = at.map(|value| value + self.bend * value * value);
            let mut jacobian = self.matrix.clone();
            for (mut column, value) in jacobian.column_iter_mut().zip(at.iter()) {
                column *= 1.0 + 2.0 * self.bend * value;
            }
            Linearised { residuals: &self.right - &self.matrix * bent, jacobian, departures: self.prior.then(|| at.clone()) }
        }

        fn moved(&self, from: &DVector<f64>, columns: &[usize], step: &DVector<f64>) -> DVector<f64> {
            let mut to = from.clone();
            columns.iter().zip(step.iter()).for_each(|(column, change)| to[*column] += change);
            to
        }

        fn one_sigma(&self) -> f64 {
            1.0
        }
    }

    #[test]
    fn a_linear_problem_is_solved_at_once_with_its_prior() {
        let matrix = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 1.0, 0.0, 2.0]);
        let right = DVector::from_row_slice(&[1.0, 3.0, 2.0]);
        for prior in [false, true] {
            let problem = Bent { matrix: matrix.clone(), right: right.clone(), bend: 0.0, prior };
            let fit = solve(&problem, &[0, 1], DVector::zeros(2), 20);
            let precision = DMatrix::identity(2, 2) * f64::from(u8::from(prior));
            let normal = matrix.transpose() * &matrix + precision;
            let expected = normal.try_inverse().unwrap() * matrix.transpose() * &right;
            assert!(fit.converged() && fit.steps == 2, "{:?}", fit.stop);
            assert!((fit.point - expected).norm() < 1e-12);
        }
        // What is not asked for stays.
        let fit = solve(&Bent { matrix, right, bend: 0.0, prior: false }, &[1], DVector::from_row_slice(&[0.5, 0.0]), 20);
        assert_eq!((fit.point[0], fit.converged()), (0.5, true));
    }

    #[test]
    fn why_a_fit_ends_is_said() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 1.0, 0.0]);
        let problem = |prior| Bent { matrix: matrix.clone(), right: DVector::from_row_slice(&[1.0, 1.0]), bend: 0.0, prior };
        assert_eq!(solve(&problem(false), &[0, 1], DVector::zeros(2), 20).stop, Stop::Singular);
        // A prior tells what no equation does.
        let fit = solve(&problem(true), &[0, 1], DVector::zeros(2), 20);
        assert!(fit.converged() && fit.point[1].abs() < 1e-15);
        let bent = Bent { matrix: DMatrix::identity(2, 2), right: DVector::from_row_slice(&[5.0, 7.0]), bend: 0.1, prior: false };
        let fit = solve(&bent, &[0, 1], DVector::zeros(2), 1);
        assert_eq!((fit.stop, fit.stop.to_string().as_str()), (Stop::StepLimit(1), "not settled after 1 steps"));
    }

    /// Rosenbrock's valley, a thousand times as steep as it is long.
    struct Valley;

    impl Problem for Valley {
        type Point = [f64; 2];

        fn linearise(&self, at: &[f64; 2]) -> Linearised {
            let [x, y] = *at;
            Linearised {
                residuals: DVector::from_row_slice(&[-1e3 * (y - x * x), 1.0 - x]),
                jacobian: DMatrix::from_row_slice(2, 2, &[-2e3 * x, 1e3, 1.0, 0.0]),
                departures: None,
            }
        }

        fn moved(&self, from: &[f64; 2], _: &[usize], step: &DVector<f64>) -> [f64; 2] {
            [from[0] + step[0], from[1] + step[1]]
        }

        fn one_sigma(&self) -> f64 {
            1.0
        }
    }

    #[test]
    fn a_valley_that_bends_is_followed() {
        let fit = solve(&Valley, &[0, 1], [-1.0, 1.0], 60);
        assert!(fit.converged() && fit.steps < 10, "{} steps", fit.steps);
        assert!((fit.point[0] - 1.0).abs() < 1e-6 && (fit.point[1] - 1.0).abs() < 1e-6, "{:?}", fit.point);
    }

    proptest! {
        #[test]
        fn no_step_raises_the_cost(
            numbers in prop::collection::vec(-3.0..3.0f64, 40), columns in 1usize..5, bend in -2.0..2.0f64, prior: bool,
        ) {
            let matrix = DMatrix::from_fn(6, columns, |row, column| numbers[row * columns + column]);
            let problem = Bent { matrix, right: DVector::from_fn(6, |row, _| numbers[30 + row]), bend, prior };
            let start = DVector::from_fn(columns, |at, _| 3.0 * numbers[36 + at]);
            let all: Vec<usize> = (0..columns).collect();
            let mut before = problem.linearise(&start).cost();
            for most in 1..30 {
                let cost = solve(&problem, &all, start.clone(), most).linearised.cost();
                prop_assert!(cost <= before * (1.0 + 1e-11), "{before} became {cost} in step {most}");
                before = cost;
            }
        }
    }
}
