//! Readings that are far off: their weights, and the evidence that there are any.

/// Squares (in sigmas) beyond which one reading in a thousand lies where the noise is Gaussian, for 3 and 6 equations a row.
pub(super) const RARE: [f64; 2] = [16.27, 22.46];
/// Medians of the same squares.
pub(super) const MEDIAN: [f64; 2] = [2.366, 5.348];

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

fn which(per_row: usize) -> usize {
    usize::from(per_row == 6)
}

/// The typical square of a good reading, over one sigma's.
fn level(squares: &[f64], per_row: usize) -> f64 {
    let mut sorted = squares.to_vec();
    sorted.sort_by(f64::total_cmp);
    (sorted[sorted.len() / 2] / MEDIAN[which(per_row)]).max(1e-12)
}

/// Weights of readings with these squared residuals (Huber's, on the squares): one for all but rare ones.
#[must_use]
pub fn weights(squares: &[f64], per_row: usize) -> Vec<f64> {
    let limit = RARE[which(per_row)] * level(squares, per_row);
    // Twice as far off counts a quarter, then less and less: an outlier tells nothing.
    squares.iter().map(|square| if *square <= limit { 1.0 } else { (limit / square) * (limit / square) }).collect()
}

/// The evidence for outliers among readings with these squared residuals.
#[must_use]
pub fn look(squares: &[f64], per_row: usize) -> Outliers {
    let count = per_row as f64;
    let level = level(squares, per_row);
    let density = |square: f64, scale: f64| libm::exp(-0.5 * square / scale) / libm::pow(scale, 0.5 * count);
    let scales: Vec<f64> = (-6..=6).map(|step| level * libm::exp(0.08 * f64::from(step))).collect();
    let total = |share: f64, factor: f64| {
        // The level is not known well: averaged.
        let of_scale = |scale: &f64| {
            squares
                .iter()
                .map(|square| {
                    libm::log(
                        (1.0 - share) * density(*square, *scale) + share * density(*square, scale * factor * factor) + 1e-300,
                    )
                })
                .sum::<f64>()
        };
        log_mean(&scales.iter().map(of_scale).collect::<Vec<_>>())
    };
    // Without outliers the level is that of all.
    let mean = squares.iter().sum::<f64>() / (count * squares.len() as f64);
    let plain: Vec<f64> = (-6..=6)
        .map(|step| {
            let scale = mean.max(1e-12) * libm::exp(0.08 * f64::from(step));
            squares.iter().map(|square| libm::log(density(*square, scale) + 1e-300)).sum::<f64>()
        })
        .collect();
    let plain = log_mean(&plain);
    let (shares, factors) = ([0.02, 0.03, 0.05, 0.08, 0.12, 0.18], [4.0, 6.0, 9.0, 14.0, 20.0]);
    let grid: Vec<(f64, f64, f64)> = shares
        .iter()
        .flat_map(|share| factors.iter().map(move |factor| (*share, *factor)))
        .map(|(share, factor)| (share, factor, total(share, factor)))
        .collect();
    let log_odds = log_mean(&grid.iter().map(|(_, _, log)| *log).collect::<Vec<_>>()) - plain + libm::log(0.04);
    let (share, factor, _) = grid.iter().copied().max_by(|a, b| a.2.total_cmp(&b.2)).unwrap_or((0.0, 1.0, 0.0));
    let probability = 1.0 / (1.0 + libm::exp(-log_odds));
    let responsible = |square: f64| {
        let (far, near) = (share * density(square, level * factor * factor), (1.0 - share) * density(square, level));
        if far + near > 0.0 { far / (far + near) } else { 1.0 }
    };
    let rows: Vec<usize> =
        if probability < 0.5 { Vec::new() } else { (0..squares.len()).filter(|row| responsible(squares[*row]) > 0.99).collect() };
    let (n, expected) = (squares.len() as f64, squares.iter().map(|square| responsible(*square)).sum::<f64>());
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
