//! The hypotheses in play: the columns that they have in the linear problem, and their prior odds.

use std::collections::{BTreeMap, BTreeSet};

use super::evidence::Candidates;
use super::settings::Prior;
use crate::effects::Kind;
use crate::effects::signature::library::Hypothesis;
use crate::effects::signature::shape::Family;

/// The hypotheses with places for their columns; magnitudes are in units of the middle of what is realistic.
/// `scanned`: those that scans have found.
pub(super) fn candidates(mut hypotheses: Vec<Hypothesis>, scanned: Vec<Hypothesis>) -> Candidates {
    let from = hypotheses.len();
    hypotheses.extend(scanned);
    let mut first = Vec::new();
    let mut columns = 0;
    for hypothesis in &hypotheses {
        first.push(columns);
        columns += hypothesis.spread.len();
    }
    let unit = hypotheses.iter().map(|hypothesis| libm::sqrt(hypothesis.range[0] * hypothesis.range[1])).collect();
    let count = hypotheses.len();
    Candidates { hypotheses, first, unit, log_odds: vec![0.0; count], active: vec![true; count], scanned: from }
}

/// A class of hypotheses that share one prior: a kind, or a family of shapes without a name.
type Class = (Option<Kind>, Option<Family>);

fn class(hypothesis: &Hypothesis) -> Class {
    match hypothesis.kind {
        Some(kind) => (Some(kind), None),
        None => (None, hypothesis.shape.unnamed().map(|(family, _)| family)),
    }
}

/// Which hypotheses have information (`information`: of each, the trace of what survives of it), and their prior odds: equal for all kinds, for all places of a kind, for all variants at a
/// place; shapes without a name share a part.
pub(super) fn weigh(candidates: &mut Candidates, information: &[f64], prior: &Prior) {
    let count = candidates.hypotheses.len();
    for number in 0..count {
        let information = information[number];
        let largest = candidates.hypotheses[number].range[1] / candidates.unit[number];
        candidates.active[number] = information * largest * largest >= prior.no_information;
    }
    let active: Vec<usize> = (0..count).filter(|number| candidates.active[*number]).collect();
    let hypotheses = &candidates.hypotheses;
    let mut classes: [BTreeSet<Class>; 2] = Default::default();
    let mut places: BTreeMap<Class, BTreeMap<Option<usize>, usize>> = BTreeMap::new();
    let joints = hypotheses.iter().filter_map(|hypothesis| hypothesis.location.index).max().unwrap_or(1);
    for number in &active {
        let class = class(&hypotheses[*number]);
        classes[usize::from(class.0.is_some())].insert(class);
        *places.entry(class).or_default().entry(hypotheses[*number].location.index).or_default() += 1;
    }
    let mut log_odds = vec![f64::NEG_INFINITY; count];
    for number in &active {
        let class = class(&hypotheses[*number]);
        let of_class = &places[&class];
        let variants = of_class[&hypotheses[*number].location.index] as f64;
        let named = class.0.is_some();
        let share = if named { 1.0 - prior.unnamed } else { prior.unnamed };
        let count = classes[usize::from(named)].len() as f64;
        let own = hypotheses[*number].share.unwrap_or(1.0 / variants);
        // A scan went over all joints, whatever it found.
        let of_class = if hypotheses[*number].share.is_some() && !named { joints } else { of_class.len() };
        log_odds[*number] = libm::log(prior.odds * share * own / (count * of_class as f64));
    }
    candidates.log_odds = log_odds;
}

/// Logarithm of the prior odds that one of `joints` joints does what no hypothesis of `candidates` says: a class more of shapes without a name.
pub(super) fn odds_of_one_more_unnamed(candidates: &Candidates, joints: usize, prior: &Prior) -> f64 {
    let nameless = candidates.hypotheses.iter().zip(&candidates.active).filter(|(of, active)| **active && of.kind.is_none());
    let classes: BTreeSet<Class> = nameless.map(|(of, _)| class(of)).collect();
    libm::log(prior.odds * prior.unnamed / ((classes.len() + 1) * joints) as f64)
}
