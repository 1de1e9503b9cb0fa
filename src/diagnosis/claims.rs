//! What the hypotheses of a set claim, and with what probability.

use super::Analysis;
use super::outcome::Place;
use crate::effects::signature::shape::Shape;
use crate::effects::{Kind, Location};

/// From this probability on something is named.
pub(super) const NAMED: f64 = 0.5;
/// From this probability on nothing else needs to be considered.
pub(super) const SURE: f64 = 0.95;

/// What a hypothesis claims: its kind (or none) and its place.
pub(super) type Claim = (Option<Kind>, Location);

/// What hypothesis number `hypothesis` claims.
pub(super) fn claim(analysis: &Analysis<'_>, hypothesis: usize) -> Claim {
    let hypothesis = &analysis.candidates.hypotheses[hypothesis];
    (hypothesis.kind, hypothesis.location)
}

/// Probability that a model holds a member that fulfils `test`.
pub(super) fn probability(analysis: &Analysis<'_>, test: impl Fn(usize) -> bool) -> f64 {
    let holds = |members: &[(usize, usize)]| members.iter().any(|(hypothesis, _)| test(*hypothesis));
    analysis.found.models.iter().filter(|(members, _)| holds(members)).map(|(_, weight)| weight).sum::<f64>().min(1.0)
}

/// What parts of the data prefer to a claim of the best set: the folds whose best set lacks it and holds a claim that the best set of all
/// data has not, each with by how much it prefers that one (difference of probabilities), as a share of all folds. A posterior given
/// all data is too sure of the least wrong of wrong models; where parts of the data contradict it, the parts are believed (Huggins and
/// Miller 2023, "Reproducible model selection using bagged posteriors").
pub(super) fn rivals(analysis: &Analysis<'_>, this: Claim) -> Vec<(Claim, usize, f64)> {
    let best: Vec<Claim> = analysis.found.best.members.iter().map(|(member, _)| claim(analysis, *member)).collect();
    let folds = analysis.held_out.first().map_or(&[][..], |by_region| &by_region.folds);
    let mut found: Vec<(Claim, usize, f64)> = Vec::new();
    for fold in folds.iter().filter(|fold| !fold.chosen.iter().any(|other| claim(analysis, *other) == this)) {
        let Some(other) = fold.chosen.iter().copied().find(|other| !best.contains(&claim(analysis, *other))) else {
            continue;
        };
        let of = |one: Claim| -> f64 {
            let holds = |members: &[(usize, usize)]| members.iter().any(|(member, _)| claim(analysis, *member) == one);
            fold.models.iter().filter(|(members, _)| holds(members)).map(|(_, weight)| weight).sum()
        };
        let rival = claim(analysis, other);
        let share = (of(rival) - of(this)).max(0.0) / folds.len() as f64;
        match found.iter_mut().find(|(known, _, _)| *known == rival) {
            Some((_, _, sum)) => *sum += share,
            None => found.push((rival, other, share)),
        }
    }
    found
}

/// Where it is and, of a step, when.
pub(super) fn place(analysis: &Analysis<'_>, hypothesis: usize) -> Place {
    let of = &analysis.candidates.hypotheses[hypothesis];
    let time_s = match of.shape {
        Shape::BaseStep(at) | Shape::ToolStep(at) => analysis.conditions.times.get(at).copied(),
        _ => None,
    };
    Place { level: of.location.level, index: of.location.index, time_s }
}

/// The kind's name, or that it has none.
pub(super) fn kind_name(kind: Option<Kind>) -> String {
    kind.map_or_else(|| "unknown".to_owned(), |kind| kind.name().to_owned())
}
