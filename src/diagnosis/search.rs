//! The search over sets of effects and the probabilities that come of it: a climb to the likeliest set by adding, exchanging and taking
//! away, then a walk about it by Gibbs sampling, in which each cause in turn is drawn anew beside all others.
//!
//! The cost of a step is linear in the number of effects, so that a set may have twenty. Probabilities are means of the exact
//! conditional ones over the walk (Rao and Blackwell's), so that few rounds do.

use std::collections::BTreeMap;

use super::evidence::{Evidence, Extension};
use super::fitted::Fitted;
use crate::effects::{Kind, Location};
use crate::seed::stream;

/// Difference of log posteriors that is a step up: less is rounding, by which a climb would go round in circles.
const BETTER: f64 = 1e-6;
/// Weight, of all that may be drawn, below which nothing is: thousands of such hypotheses together change no probability that is said.
const NEGLIGIBLE: f64 = 1e-9;

/// What is claimed: a kind (or none) at a place.
pub(crate) type Claim = (Option<Kind>, Location);

/// A claim with its probability and the hypothesis that stands for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Belief {
    /// The claim.
    pub(crate) claim: Claim,
    /// Its likeliest variant.
    pub(crate) hypothesis: usize,
    /// That it is there.
    pub(crate) probability: f64,
}

/// What a search found.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    /// The likeliest set: hypotheses and scales of their priors, in the order in which they help most.
    pub(crate) best: Vec<(usize, usize)>,
    /// Of each member of the best set, what may be in its place, likeliest first; what is missing from one is that nothing is.
    pub(crate) causes: Vec<Vec<Belief>>,
    /// Every claim with its probability, likeliest first.
    pub(crate) claims: Vec<Belief>,
}

impl Found {
    /// The probability of `claim`.
    #[must_use]
    pub(crate) fn probability(&self, claim: Claim) -> f64 {
        self.claims.iter().find(|belief| belief.claim == claim).map_or(0.0, |belief| belief.probability)
    }
}

/// The claim of hypothesis number `hypothesis`.
fn claim(evidence: &Evidence<'_>, hypothesis: usize) -> Claim {
    let of = &evidence.candidates.hypotheses[hypothesis];
    (of.kind, of.location)
}

/// The likeliest set that can be reached from `start`, of `most` effects at most, and the logarithm of its posterior.
#[must_use]
pub(crate) fn climb(evidence: &Evidence<'_>, start: &[(usize, usize)], most: usize) -> (Vec<(usize, usize)>, f64) {
    let mut fitted = Fitted::new(evidence, start);
    let mut value = fitted.log_posterior();
    loop {
        while fitted.members().len() < most {
            match best_of(fitted.extensions()) {
                Some((member, better)) if better > value + BETTER => {
                    fitted.add(member);
                    value = better;
                }
                _ => break,
            }
        }
        let exchanges = (0..fitted.members().len()).filter_map(|at| {
            let own = fitted.members()[at];
            let (without, others) = fitted.exchanges(at);
            let without = (without, at, None);
            let with = best_of(others).filter(|(member, _)| *member != own);
            let with = with.map(|(member, better)| (better, at, Some(member)));
            with.into_iter().chain([without]).max_by(|a, b| a.0.total_cmp(&b.0))
        });
        match exchanges.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((better, at, other)) if better > value + BETTER => {
                fitted.remove(at);
                other.into_iter().for_each(|member| fitted.add(member));
                value = better;
            }
            _ => return (fitted.members().to_vec(), value),
        }
    }
}

fn best_of(extensions: Vec<Extension>) -> Option<((usize, usize), f64)> {
    let likelier = |a: &Extension, b: &Extension| a.log_posterior.total_cmp(&b.log_posterior).then(b.member.cmp(&a.member));
    extensions.into_iter().max_by(likelier).map(|best| (best.member, best.log_posterior))
}

/// Searches from `start` on. `most`: effects of a set at most.
#[must_use]
pub(crate) fn search(evidence: &Evidence<'_>, start: &[(usize, usize)], most: usize) -> Found {
    let (best, _) = climb(evidence, start, most);
    walk(evidence, &best, most)
}

/// Probabilities of claims in one draw: how likely each is, and which variant stands for it.
type Weights = BTreeMap<Claim, (f64, f64, usize)>;

fn add(weights: &mut Weights, claim: Claim, probability: f64, hypothesis: usize) {
    let known = weights.entry(claim).or_insert((0.0, 0.0, hypothesis));
    known.0 += probability;
    if probability > known.1 {
        (known.1, known.2) = (probability, hypothesis);
    }
}

