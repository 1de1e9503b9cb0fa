//! The search over sets of effects: forward with a beam, then swaps and deletions, and the probabilities that come of it.

use std::collections::BTreeMap;

use super::evidence::{Candidates, Model, NoisePrior, SCALES, extensions, log_posterior};
use super::gram::Surviving;
use crate::effects::signature::shape::Shape;
use crate::effects::{Kind, Location};

/// Most effects of a set.
pub const MOST: usize = 6;
/// Sets kept at each size.
const BEAM: usize = 5;
/// Differences of log posterior beyond which a model adds nothing to a probability.
const NEGLIGIBLE: f64 = 14.0;

/// What a search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The best variant of the most likely set of kinds at places, its members in the order in which they help most.
    pub best: Model,
    /// Models with their posterior probabilities among all explored, most likely first.
    pub models: Vec<(Vec<(usize, usize)>, f64)>,
}

type Key = Vec<usize>;

/// Kinds (or none) at places, sorted.
type Claims = Vec<(Option<Kind>, Location)>;

/// Models explored: of each set of hypotheses, the best scales and the logarithm of the sum over scales.
#[derive(Default)]
struct Explored {
    sets: BTreeMap<Key, BTreeMap<Vec<usize>, Model>>,
}

impl Explored {
    fn add(&mut self, model: Model) {
        let mut sorted = model.members.clone();
        sorted.sort_unstable();
        let key: Key = sorted.iter().map(|(hypothesis, _)| *hypothesis).collect();
        let scales: Vec<usize> = sorted.iter().map(|(_, scale)| *scale).collect();
        let of_set = self.sets.entry(key).or_default();
        match of_set.get_mut(&scales) {
            Some(known) if known.log_posterior >= model.log_posterior => {}
            Some(known) => *known = model,
            None => {
                of_set.insert(scales, model);
            }
        }
    }

    fn best(&self) -> Option<&Model> {
        self.sets.values().flat_map(BTreeMap::values).max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior))
    }
}

/// Searches. `most`: effects of a set at most.
#[must_use]
pub fn search(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, most: usize) -> Found {
    let empty = Model { members: Vec::new(), log_posterior: 0.0 };
    // An extension knows what the new member's sign is worth, not how it shifts those of the others.
    let exact = |model: &Model| Model {
        members: model.members.clone(),
        log_posterior: log_posterior(surviving, candidates, noise, &model.members),
    };
    let mut explored = Explored::default();
    explored.add(empty.clone());
    let mut beam = vec![empty];
    for _ in 0..most {
        let mut next: Vec<Model> = Vec::new();
        for model in &beam {
            let found = extensions(surviving, candidates, noise, &model.members);
            next.extend(found);
        }
        next.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        let best_before = explored.best().map_or(0.0, |best| best.log_posterior);
        let Some(best_now) = next.first().map(|model| model.log_posterior) else {
            break;
        };
        for model in next.iter().take_while(|model| model.log_posterior > best_now.max(best_before) - NEGLIGIBLE) {
            explored.add(exact(model));
        }
        // Two sets that differ in a scale only are one.
        beam.clear();
        for model in next {
            let same = |other: &Model| {
                let key = |model: &Model| {
                    let mut key: Key = model.members.iter().map(|(hypothesis, _)| *hypothesis).collect();
                    key.sort_unstable();
                    key
                };
                key(other) == key(&model)
            };
            if !beam.iter().any(same) {
                beam.push(model);
            }
            if beam.len() >= BEAM {
                break;
            }
        }
        if best_now < best_before - 6.0 {
            break;
        }
    }
    one_by_one(surviving, candidates, noise, &mut explored);
    // Swaps and deletions about the best, until there is none better.
    for _ in 0..6 {
        let Some(best) = explored.best().cloned() else {
            break;
        };
        for leave in 0..best.members.len() {
            let mut fewer = best.members.clone();
            fewer.remove(leave);
            let log_posterior = log_posterior(surviving, candidates, noise, &fewer);
            explored.add(Model { members: fewer.clone(), log_posterior });
            for model in extensions(surviving, candidates, noise, &fewer) {
                if model.log_posterior > best.log_posterior - NEGLIGIBLE {
                    explored.add(exact(&model));
                }
            }
        }
        let yields = |(member, _): &&(usize, usize)| candidates.hypotheses[*member].kind == Some(Kind::JointCompliance);
        if best.members.len() - best.members.iter().filter(yields).count() < most {
            for model in extensions(surviving, candidates, noise, &best.members) {
                if model.log_posterior > best.log_posterior - NEGLIGIBLE {
                    explored.add(exact(&model));
                }
            }
        }
        if explored.best().is_some_and(|now| now.log_posterior <= best.log_posterior + 1e-9) {
            break;
        }
    }
    let top = explored.best().map_or(0.0, |best| best.log_posterior);
    let mut models = Vec::new();
    let mut total = 0.0;
    // What is claimed, whatever the variant: a step has as many as there are moments.
    let mut claims: BTreeMap<Claims, (f64, &Model)> = BTreeMap::new();
    for of_set in explored.sets.values() {
        let weight: f64 = of_set.values().map(|model| libm::exp(model.log_posterior - top)).sum();
        let Some(best) = of_set.values().max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior)) else {
            continue;
        };
        models.push((best.members.clone(), weight));
        total += weight;
        let claim = |(member, _): &(usize, usize)| (candidates.hypotheses[*member].kind, candidates.hypotheses[*member].location);
        let mut claimed: Claims = best.members.iter().map(claim).collect();
        claimed.sort_unstable();
        let known = claims.entry(claimed).or_insert((0.0, best));
        known.0 += weight;
        if best.log_posterior > known.1.log_posterior {
            known.1 = best;
        }
    }
    let best = claims.values().max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, model)| (*model).clone());
    let best = best.unwrap_or(Model { members: Vec::new(), log_posterior: 0.0 });
    for (_, weight) in &mut models {
        *weight /= total;
    }
    models.sort_by(|a, b| b.1.total_cmp(&a.1));
    models.truncate(400);
    let members = in_order(surviving, candidates, noise, &best.members);
    Found { best: Model { members, ..best }, models }
}

