//! Readings that are far off: the weights that they keep beside a model, the evidence that some have a larger noise than the others (a
//! mixture of two normal distributions, over a grid of shares and factors, against one), and which rows these are.

use super::settings;
use crate::solver::robust::{alone, level};

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

/// The evidence for outliers among readings with these squared residuals, of so many equations each.
#[must_use]
pub(crate) fn look(squares: &[f64], counts: &[usize], settings: &settings::Outliers) -> Outliers {
    let level = level(squares, counts);
    let density =
        |(square, count): (f64, usize), scale: f64| libm::exp(-0.5 * square / scale) / libm::pow(scale, 0.5 * count as f64);
    let readings: Vec<(f64, usize)> = squares.iter().copied().zip(counts.iter().copied()).collect();
    let steps = i32::from(settings.level_steps);
    let around = |level: f64| (-steps..=steps).map(move |step| level * libm::exp(settings.level_step * f64::from(step)));
    let scales: Vec<f64> = around(level).collect();
    let total = |share: f64, factor: f64| {
        // The level is not known well: averaged.
        let of_scale = |scale: &f64| {
            readings
                .iter()
                .map(|one| {
                    libm::log((1.0 - share) * density(*one, *scale) + share * density(*one, scale * factor * factor) + 1e-300)
                })
                .sum::<f64>()
        };
        log_mean(&scales.iter().map(of_scale).collect::<Vec<_>>())
    };
    // Without outliers the level is that of all.
    let mean = squares.iter().sum::<f64>() / counts.iter().sum::<usize>() as f64;
    let plain: Vec<f64> = around(mean.max(1e-12))
        .map(|scale| readings.iter().map(|one| libm::log(density(*one, scale) + 1e-300)).sum::<f64>())
        .collect();
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
        let (far, near) = (share * density(one, level * factor * factor), (1.0 - share) * density(one, level));
        if far + near > 0.0 { far / (far + near) } else { 1.0 }
    };
    let rows: Vec<usize> = if probability < settings.there {
        Vec::new()
    } else {
        (0..squares.len()).filter(|row| responsible(readings[*row]) > settings.row).collect()
    };
    let (n, expected) = (squares.len() as f64, readings.iter().map(|one| responsible(*one)).sum::<f64>());
    // Some of them are hidden among the good ones; the count is binomial (Wilson's interval).
    let p = expected / n;
    let z2 = Z95_SQUARED;
    let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z95 / (1.0 + z2 / n) * libm::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
    Outliers { probability, share: p, share_ci95: [(middle - half).max(0.0), (middle + half).min(1.0)], factor, rows }
}

fn log_mean(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + libm::log(values.iter().map(|value| libm::exp(value - most)).sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::distribution::chi_squared_tail;
    use crate::seed::stream;

    /// Both tables against the distribution itself.
    #[test]
    fn one_square_in_a_thousand_is_rare_and_half_of_them_are_below_the_median() {
        for equations in 1..=6 {
            let tail = |value: f64| chi_squared_tail(value, equations as f64);
            assert!((tail(rare(equations)) - 1e-3).abs() < 1e-5, "{equations}: {}", tail(rare(equations)));
            assert!((tail(median(equations)) - 0.5).abs() < 2e-4, "{equations}: {}", tail(median(equations)));
        }
    }

    /// However large the noise is that all share, a reading twice as far off as is rare counts a sixteenth: its square is four times too
    /// large.
    #[test]
    fn weights_do_not_hang_on_the_unit_of_the_noise() {
        for unit in [1e-3, 1.0, 50.0] {
            let mut squares = vec![median(3) * unit; 20];
            squares.extend([4.0 * rare(3) * unit, rare(3) * unit]);
            let found = weights(&squares, &[3; 22]);
            assert!(found[..20].iter().all(|weight| *weight == 1.0));
            assert!((found[20] - 1.0 / 16.0).abs() < 1e-12 && (found[21] - 1.0).abs() < 1e-9, "{found:?}");
        }
    }

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

    #[test]
    fn noise_that_is_larger_for_all_is_no_outlier() {
        for factor in [1.0, 30.0] {
            let squares: Vec<f64> = squares(200, 1000, 1.0).iter().map(|square| square * factor).collect();
            let found = look(&squares, &[3; 200], &settings::Outliers::default());
            assert!(found.probability < 0.1 && found.rows.is_empty(), "{found:?}");
        }
    }
}
