//! Randomness: one seed, labelled streams.
//!
//! Every draw of the program comes from a [`Stream`], named by a label such as `design/swarm`. Streams of different labels are
//! independent, so that a new draw in one never shifts another, and draws happen before work is shared among threads.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use sha2::{Digest, Sha256};

/// A stream of random numbers: ChaCha12, keyed by the SHA-256 of seed and label.
#[derive(Clone, Debug)]
pub struct Stream {
    rng: ChaCha12Rng,
    spare_normal: Option<f64>,
}

/// The stream `label` of `seed`. Labels are paths (`noise/position`); a number in them (`trial/17`) makes streams for repeats.
#[must_use]
pub fn stream(seed: u64, label: &str) -> Stream {
    let mut hash = Sha256::new();
    hash.update(b"kincal/stream/1");
    hash.update(seed.to_le_bytes());
    hash.update(label.as_bytes());
    Stream { rng: ChaCha12Rng::from_seed(hash.finalize().into()), spare_normal: None }
}

/// A key that cannot be computed from `public` alone.
#[must_use]
pub fn hidden_key(secret: &str, public: u64) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(b"kincal/hidden/1");
    hash.update(public.to_le_bytes());
    hash.update(secret.as_bytes());
    hash.finalize().into()
}

/// The stream `label` of a hidden key.
#[must_use]
pub fn hidden_stream(key: &[u8; 32], label: &str) -> Stream {
    let mut hash = Sha256::new();
    hash.update(b"kincal/hidden stream/1");
    hash.update(key);
    hash.update(label.as_bytes());
    Stream { rng: ChaCha12Rng::from_seed(hash.finalize().into()), spare_normal: None }
}

/// A seed made of a seed and a number, such as that of a trial.
#[must_use]
pub fn derive(seed: u64, with: u64) -> u64 {
    let mut hash = Sha256::new();
    hash.update(b"kincal/derive/1");
    hash.update(seed.to_le_bytes());
    hash.update(with.to_le_bytes());
    let digest: [u8; 32] = hash.finalize().into();
    let mut first = [0; 8];
    first.copy_from_slice(&digest[..8]);
    u64::from_le_bytes(first)
}

impl Stream {
    /// Uniform on `[0, 1)`, 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform on `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal, by Box and Muller's transform (through `libm`, so that every machine draws the same bits).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare_normal.take() {
            return spare;
        }
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * self.unit());
        self.spare_normal = Some(radius * sine);
        radius * cosine
    }

    /// Uniform on `0..count`.
    ///
    /// # Panics
    /// If `count` is zero.
    pub fn index(&mut self, count: usize) -> usize {
        assert!(count > 0, "an index into nothing was asked for");
        // Multiply-shift: the bias of at most count/2^64 is far below anything that could be seen.
        ((u128::from(self.rng.next_u64()) * count as u128) >> 64) as usize
    }

    /// Puts `items` in random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.index(last + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_depends_on_seed_and_label_only() {
        let draws = |seed, label| (0..4).map(|_| stream(seed, label).unit()).collect::<Vec<_>>();
        assert_eq!(draws(1, "a"), draws(1, "a"));
        assert_ne!(draws(1, "a"), draws(1, "b"));
        assert_ne!(draws(1, "a"), draws(2, "a"));
    }

    #[test]
    fn normal_draws_have_the_moments_of_a_normal() {
        let mut stream = stream(7, "test/normal");
        let draws: Vec<f64> = (0..200_000).map(|_| stream.normal()).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let kurtosis = draws.iter().map(|x| (x - mean).powi(4)).sum::<f64>() / n / variance.powi(2);
        // Four standard errors of each moment.
        assert!(mean.abs() < 4.0 / n.sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "variance {variance}");
        assert!((kurtosis - 3.0).abs() < 4.0 * (24.0 / n).sqrt(), "kurtosis {kurtosis}");
    }
}
