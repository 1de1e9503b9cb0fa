//! What the data cannot tell apart.

use super::Analysis;
use super::claims::place;
use super::outcome::Candidate;

/// Of each cause that is not sure, what may be in its place.
pub(super) fn confusion(analysis: &Analysis<'_>) -> Vec<Vec<Candidate>> {
    let decision = &analysis.options.settings.decision;
    let unsure = analysis.found.causes.iter().filter(|beliefs| beliefs[0].probability < decision.sure);
    unsure
        .map(|beliefs| {
            let worth = beliefs.iter().filter(|belief| belief.probability >= decision.worth_saying);
            worth
                .map(|belief| Candidate {
                    kind: belief.claim.0,
                    location: place(analysis, belief.hypothesis),
                    probability: belief.probability,
                    detail: analysis.evidence.candidates.hypotheses[belief.hypothesis].detail.clone(),
                })
                .collect::<Vec<_>>()
        })
        .filter(|set| set.len() > 1 && set.iter().map(|candidate| candidate.probability).sum::<f64>() >= decision.named)
        .collect()
}
