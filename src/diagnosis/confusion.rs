//! What the data cannot tell apart.

use super::Analysis;
use super::claims::{NAMED, SURE, place};
use super::outcome::Candidate;

/// A hypothesis of a set has at least this probability.
const WORTH_SAYING: f64 = 0.03;

/// Of each cause that is not sure, what may be in its place.
pub(super) fn confusion(analysis: &Analysis<'_>) -> Vec<Vec<Candidate>> {
    let unsure = analysis.found.causes.iter().filter(|beliefs| beliefs[0].probability < SURE);
    unsure
        .map(|beliefs| {
            let worth = beliefs.iter().filter(|belief| belief.probability >= WORTH_SAYING);
            worth
                .map(|belief| Candidate {
                    kind: belief.claim.0,
                    location: place(analysis, belief.hypothesis),
                    probability: belief.probability,
                    detail: analysis.evidence.candidates.hypotheses[belief.hypothesis].detail.clone(),
                })
                .collect::<Vec<_>>()
        })
        .filter(|set| set.len() > 1 && set.iter().map(|candidate| candidate.probability).sum::<f64>() >= NAMED)
        .collect()
}
