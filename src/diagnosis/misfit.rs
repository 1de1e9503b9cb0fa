//! Names beside something unknown at the same place.
//!
//! A shape without a name stands for a cause whose formula nobody knows, and is never quite that cause. What it leaves of it follows the
//! same joint, and a named signature of that joint may fit it. So where there is a shape without a name, each name at its place has a rival
//! that costs no prior odds, as it comes with the unknown cause: the same signature with the size that the difference may have
//! (Kennedy and O'Hagan's discrepancy, embedded in the joint). A name stays where it does far more than such a difference. What the shape
//! takes back of it is no part of that: two that are large against each other describe one cause together. The same holds of a map that
//! follows a joint's angle freely, and of ripples and harmonics beside it.

use super::evidence::Evidence;
use super::search::{Belief, Found};
use crate::effects::signature::library::Hypothesis;
use crate::effects::signature::shape::Size;

/// Whether `fine` may be what `rough` does not say of a map: `rough` follows the joint's angle freely and knows nothing finer than its
/// values, `fine` is another function of that angle.
fn is_finer(rough: &Hypothesis, fine: &Hypothesis) -> bool {
    rough.shape.size() == Size::Rms
        && fine.shape.size() != Size::Rms
        && fine.shape.of_angle().is_some()
        && rough.location.index == fine.location.index
}

/// Whether what `rough` does not say of its cause may look like `of`: a shape without a name beside a name in the same joint, or on the
/// link that this one moves; or a map beside anything finer.
fn is_beside(rough: &Hypothesis, of: &Hypothesis) -> bool {
    let unnamed = rough.kind.is_none() && of.kind.is_some() && rough.location.index.is_some();
    is_finer(rough, of) || (unnamed && rough.location.index == of.location.index)
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
        let Some((unknown, _)) = others.iter().find(|(other, _)| beside(*other)).copied() else {
            continue;
        };
        let cancelled = evidence.cancelled(&found.best, beside, *hypothesis);
        let square = evidence.settings.prior.misfit * evidence.energy(&others, beside)
            / evidence.marginal.information(*hypothesis).max(1e-12)
            + cancelled * cancelled;
        let as_misfit = evidence.log_gain(&others, *hypothesis, libm::sqrt(square.max(1e-12)));
        let as_cause = whole - evidence.log_posterior(&others);
        let share = 1.0 / (1.0 + libm::exp(as_misfit - as_cause));
        let claim = (named.kind, named.location);
        let rough = &hypotheses[unknown];
        let of_unknown = Belief { claim: (rough.kind, rough.location), hypothesis: unknown, probability: 0.0 };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::search::search;
    use crate::diagnosis::tests::with_analysis;
    use crate::effects::Kind;

    /// The name that a joint's compliance gets where `unknown` acts in that joint or in the one after it: before and after the doubt.
    fn doubted(size: f64, bump: f64, same: bool) -> [f64; 2] {
        let mut probabilities = [0.0; 2];
        with_analysis(
            |arm, joints, _, of, payload| {
                let torque = crate::diagnosis::tests::torque(arm, joints, 2, payload);
                let unknown = bump * (-0.5 * ((joints[of] - 0.2) / 0.15).powi(2)).exp();
                let yields = if of == 2 { size * torque } else { 0.0 };
                yields + if of == (if same { 2 } else { 4 }) { unknown } else { 0.0 }
            },
            |analysis| {
                // A map would have a name for the unknown.
                let mut candidates = analysis.evidence.candidates.clone();
                for (active, of) in candidates.active.iter_mut().zip(&candidates.hypotheses) {
                    *active &= of.kind != Some(Kind::JointAngleMap);
                }
                let evidence = &Evidence { candidates: &candidates, ..analysis.evidence };
                let found = search(evidence, &[], 6);
                let of = |found: &Found| {
                    let is = |belief: &&Belief| belief.claim.0 == Some(Kind::JointCompliance) && belief.claim.1.index == Some(3);
                    found.claims.iter().find(is).map_or(0.0, |belief| belief.probability)
                };
                let unnamed = found.best.iter().any(|(member, _)| evidence.candidates.hypotheses[*member].kind.is_none());
                assert_eq!(unnamed, bump > 0.0, "the unknown is to be seen");
                probabilities[0] = of(&found);
                probabilities[1] = of(&doubt(evidence, found));
            },
        );
        probabilities
    }

    #[test]
    fn a_name_is_doubted_by_as_much_as_the_unknown_in_its_joint_may_make() {
        // Without anything unknown, and beside an unknown elsewhere, it stays as it is.
        let [before, after] = doubted(2e-6, 0.0, true);
        assert!(before > 0.5 && after == before, "{before} {after}");
        let [before, after] = doubted(2e-6, 3e-3, false);
        assert!(before > 0.5 && after == before, "{before} {after}");
        // Beside a far larger one in the same joint a small cause loses, and a large one keeps its name.
        let [before, after] = doubted(2e-6, 3e-3, true);
        assert!(before > 0.5 && after < before, "{before} {after}");
        let [before, after] = doubted(1e-4, 3e-3, true);
        assert!(before > 0.9 && after > 0.9, "{before} {after}");
    }
}
