//! Readings that are far off: their weights, and the evidence that there are any.

use super::settings;
use crate::solver::robust::{alone, level};

/// What there is of outliers.
#[derive(Clone, Debug, PartialEq)]
pub struct Outliers {
    /// Probability that some readings have a larger noise.
    pub probability: f64,
    /// Share of the readings, with its 95 % interval.
    pub share: f64,
    /// 95 % interval of the share.
    pub share_ci95: [f64; 2],
    /// Their noise over that of the others.
    pub factor: f64,
    /// Rows that are more likely outliers than not by a hundred to one.
    pub rows: Vec<usize>,
}

/// The evidence for outliers among readings with these squared residuals, of so many equations each.
#[must_use]
pub fn look(squares: &[f64], counts: &[usize], settings: &settings::Outliers) -> Outliers {
    let level = level(squares, counts);
    let density =
        |(square, count): (f64, usize), scale: f64| libm::exp(-0.5 * square / scale) / libm::pow(scale, 0.5 * count as f64);
    let readings: Vec<(f64, usize)> = squares.iter().copied().zip(counts.iter().copied()).collect();
    let scales: Vec<f64> = (-6..=6).map(|step| level * libm::exp(0.08 * f64::from(step))).collect();
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
    let plain: Vec<f64> = (-6..=6)
        .map(|step| {
            let scale = mean.max(1e-12) * libm::exp(0.08 * f64::from(step));
            readings.iter().map(|one| libm::log(density(*one, scale) + 1e-300)).sum::<f64>()
        })
        .collect();
    let plain = log_mean(&plain);
    let (shares, factors) = ([0.02, 0.03, 0.05, 0.08, 0.12, 0.18], [4.0, 6.0, 9.0, 14.0, 20.0]);
    let grid: Vec<(f64, f64, f64)> = shares
        .iter()
        .flat_map(|share| factors.iter().map(move |factor| (*share, *factor)))
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
    let z2 = 3.84;
    let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = 1.96 / (1.0 + z2 / n) * libm::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
    Outliers { probability, share: p, share_ci95: [(middle - half).max(0.0), (middle + half).min(1.0)], factor, rows }
}

fn log_mean(values: &[f64]) -> f64 {
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + libm::log(values.iter().map(|value| libm::exp(value - most)).sum::<f64>() / values.len() as f64)
}
