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
        .filter(|set| set.len() > 1 && set.iter().map(|candidate| candidate.probability).sum::<f64>() >= decision.there)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::search::Found;
    use crate::diagnosis::tests::{belief, with_analysis};
    use crate::effects::Kind::{Backlash, JointCompliance};

    /// The sets of the guide: what may stand for a cause that is not sure, and nothing that is sure elsewhere.
    #[test]
    fn only_what_may_stand_for_an_unsure_cause_is_a_set() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                let belief = |kind, joint, probability| belief(&analysis, Some(kind), joint, probability);
                let unsure = vec![belief(Backlash, 2, 0.6), belief(JointCompliance, 3, 0.3), belief(Backlash, 4, 0.02)];
                let sure = vec![belief(Backlash, 5, 0.97), belief(Backlash, 6, 0.03)];
                let weak = vec![belief(JointCompliance, 4, 0.3), belief(JointCompliance, 5, 0.1)];
                let alone = vec![belief(Backlash, 7, 0.55), belief(Backlash, 5, 0.3)];
                let claims = [&unsure[..], &sure, &weak, &alone[..1]].concat();
                analysis.found = Found { causes: vec![unsure, sure, weak, alone], claims, ..Found::default() };
                let sets = confusion(&analysis);
                let said: Vec<Vec<_>> = sets
                    .iter()
                    .map(|set| set.iter().map(|one| (one.kind, one.location.index, one.probability)).collect())
                    .collect();
                assert_eq!(said, [[(Some(Backlash), Some(2), 0.6), (Some(JointCompliance), Some(3), 0.3)]]);
            },
        );
    }
}