/// The walk about the set `best`.
fn walk(evidence: &Evidence<'_>, best: &[(usize, usize)], most: usize) -> Found {
    let mut stream = stream(1, "diagnosis/walk");
    let mut places: Vec<Option<(usize, usize)>> = best.iter().copied().map(Some).collect();
    places.extend(vec![None; evidence.settings.search.spare.min(most.saturating_sub(best.len()))]);
    let mut of_place: Vec<Weights> = vec![Weights::new(); places.len()];
    let mut all: Weights = Weights::new();
    let mut fitted = Fitted::new(evidence, best);
    let mut rounds = 0;
    for round in 0..evidence.settings.search.rounds {
        let mut of_round: Weights = Weights::new();
        let mut certain = true;
        for place in 0..places.len() {
            if let Some(member) = places[place] {
                fitted.members().iter().position(|known| *known == member).into_iter().for_each(|at| fitted.remove(at));
            }
            let nothing = fitted.log_posterior();
            let extensions = fitted.extensions();
            let top = extensions.iter().map(|extension| extension.log_posterior).fold(nothing, f64::max);
            let weight = |extension: &Extension| libm::exp(extension.log_posterior - top);
            let nothing = libm::exp(nothing - top);
            let total = nothing + extensions.iter().map(weight).sum::<f64>();
            let mut here: Weights = Weights::new();
            let mut drawn = stream.unit() * total - nothing;
            let mut next = None;
            for extension in &extensions {
                let weight = weight(extension);
                if weight < NEGLIGIBLE * total {
                    continue;
                }
                add(&mut here, claim(evidence, extension.member.0), weight / total, extension.member.0);
                if drawn > 0.0 {
                    drawn -= weight;
                    next = Some(extension.member);
                }
            }
            places[place] = next;
            next.into_iter().for_each(|member| fitted.add(member));
            certain &= here.values().map(|(probability, ..)| *probability).fold(nothing / total, f64::max)
                > evidence.settings.search.certain;
            for (claim, (probability, _, hypothesis)) in here {
                add(&mut of_place[place], claim, probability, hypothesis);
                add(&mut of_round, claim, probability, hypothesis);
            }
        }
        for (claim, (probability, _, hypothesis)) in of_round {
            add(&mut all, claim, probability.min(1.0), hypothesis);
        }
        rounds += 1;
        if certain && round > 0 {
            break;
        }
    }
    let beliefs = |weights: Weights| {
        let belief = |(claim, (sum, _, hypothesis)): (Claim, (f64, f64, usize))| Belief {
            claim,
            hypothesis,
            probability: (sum / f64::from(rounds)).min(1.0),
        };
        let mut beliefs: Vec<Belief> = weights.into_iter().map(belief).collect();
        beliefs.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.hypothesis.cmp(&b.hypothesis)));
        beliefs
    };
    let mut members = Vec::new();
    let mut causes = Vec::new();
    for (place, weights) in of_place.into_iter().enumerate() {
        let beliefs = beliefs(weights);
        let nothing = 1.0 - beliefs.iter().map(|belief| belief.probability).sum::<f64>();
        let Some(likeliest) = beliefs.first().copied().filter(|belief| belief.probability >= nothing) else {
            continue;
        };
        let excluded = |(other, _): &(usize, usize)| evidence.candidates.exclude(*other, likeliest.hypothesis);
        if members.iter().any(excluded) {
            continue;
        }
        let own = best.get(place).copied().filter(|(member, _)| claim(evidence, *member) == likeliest.claim);
        members.push(own.unwrap_or((likeliest.hypothesis, evidence.settings.search.stand_in_scale)));
        causes.push(beliefs);
    }
    let order = in_order(evidence, &members);
    Found {
        best: order.iter().map(|at| members[*at]).collect(),
        causes: order.iter().map(|at| causes[*at].clone()).collect(),
        claims: beliefs(all),
    }
}

