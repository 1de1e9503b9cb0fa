//! How much each reading tells beside a model: less where it is far off, and where others tell the same.

use std::ops::Range;

use nalgebra::DVector;

use super::groups::{self, Groups, Repeats};
use super::rows::Rows;
use super::settings::Noise;
use crate::measurement::Sensor;
use crate::solver::robust;

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
pub(super) fn weigh(rows: &Rows, residual: &DVector<f64>, before: &[f64], groups: &Groups, settings: &Noise) -> Weighed {
    // In declared sigmas, whatever a row's weight.
    let whitened = rows.whitening.of_vector(residual);
    let equations = &rows.equations;
    let of_row = |row: usize| whitened.as_slice()[equations.of(row)].iter().map(move |value| value / libm::sqrt(before[row]));
    let sigmas: Vec<f64> = (0..before.len()).flat_map(of_row).collect();
    let squares: Vec<f64> =
        (0..before.len()).map(|row| sigmas[equations.of(row)].iter().map(|value| value * value).sum::<f64>()).collect();
    let far = robust::weights(&squares, &equations.counts(), robust::Events::Counted);
    let near: Vec<bool> = far.iter().map(|weight| *weight > settings.near).collect();
    let (dependent, correlation) = groups::weights(groups, &sigmas, equations, &near, settings);
    Weighed { squares, far, dependent, correlation }
}

/// The noise of orientations beside that of positions, over what is said of both; one where the difference is chance or next to nothing. None
/// where there are not enough repeats.
pub(super) fn orientation_of_repeats(
    sensor: &Sensor,
    repeats: Option<Repeats>,
    position_m: f64,
    settings: &Noise,
) -> Option<f64> {
    let repeats = repeats.filter(|repeats| repeats.degrees_of_freedom >= settings.orientation_degrees)?;
    let (found, said) = (repeats.orientation_rad? / repeats.position_m, sensor.orientation_sigma_rad? / position_m);
    let log = libm::log(found / said);
    let differs =
        log.abs() > settings.log_sigma_matters + settings.standard_errors * libm::sqrt(1.0 / repeats.degrees_of_freedom);
    (found > 0.0 && said > 0.0).then(|| if differs { libm::exp(log) } else { 1.0 })
}

/// How much larger than that of the positions what is left of the orientations is, both in the sensor's sigmas, where that is neither chance
/// nor next to nothing: one of them is not what it is said to be (estimation of variance components, Helmert 1907, here by medians). None
/// where so much is left that it is not noise. `known`: that it is not as said is known already, and by how much is asked.
pub(super) fn orientation_over_position(rows: &Rows, residual: &DVector<f64>, known: bool, settings: &Noise) -> Option<f64> {
    let equations = &rows.equations;
    if !equations.has_orientation() {
        return None;
    }
    let whitened = rows.whitening.of_vector(residual);
    let counts: Vec<usize> = (0..rows.postures.len()).filter(|row| rows.whitening.weights()[*row] > settings.counted).collect();
    let level = |part: &dyn Fn(usize) -> Range<usize>| {
        let square = |row: &usize| {
            let part = part(*row);
            let usual = robust::median(part.len()) * rows.whitening.weights()[*row];
            whitened.rows_range(part).norm_squared() / usual
        };
        let mut squares: Vec<f64> = counts.iter().map(square).collect();
        squares.sort_by(f64::total_cmp);
        squares.get(squares.len() / 2).copied().unwrap_or(0.0)
    };
    let position = level(&|row| equations.of_position(row));
    let orientation = level(&|row| equations.of_position(row).end..equations.of(row).end);
    if position <= 0.0 || orientation <= 0.0 || position.min(orientation) > settings.no_noise {
        return None;
    }
    let log = 0.5 * libm::log(orientation / position);
    // A median of squares of three equations tells sigma as well as three fifths of the readings would; rows that count less, less.
    let readings: f64 = counts.iter().map(|row| rows.whitening.weights()[*row]).sum();
    let deviation = if known { 0.0 } else { libm::sqrt(2.0 / (6.0 * 0.6 * readings)) };
    (log.abs() > settings.log_sigma_matters + settings.standard_errors * deviation).then(|| libm::exp(log))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::{SIGMA, sensor, with_analysis};
    use crate::seed::stream;

    /// Squares are those of residuals over the declared sigma, whatever weights were in the whitening.
    #[test]
    fn a_row_that_counts_less_is_no_nearer() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let (rows, count) = (analysis.linear.rows, analysis.measurements.len());
                let groups = groups::groups(analysis.measurements, &Noise::default());
                let mut draws = stream(1, "test/weights");
                let mut residual = DVector::from_fn(3 * count, |_, _| SIGMA * draws.normal());
                residual.rows_mut(3 * 7, 3).fill(100.0 * SIGMA);
                let found = weigh(rows, &residual, &vec![1.0; count], &groups, &Noise::default());
                for (row, square) in found.squares.iter().enumerate() {
                    let expected = residual.rows(3 * row, 3).norm_squared() / (SIGMA * SIGMA);
                    assert!((square / expected - 1.0).abs() < 1e-9, "{row}: {square} against {expected}");
                }
                // One reading a hundred sigmas off weighs next to nothing; each is alone in its configuration.
                assert!(found.far[7] < 1e-4 && found.far.iter().filter(|weight| **weight == 1.0).count() > 55);
                assert!(found.dependent.iter().all(|weight| *weight == 1.0) && found.correlation == 0.0);
            },
        );
    }

    #[test]
    fn repeats_tell_the_orientations_beyond_chance_only() {
        let said = Sensor { orientation_sigma_rad: Some(1e-4), ..sensor() };
        let of = |orientation_rad: Option<f64>, degrees_of_freedom: f64| {
            let repeats = Repeats { position_m: 2.0 * SIGMA, orientation_rad, degrees_of_freedom, moved: true };
            orientation_of_repeats(&said, Some(repeats), SIGMA, &Noise::default())
        };
        // Positions are twice as noisy as is said; orientations that are four times so are twice as noisy beside them.
        assert!((of(Some(4e-4), 900.0).unwrap() - 2.0).abs() < 1e-12);
        // A ratio of 1.15 is nothing beside a tenth and three standard errors of a thirtieth.
        assert_eq!(of(Some(2.3e-4), 900.0), Some(1.0));
        assert_eq!(of(Some(4e-4), 30.0), None);
        assert_eq!(of(None, 900.0), None);
    }
}
