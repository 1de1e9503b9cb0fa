//! Names beside something unknown at the same place.
//!
//! A shape without a name stands for a cause whose formula nobody knows, and is never quite that cause. What it leaves of it follows the
//! same joint, and a named signature of that joint may fit it. So where there is a shape without a name, each name at its place has a rival
//! that costs no prior odds, as it comes with the unknown cause: the same signature with the size that the difference may have
//! (Kennedy and O'Hagan's discrepancy, embedded in the joint). A name stays where it does far more than such a difference.

use super::evidence::Evidence;
use super::search::{Belief, Found};
use crate::effects::signature::library::Hypothesis;

/// Whether what `unknown` does not say of its cause may look like `named`: it sits in the same joint, or on the link that this one moves.
fn is_beside(unknown: &Hypothesis, named: &Hypothesis) -> bool {
    unknown.kind.is_none() && unknown.location.index.is_some() && unknown.location.index == named.location.index
}

/// `found` with the probability of each name shared with the unknown beside it.
#[must_use]
pub(super) fn doubt(evidence: &Evidence<'_>, mut found: Found) -> Found {
    let hypotheses = &evidence.candidates.hypotheses;
    let whole = evidence.log_posterior(&found.best);
    for (number, (hypothesis, _)) in found.best.iter().enumerate() {
        let named = &hypotheses[*hypothesis];
        let mut others = found.best.clone();
        others.remove(number);
        let beside = |other: usize| is_beside(&hypotheses[other], named);
        let Some((unknown, _)) = others.iter().find(|(other, _)| beside(*other)).copied().filter(|_| named.kind.is_some()) else {
            continue;
        };
        let square = evidence.settings.prior.misfit * evidence.energy(&others, beside)
            / evidence.marginal.information(*hypothesis).max(1e-12);
        let as_misfit = evidence.log_gain(&others, *hypothesis, libm::sqrt(square.max(1e-12)));
        let as_cause = whole - evidence.log_posterior(&others);
        let share = 1.0 / (1.0 + libm::exp(as_misfit - as_cause));
        let claim = (named.kind, named.location);
        let of_unknown = Belief { claim: (None, hypotheses[unknown].location), hypothesis: unknown, probability: 0.0 };
        let lists = std::iter::once(&mut found.claims).chain(found.causes.get_mut(number));
        for list in lists {
            let Some(at) = list.iter().position(|belief| belief.claim == claim) else {
                continue;
            };
            let taken = list[at].probability * (1.0 - share);
            list[at].probability -= taken;
            match list.iter_mut().find(|belief| belief.claim == of_unknown.claim) {
                Some(known) => known.probability = (known.probability + taken).min(1.0),
                None => list.push(Belief { probability: taken, ..of_unknown }),
            }
            list.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.hypothesis.cmp(&b.hypothesis)));
        }
    }
    found
}