/// Places of the members in the order in which each adds most to what those before it explain.
fn in_order(evidence: &Evidence<'_>, members: &[(usize, usize)]) -> Vec<usize> {
    let mut left: Vec<usize> = (0..members.len()).collect();
    let mut ordered: Vec<usize> = Vec::new();
    let mut fitted = Fitted::new(evidence, &[]);
    while !left.is_empty() {
        let values: Vec<f64> = left.iter().map(|at| fitted.log_posterior_with(members[*at])).collect();
        let next = (0..left.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        fitted.add(members[left[next]]);
        ordered.push(left.remove(next));
    }
    ordered
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::diagnosis::evidence::{Candidates, NoisePrior};
    use crate::diagnosis::products::test_marginal;
    use crate::diagnosis::settings::{SCALES, Settings};
    use crate::effects::Level;
    use crate::effects::kind::joint_compliance::Torque;
    use crate::effects::signature::library::Hypothesis;
    use crate::effects::signature::shape::Shape;
    use crate::seed::Stream;

    /// Joints that yield, one column each.
    fn candidates(count: usize) -> Candidates {
        let of = |joint: usize| Hypothesis {
            share: None,
            kind: Some(Kind::JointCompliance),
            location: Location { level: Level::Joint, index: Some(joint + 1) },
            shape: Shape::Torque(Torque { joint }),
            range: [0.5, 2.0],
            spread: vec![1.0],
            detail: String::new(),
        };
        Candidates {
            hypotheses: (0..count).map(of).collect(),
            first: (0..count).collect(),
            unit: vec![1.0; count],
            widest: vec![f64::INFINITY; count],
            log_odds: vec![-2.0; count],
            active: vec![true; count],
            scanned: count,
        }
    }

    fn with_evidence(signatures: &DMatrix<f64>, residual: &DVector<f64>, ask: impl FnOnce(&Evidence<'_>)) {
        let candidates = candidates(signatures.ncols());
        let products = test_marginal(&candidates, signatures, residual);
        let (marginal, settings) = (products.marginal(), Settings::default());
        let noise = NoisePrior { degrees_of_freedom: 100.0, level: 1.0 };
        ask(&Evidence { marginal: &marginal, candidates: &candidates, noise, settings: &settings });
    }

    /// Every set of the hypotheses from `first` on, with every scale.
    fn all_sets(first: usize, count: usize) -> Vec<Vec<(usize, usize)>> {
        if first == count {
            return vec![Vec::new()];
        }
        let rest = all_sets(first + 1, count);
        let with = |scale: usize| rest.iter().map(move |set| [&[(first, scale)], set.as_slice()].concat());
        (0..SCALES).flat_map(with).chain(rest.iter().cloned()).collect()
    }

    fn design(rows: usize, columns: usize, draws: &mut Stream) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| draws.normal())
    }

    #[test]
    fn the_climb_ends_at_the_likeliest_of_all_sets() {
        let mut draws = stream(9, "test/climb");
        for round in 0..12 {
            let mut signatures = design(40, 4, &mut draws);
            // Two of them look much alike.
            let other = signatures.column(0) * 0.8 + signatures.column(3) * 0.6;
            signatures.set_column(3, &other);
            let truth = DVector::from_fn(4, |at, _| if (round >> at) % 2 == 1 { 1.0 } else { 0.0 });
            let residual = &signatures * truth + DVector::from_fn(40, |_, _| draws.normal());
            with_evidence(&signatures, &residual, |evidence| {
                let (members, value) = climb(evidence, &[], 4);
                let best = all_sets(0, 4).iter().map(|set| evidence.log_posterior(set)).fold(f64::NEG_INFINITY, f64::max);
                assert!((value - evidence.log_posterior(&members)).abs() < 1e-9 && (value - best).abs() < 1e-9, "{value} {best}");
            });
        }
    }

    /// Which of two that look alike it is, by adding up all sets.
    #[test]
    fn alternatives_share_their_probability_as_all_sets_say() {
        let mut draws = stream(10, "test/alternatives");
        let mut signatures = design(40, 3, &mut draws);
        let other = signatures.column(0) + signatures.column(1) * 0.1;
        signatures.set_column(1, &other);
        let residual = signatures.column(0) * 1.5 + DVector::from_fn(40, |_, _| draws.normal());
        with_evidence(&signatures, &residual, |evidence| {
            let sets = all_sets(0, 3);
            let top = sets.iter().map(|set| evidence.log_posterior(set)).fold(f64::NEG_INFINITY, f64::max);
            let weight = |number: usize| -> f64 {
                let only = |set: &&Vec<(usize, usize)>| set.len() == 1 && set[0].0 == number;
                sets.iter().filter(only).map(|set| (evidence.log_posterior(set) - top).exp()).sum()
            };
            let wanted = weight(0) / (weight(0) + weight(1));
            let found = search(evidence, &[], 3);
            let of = |number: usize| {
                let is = |belief: &&Belief| belief.claim.1.index == Some(number + 1);
                found.causes[0].iter().find(is).map_or(0.0, |belief| belief.probability)
            };
            assert!((0.02..0.98).contains(&wanted), "{wanted}");
            assert!((of(0) / (of(0) + of(1)) - wanted).abs() < 0.05, "{} {} {wanted}", of(0), of(1));
        });
    }
}
