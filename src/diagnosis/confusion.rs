//! What the data cannot tell apart.

use super::Analysis;
use super::claims::{Claim, NAMED, SURE, claim, kind_name, place, rivals};
use super::outcome::Candidate;
use crate::effects::Kind;

/// A hypothesis of a set has at least this probability.
const WORTH_SAYING: f64 = 0.03;

/// Probability of a ripple of which evidence is sure and which held-out readings do not bear out: neither is believed more (a convention).
const DIVIDED: f64 = 0.5;

/// Sets of claims that the data cannot tell apart: each member of the best set that is not sure, with what may stand in its place.
/// `named`: of each member of the best set, whether it is named; what is probable and not named stands here, be it alone.
pub(super) fn confusion(analysis: &Analysis<'_>, named: &[Option<usize>]) -> Vec<Vec<Candidate>> {
    let members = analysis.found.best.members.iter().zip(named);
    let unnamed: Vec<Claim> = members
        .filter(|((member, _), named)| named.is_none() && analysis.candidates.hypotheses[*member].kind.is_some())
        .map(|((member, _), _)| claim(analysis, *member))
        .collect();
    // All claims with their probabilities and one hypothesis that stands for each.
    let mut claims: Vec<(Claim, f64, usize)> = Vec::new();
    for (members, weight) in &analysis.found.models {
        let mut seen: Vec<Claim> = Vec::new();
        for (hypothesis, _) in members {
            let this = claim(analysis, *hypothesis);
            if seen.contains(&this) {
                continue;
            }
            seen.push(this);
            match claims.iter_mut().find(|(known, _, _)| *known == this) {
                Some((_, probability, _)) => *probability += weight,
                None => claims.push((this, *weight, *hypothesis)),
            }
        }
    }
    // Parts of the data that contradict the best set take their share of its members' probabilities.
    for (member, _) in &analysis.found.best.members {
        let this = claim(analysis, *member);
        let Some(before) = claims.iter().find(|(known, _, _)| *known == this).map(|(_, probability, _)| *probability) else {
            continue;
        };
        for (rival, hypothesis, share) in rivals(analysis, this) {
            let moved = before * share;
            for (known, probability, _) in &mut claims {
                *probability -= if *known == this { moved } else { 0.0 };
            }
            match claims.iter_mut().find(|(known, _, _)| *known == rival) {
                Some((_, probability, _)) => *probability = (*probability + moved).min(1.0),
                None => claims.push((rival, moved, hypothesis)),
            }
        }
    }
    claims.retain(|(known, probability, _)| *probability >= WORTH_SAYING && (*probability < SURE || unnamed.contains(known)));
    // Claims of one set exclude each other: they are hardly ever in one model.
    let together = |a: &Claim, b: &Claim| -> f64 {
        let has =
            |members: &[(usize, usize)], one: &Claim| members.iter().any(|(hypothesis, _)| claim(analysis, *hypothesis) == *one);
        let models = analysis.found.models.iter();
        models.filter(|(members, _)| has(members, a) && has(members, b)).map(|(_, weight)| weight).sum()
    };
    claims.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut sets: Vec<Vec<(Claim, f64, usize)>> = Vec::new();
    for one in claims {
        let fits = |set: &Vec<(Claim, f64, usize)>| {
            let sum: f64 = set.iter().map(|(_, probability, _)| probability).sum();
            sum + one.1 < 1.02 && set.iter().all(|other| together(&other.0, &one.0) < 0.3 * one.1.min(other.1))
        };
        match sets.iter_mut().find(|set| fits(set)) {
            Some(set) => set.push(one),
            None => sets.push(vec![one]),
        }
    }
    sets.into_iter()
        .filter(|set| {
            (set.len() > 1 || unnamed.contains(&set[0].0))
                && set.iter().map(|(_, probability, _)| probability).sum::<f64>() >= NAMED
        })
        .map(|set| {
            let alone = set.len() == 1;
            let mut said: Vec<Candidate> = set
                .into_iter()
                .take(12)
                .map(|((kind, _), probability, hypothesis)| Candidate {
                    kind: kind_name(kind),
                    location: place(analysis, hypothesis),
                    probability,
                    detail: analysis.candidates.hypotheses[hypothesis].detail.clone(),
                })
                .collect();
            if let Some(only) = said.first().cloned().filter(|_| alone) {
                // Where evidence is sure, and it is not named all the same, that is because held-out readings are not helped (a ripple), or
                // because something unknown is there beside it.
                let (most, detail) = if only.kind == Kind::StrainWaveError.name() {
                    (DIVIDED, "something without a name: the other does not help on readings that were not used")
                } else {
                    (SURE, "something without a name that it stands in for")
                };
                said[0].probability = only.probability.min(most);
                let probability = 1.0 - said[0].probability;
                said.push(Candidate { kind: kind_name(None), probability, detail: detail.to_owned(), ..only });
            }
            said
        })
        .collect()
}
