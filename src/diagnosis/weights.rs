//! How much each reading tells beside a model: less where it is far off, and where others tell the same.

use nalgebra::DVector;

use super::groups::{self, Groups};
use super::outliers;
use super::rows::Rows;

/// Weights of readings, and what they come from.
pub(super) struct Weighed {
    /// Of each row, the square of its residual in declared sigmas.
    pub(super) squares: Vec<f64>,
    /// Weight for being far off.
    pub(super) far: Vec<f64>,
    /// Weight for being like others of the same configuration.
    pub(super) dependent: Vec<f64>,
    /// How alike those are.
    pub(super) correlation: f64,
}

/// Weighs the rows by what a model leaves of them (`residual`, m and rad). `before`: the weights that are in `rows.whitening`.
pub(super) fn weigh(rows: &Rows, residual: &DVector<f64>, before: &[f64], groups: &Groups) -> Weighed {
    // In declared sigmas, whatever a row's weight.
    let whitened = rows.whitening.of_vector(residual);
    let sigmas: Vec<f64> =
        whitened.iter().enumerate().map(|(equation, value)| value / libm::sqrt(before[equation / rows.per_row])).collect();
    let squares: Vec<f64> = sigmas.chunks(rows.per_row).map(|row| row.iter().map(|value| value * value).sum::<f64>()).collect();
    let far = outliers::weights(&squares, rows.per_row);
    let near: Vec<bool> = far.iter().map(|weight| *weight > 0.5).collect();
    let (dependent, correlation) = groups::weights(groups, &sigmas, rows.per_row, &near);
    Weighed { squares, far, dependent, correlation }
}