/// Where all joints are said to yield alike, lets each yield by itself, as far as that is better: no swap of one for one goes there.
fn one_by_one(surviving: &Surviving, candidates: &Candidates, noise: NoisePrior, explored: &mut Explored) {
    let Some(best) = explored.best().cloned() else {
        return;
    };
    let shape = |member: usize| candidates.hypotheses[member].shape;
    if !best.members.iter().any(|(member, _)| shape(*member) == Shape::AllYield) {
        return;
    }
    let alone = |member: usize| candidates.active[member] && matches!(shape(member), Shape::Torque(_));
    let mut members: Vec<(usize, usize)> =
        best.members.iter().copied().filter(|(member, _)| shape(*member) != Shape::AllYield).collect();
    for member in (0..candidates.hypotheses.len()).filter(|member| alone(*member)) {
        if !members.iter().any(|(known, _)| candidates.exclude(*known, member)) {
            members.push((member, 0));
        }
    }
    let value = |members: &[(usize, usize)]| log_posterior(surviving, candidates, noise, members);
    let mut now = value(&members);
    loop {
        explored.add(Model { members: members.clone(), log_posterior: now });
        let mut tries: Vec<Vec<(usize, usize)>> = Vec::new();
        for at in 0..members.len() {
            let mut fewer = members.clone();
            fewer.remove(at);
            tries.push(fewer);
            for scale in (0..SCALES.len()).filter(|scale| *scale != members[at].1) {
                let mut other = members.clone();
                other[at].1 = scale;
                tries.push(other);
            }
        }
        let valued = tries.into_iter().map(|members| (value(&members), members));
        match valued.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((better, next)) if better > now + 1e-9 => (now, members) = (better, next),
            _ => break,
        }
    }
}

/// The members in the order in which each adds most to what those before it explain.
fn in_order(
    surviving: &Surviving,
    candidates: &Candidates,
    noise: NoisePrior,
    members: &[(usize, usize)],
) -> Vec<(usize, usize)> {
    let mut left = members.to_vec();
    let mut ordered: Vec<(usize, usize)> = Vec::new();
    while !left.is_empty() {
        let value = |member: &(usize, usize)| {
            let mut with = ordered.clone();
            with.push(*member);
            log_posterior(surviving, candidates, noise, &with)
        };
        let values: Vec<f64> = left.iter().map(value).collect();
        let next = (0..left.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        ordered.push(left.remove(next));
    }
    ordered
}
