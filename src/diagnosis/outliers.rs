//! Readings that are far off: the weights that they keep beside a model, the evidence that some have a larger noise than the others (a
//! mixture of two normal distributions, over a grid of shares and factors, against one), and which rows these are.

use super::settings;
use crate::solver::robust::{event, level};

/// Of a 95 % interval, the standard deviations to either side, and their square, both to three digits.
const Z95: f64 = 1.96;
const Z95_SQUARED: f64 = 3.84;

/// What there is of outliers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outliers {
    /// Probability that some readings have a larger noise.
    pub(crate) probability: f64,
    /// Share of the readings, with its 95 % interval.
    pub(crate) share: f64,
    /// 95 % interval of the share.
    pub share_ci95: [f64; 2],
    /// Their noise over that of the others.
    pub(crate) factor: f64,
    /// Rows that are outliers with the probability [`settings::Outliers::row`]; none where there are likely no outliers.
    pub(crate) rows: Vec<usize>,
}

/// The evidence for outliers among readings with these squared residuals, of so many equations each, in the order of measuring.
/// Neighbours that are far off together ([`event`]) are none, whatever they are.
#[must_use]
pub(crate) fn look(squares: &[f64], counts: &[usize], settings: &settings::Outliers) -> Outliers {
    let level = level(squares, counts);
    // Logarithms: a reading that is a metre off has a density of nothing.
    let log_density = |(square, count): (f64, usize), scale: f64| -0.5 * square / scale - 0.5 * count as f64 * libm::log(scale);
    let event = event(squares, counts);
    let rows: Vec<usize> = (0..squares.len()).filter(|row| !event[*row]).collect();
    let readings: Vec<(f64, usize)> = rows.iter().map(|row| (squares[*row], counts[*row])).collect();
    let steps = i32::from(settings.level_steps);
    let around = |level: f64| (-steps..=steps).map(move |step| level * libm::exp(settings.level_step * f64::from(step)));
    let scales: Vec<f64> = around(level).collect();
    let total = |share: f64, factor: f64| {
        // The level is not known well: averaged.
        let of_scale = |scale: &f64| {
            let mixed = |one: &(f64, usize)| {
                let near = libm::log(1.0 - share) + log_density(*one, *scale);
                let far = libm::log(share) + log_density(*one, scale * factor * factor);
                near.max(far) + libm::log1p(libm::exp(-(near - far).abs()))
            };
            readings.iter().map(mixed).sum::<f64>()
        };
        log_mean(&scales.iter().map(of_scale).collect::<Vec<_>>())
    };
    // Without outliers the level is that of all.
    let equations: usize = readings.iter().map(|(_, count)| count).sum();
    let mean = readings.iter().map(|(square, _)| square).sum::<f64>() / equations.max(1) as f64;
    let plain: Vec<f64> =
        around(mean.max(1e-12)).map(|scale| readings.iter().map(|one| log_density(*one, scale)).sum::<f64>()).collect();
    let plain = log_mean(&plain);
    let grid: Vec<(f64, f64, f64)> = settings
        .shares
        .iter()
        .flat_map(|share| settings.factors.iter().map(move |factor| (*share, *factor)))
        .map(|(share, factor)| (share, factor, total(share, factor)))
        .collect();
    let log_odds = log_mean(&grid.iter().map(|(_, _, log)| *log).collect::<Vec<_>>()) - plain + libm::log(settings.odds);
    let (share, factor, _) = grid.iter().copied().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or((0.0, 1.0, 0.0));
    let probability = 1.0 / (1.0 + libm::exp(-log_odds));
    let responsible = |one: (f64, usize)| {
        let near = libm::log(1.0 - share) + log_density(one, level);
        let far = libm::log(share) + log_density(one, level * factor * factor);
        1.0 / (1.0 + libm::exp(near - far))
    };
    let (n, expected) = (readings.len().max(1) as f64, readings.iter().map(|one| responsible(*one)).sum::<f64>());
    let found: Vec<usize> = if probability < settings.there {
        Vec::new()
    } else {
        rows.iter().zip(&readings).filter(|(_, one)| responsible(**one) > settings.row).map(|(row, _)| *row).collect()
    };
    // Some of them are hidden among the good ones; the count is binomial (Wilson's interval).
    let p = expected / n;
    let z2 = Z95_SQUARED;
    let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z95 / (1.0 + z2 / n) * libm::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
    Outliers { probability, share: p, share_ci95: [(middle - half).max(0.0), (middle + half).min(1.0)], factor, rows: found }
}

fn log_mean(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + libm::log(values.iter().map(|value| libm::exp(value - most)).sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::stream;

    /// Squares of `count` readings of three numbers each; every `every`-th has a noise that is `factor` times as large.
    fn squares(count: usize, every: usize, factor: f64) -> Vec<f64> {
        let mut draws = stream(2, "test/outliers");
        let sigma = |row: usize| if row % every == 3 { factor } else { 1.0 };
        (0..count).map(|row| (0..3).map(|_| (sigma(row) * draws.normal()).powi(2)).sum()).collect()
    }

    #[test]
    fn a_twentieth_of_wild_readings_is_found_and_counted() {
        let found = look(&squares(200, 20, 9.0), &[3; 200], &settings::Outliers::default());
        assert!(found.probability > 0.999 && (6.0..=14.0).contains(&found.factor), "{found:?}");
        assert!(found.share_ci95[0] < 0.05 && 0.05 < found.share_ci95[1], "{found:?}");
        // A wild reading may lie where good ones do; no good one is taken for wild.
        assert!(found.rows.iter().all(|row| row % 20 == 3) && found.rows.len() >= 8, "{found:?}");
    }

    /// However far off they are.
    #[test]
    fn readings_that_are_a_metre_off_are_found() {
        for factor in [100.0, 2e4] {
            let found = look(&squares(160, 20, factor), &[3; 160], &settings::Outliers::default());
            assert!(found.probability > 0.999, "{found:?}");
            assert_eq!(found.rows, (0..160).filter(|row| row % 20 == 3).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_block_of_neighbours_that_are_far_off_is_no_outlier() {
        let mut of = squares(200, 1000, 1.0);
        of[160..].iter_mut().for_each(|square| *square += 1e6);
        let found = look(&of, &[3; 200], &settings::Outliers::default());
        assert!(found.probability < 0.1 && found.rows.is_empty(), "{found:?}");
    }

    #[test]
    fn noise_that_is_larger_for_all_is_no_outlier() {
        for factor in [1.0, 30.0] {
            let squares: Vec<f64> = squares(200, 1000, 1.0).iter().map(|square| square * factor).collect();
            let found = look(&squares, &[3; 200], &settings::Outliers::default());
            assert!(found.probability < 0.1 && found.rows.is_empty(), "{found:?}");
        }
    }
}
