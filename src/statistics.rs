//! What many trials say: means and shares with their intervals, medians, root mean squares, and rank correlations. One definition each.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::statistics::Statistics;

use crate::numerics::distribution::student_quantile;

/// A mean over trials.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Mean {
    /// Mean.
    pub mean: f64,
    /// 95 % confidence interval of the mean (Student); absent for a single trial.
    pub interval95: Option<[f64; 2]>,
    /// Trials.
    pub trials: usize,
}

impl Mean {
    /// `None` where there are no values.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Mean> {
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().mean();
        Some(Mean { mean, interval95: around(mean, values.iter().std_dev(), values.len()), trials: values.len() })
    }

    /// The same in another unit.
    #[must_use]
    pub fn times(self, factor: f64) -> Mean {
        let interval95 = self
            .interval95
            .map(|[low, high]| if factor < 0.0 { [factor * high, factor * low] } else { [factor * low, factor * high] });
        Mean { mean: factor * self.mean, interval95, ..self }
    }

    /// Of correlations: Fisher's z has Student's interval, so that none goes beyond ±1. `None` where there are no values.
    #[must_use]
    pub fn of_correlations(values: &[f64]) -> Option<Mean> {
        // A perfect correlation has no finite z.
        let z: Vec<f64> = values.iter().map(|value| libm::atanh(value.clamp(-1.0 + 1e-12, 1.0 - 1e-12))).collect();
        let mean = Mean::of(&z)?;
        Some(Mean { mean: libm::tanh(mean.mean), interval95: mean.interval95.map(|ends| ends.map(libm::tanh)), ..mean })
    }

    /// By which share `better` is smaller than `worse` on average, trial by trial the same true arm, verification and noise: one
    /// minus the ratio of the means, with its 95 % interval (delta method on the paired trials). `None` where there are no trials
    /// or the means are zero.
    ///
    /// # Panics
    /// If the trials are not paired.
    #[must_use]
    pub fn gain(better: &[f64], worse: &[f64]) -> Option<Mean> {
        assert_eq!(better.len(), worse.len(), "trials are compared in pairs");
        let base = Mean::of(worse).filter(|base| base.mean != 0.0)?.mean;
        let ratio = better.iter().mean() / base;
        let rest: Vec<f64> = better.iter().zip(worse).map(|(better, worse)| (better - ratio * worse) / base).collect();
        Some(Mean { mean: 1.0 - ratio, interval95: around(1.0 - ratio, rest.iter().std_dev(), rest.len()), trials: rest.len() })
    }
}

/// Mean and scatter of values that come one after the other and are not kept (Welford 1962).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Running {
    count: usize,
    mean: f64,
    squares: f64,
}

impl Running {
    /// Takes the next value.
    pub fn push(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    /// Values taken.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Standard deviation; zero of a single value.
    #[must_use]
    pub fn deviation(&self) -> f64 {
        if self.count > 1 { (self.squares / (self.count - 1) as f64).sqrt() } else { 0.0 }
    }

    /// Their mean with its interval; `None` where there are none.
    #[must_use]
    pub fn mean(&self) -> Option<Mean> {
        let interval95 = around(self.mean, self.deviation(), self.count);
        (self.count > 0).then_some(Mean { mean: self.mean, interval95, trials: self.count })
    }
}

/// Student's interval about `mean` of `count` values with standard deviation `deviation`.
fn around(mean: f64, deviation: f64, count: usize) -> Option<[f64; 2]> {
    let half = student_quantile(0.975, count as f64 - 1.0)? * deviation / (count as f64).sqrt();
    Some([mean - half, mean + half])
}

/// The value in the middle, or the mean of the two that are; `None` of no values.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    Some(if sorted.len() % 2 == 1 { upper } else { 0.5 * (sorted[sorted.len() / 2 - 1] + upper) })
}

/// The value of a sample below which `share` (0 to 1) of the others are: that of the nearest rank, none between two. `None` of no values.
#[must_use]
pub fn nearest_rank(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[libm::round(share * last as f64) as usize])
}

/// Root of the mean of the squares; zero of no values.
#[must_use]
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (squares, count) =
        values.into_iter().fold((0.0, 0_usize), |(squares, count), value| (squares + value * value, count + 1));
    libm::sqrt(squares / count.max(1) as f64)
}

/// 95 % interval of the share of `trials` that `of` of them were (Wilson 1927, without correction for continuity); from 0 to 1 of no
/// trials.
#[must_use]
pub fn share_interval95(of: usize, trials: usize) -> [f64; 2] {
    if trials == 0 {
        return [0.0, 1.0];
    }
    let (n, p, z) = (trials as f64, of as f64 / trials as f64, NORMAL_975);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z * libm::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / (1.0 + z * z / n);
    [middle - half, middle + half]
}

/// Where the standard normal distribution has 97.5 % below it.
pub const NORMAL_975: f64 = 1.959_963_984_540_054;

