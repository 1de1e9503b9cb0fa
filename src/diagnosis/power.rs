//! What a data set would show: the least magnitude of every hypothesis that would be named in four cases of five.

use super::evidence::{Candidates, SCALES};
use super::gram::Surviving;

/// Standard normal quantile of 80 %.
const POWER: f64 = 0.8416;
/// Log odds of 0.95.
const NAMED: f64 = 2.944;
/// Likeness (cosine squared) beyond which two signatures are one.
const ONE: f64 = 0.999;

/// The power of a hypothesis.
#[derive(Clone, Debug, PartialEq)]
pub struct Power {
    /// Least magnitude, SI; `None` where nothing survives.
    pub least: Option<f64>,
    /// Hypothesis that is most alike, and how much.
    pub alike: Option<(usize, f64)>,
}

/// λ at which the log odds reach [`NAMED`] in four cases of five: `½ (λ − 2·0.84 √λ + w) + log prior odds − ½ log|1 + f² G| ≥ 2.94`.
fn lambda_needed(log_odds: f64, width: f64, information: f64) -> f64 {
    let mut lambda: f64 = 20.0;
    for _ in 0..50 {
        let size = libm::sqrt(lambda / information.max(1e-300));
        let (scale, share) = SCALES
            .iter()
            .copied()
            .min_by(|a, b| (libm::log(a.0) - libm::log(size)).abs().total_cmp(&(libm::log(b.0) - libm::log(size)).abs()))
            .unwrap_or(SCALES[0]);
        let penalty = 0.5 * width * libm::log(1.0 + scale * scale * information / width) - libm::log(share);
        let needed = 2.0 * (NAMED - log_odds + penalty) - width;
        // λ − 2·0.84 √λ = needed.
        let root = POWER + libm::sqrt((POWER * POWER + needed).max(0.0));
        lambda = 0.5 * (lambda + root * root);
    }
    lambda
}

/// The power of `hypothesis` where the noise's mean square is `noise` (in declared sigmas).
#[must_use]
pub fn power(candidates: &Candidates, surviving: &Surviving, noise: f64, hypothesis: usize) -> Power {
    let columns = candidates.columns(hypothesis);
    let width = columns.len() as f64;
    let information: f64 = columns.clone().map(|column| surviving.products[(column, column)]).sum::<f64>() / noise;
    if information < 1e-8 {
        return Power { least: None, alike: None };
    }
    let log_odds = if candidates.log_odds[hypothesis].is_finite() { candidates.log_odds[hypothesis] } else { -6.0 };
    let mut lambda = lambda_needed(log_odds, width, information);
    let mut alike = None;
    if columns.len() == 1 {
        let own = surviving.products[(columns.start, columns.start)];
        let this = &candidates.hypotheses[hypothesis];
        for other in 0..candidates.hypotheses.len() {
            let that = &candidates.hypotheses[other];
            let same = that.kind == this.kind && that.location == this.location;
            let of_other = candidates.columns(other);
            if same || !candidates.active[other] || of_other.len() != 1 || that.kind.is_none() {
                continue;
            }
            let cross = surviving.products[(columns.start, of_other.start)];
            let likeness = cross * cross / (own * surviving.products[(of_other.start, of_other.start)]).max(1e-300);
            if alike.is_none_or(|(_, most)| likeness > most) {
                alike = Some((other, likeness));
            }
        }
        if let Some((_, likeness)) = alike {
            // The difference of the two must show as well: ½x − 0.84 √x ≥ 2.94.
            let root = POWER + libm::sqrt(POWER * POWER + 2.0 * NAMED);
            lambda = lambda.max(root * root / (1.0 - likeness.min(ONE)));
        }
    }
    Power { least: Some(candidates.unit[hypothesis] * libm::sqrt(lambda / information)), alike }
}
