//! What the data cannot tell apart.

use super::Analysis;
use super::claims::place;
use super::outcome::Candidate;
use super::search::Belief;

/// Of each cause that is not sure, what may be in its place. What is sure in another place is none of them: in the walk, causes trade
/// places.
pub(super) fn confusion(analysis: &Analysis<'_>) -> Vec<Vec<Candidate>> {
    let decision = &analysis.options.settings.decision;
    let found = &analysis.found;
    let open = |belief: &&Belief| found.probability(belief.claim) < decision.sure;
    let unsure = found.causes.iter().filter(|beliefs| open(&&beliefs[0]));
    unsure
        .map(|beliefs| {
            let worth = beliefs.iter().filter(open).filter(|belief| belief.probability >= decision.worth_saying);
            worth
                .map(|belief| Candidate {
                    kind: belief.claim.0,
                    location: place(analysis, belief.hypothesis),
                    probability: found.probability(belief.claim),
                    detail: analysis.evidence.candidates.hypotheses[belief.hypothesis].detail.clone(),
                })
                .collect::<Vec<_>>()
        })
        .filter(|set| set.len() > 1 && set.iter().map(|candidate| candidate.probability).sum::<f64>() >= decision.named)
        .collect()
}