/// Spearman's rank correlation of two samples; ties share their ranks. `None` where one of them does not vary, or there are fewer
/// than three pairs.
///
/// # Panics
/// If the samples are of different length.
#[must_use]
pub fn rank_correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    assert_eq!(a.len(), b.len(), "a correlation is of pairs");
    if a.len() < 3 || a.iter().chain(b).any(|value| value.is_nan()) {
        return None;
    }
    let (a, b) = (ranks(a), ranks(b));
    // Ranks from 1 to n have this mean, ties or not.
    let mean = (a.len() as f64 + 1.0) / 2.0;
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(&b).map(|(a, b)| f(a - mean, b - mean)).sum::<f64>();
    let norm = (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt();
    (norm > 0.0).then(|| sum(&|a, b| a * b) / norm)
}

/// Rank of each value, from 1; ties share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    for tied in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let first = order.partition_point(|other| values[*other].total_cmp(&values[tied[0]]).is_lt());
        tied.iter().for_each(|index| ranks[*index] = first as f64 + (tied.len() as f64 + 1.0) / 2.0);
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_has_students_interval() {
        let mean = Mean::of(&[1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!(mean.mean, 2.5);
        // t(0.975, 3) = 3.18245, s = 1.290994.
        let [low, high] = mean.interval95.unwrap();
        assert!((high - 2.5 - 3.182_446 * 1.290_994 / 2.0).abs() < 1e-5 && (low + high - 5.0).abs() < 1e-12);
        assert!(Mean::of(&[1.0]).unwrap().interval95.is_none() && Mean::of(&[]).is_none());
        assert_eq!(
            Mean::of(&[1.0, 2.0]).unwrap().times(-1.0).interval95.unwrap()[0],
            -Mean::of(&[1.0, 2.0]).unwrap().interval95.unwrap()[1]
        );
    }

    #[test]
    fn a_running_mean_is_the_mean() {
        let values = [1.0, 2.0, 3.0, 4.0, 1e3];
        let mut running = Running::default();
        assert!(running.mean().is_none());
        values.iter().for_each(|value| running.push(*value));
        let (found, known) = (running.mean().unwrap(), Mean::of(&values).unwrap());
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs();
        assert!(close(found.mean, known.mean) && found.trials == 5);
        assert!(close(found.interval95.unwrap()[1], known.interval95.unwrap()[1]));
    }

    #[test]
    fn correlations_stay_within_one() {
        let mean = Mean::of_correlations(&[-0.99, -0.5]).unwrap();
        // tanh of the mean of −2.64665 and −0.54931.
        assert!((mean.mean + 0.921_318).abs() < 1e-4, "{}", mean.mean);
        let [low, high] = mean.interval95.unwrap();
        assert!(-1.0 <= low && low < mean.mean && mean.mean < high && high <= 1.0);
        assert!(Mean::of_correlations(&[1.0, 1.0]).unwrap().mean > 0.999);
        assert!(Mean::of_correlations(&[]).is_none());
    }

    #[test]
    fn a_constant_gain_is_certain() {
        let gain = Mean::gain(&[0.5, 1.0, 2.0], &[1.0, 2.0, 4.0]).unwrap();
        assert_eq!((gain.mean, gain.interval95), (0.5, Some([0.5, 0.5])));
        assert!(Mean::gain(&[1.0], &[0.0]).is_none());
    }

    #[test]
    fn intervals_of_shares_are_the_published_ones() {
        // Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3.
        for (of, trials, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)]
        {
            let found = share_interval95(of, trials);
            assert!((found[0] - low).abs() < 5e-5 && (found[1] - high).abs() < 5e-5, "{of} of {trials}: {found:?}");
        }
        assert_eq!(share_interval95(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn middles_and_ends_of_samples() {
        assert_eq!((median([3.0, 1.0, 2.0]), median([4.0, 1.0, 2.0, 3.0]), median([])), (Some(2.0), Some(2.5), None));
        assert_eq!(nearest_rank((0..=200).rev().map(f64::from), 0.025), Some(5.0));
        assert_eq!((nearest_rank([2.0], 0.975), nearest_rank([], 0.5)), (Some(2.0), None));
        assert_eq!((rms([3.0, 4.0, 0.0, 0.0]), rms([])), (2.5, 0.0));
    }

    #[test]
    fn rank_correlation_by_hand() {
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[10.0, 20.0, 1e9]), Some(1.0));
        assert_eq!(rank_correlation(&[1.0, 2.0, 3.0], &[3.0, 2.0, 1.0]), Some(-1.0));
        // Ties: ranks 1, 2.5, 2.5, 4 against 1 … 4 give √0.9.
        let tied = rank_correlation(&[1.0, 2.0, 2.0, 3.0], &[1.0, 2.0, 3.0, 4.0]).unwrap();
        assert!((tied - 0.9f64.sqrt()).abs() < 1e-12, "{tied}");
        assert_eq!(rank_correlation(&[1.0, 1.0, 1.0], &[1.0, 2.0, 3.0]), None);
        assert_eq!(rank_correlation(&[1.0, f64::NEG_INFINITY, 0.0], &[1.0, 2.0, 3.0]), Some(-0.5));
    }
}
