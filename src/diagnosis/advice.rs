//! What to measure next.

use std::collections::BTreeSet;

use super::Analysis;
use super::conclusion::Advice;
use super::detectability::Detectability;
use super::outcome::{Candidate, Verdict};
use crate::effects::{self, Kind, Measure, Need};

/// What would tell apart what these readings do not, and show what they could not.
pub(super) fn next(analysis: &Analysis<'_>, sets: &[Vec<Candidate>], power: &Detectability, verdict: Verdict) -> Vec<Advice> {
    let mut all: Vec<Advice> = Vec::new();
    let mut add = |advice: Advice| {
        if !all.contains(&advice) {
            all.push(advice);
        }
    };
    let columns = &analysis.conditions.columns;
    for set in sets {
        let kinds: BTreeSet<Kind> = set.iter().filter_map(|one| one.kind).collect();
        let advice = kinds.iter().filter_map(|kind| kind.descriptor().known).flat_map(|known| known.advice);
        let measures = advice.filter_map(|advice| match *advice {
            effects::Advice::Alone(measure) => Some(measure),
            effects::Advice::Beside(other, measure) => kinds.contains(&other).then_some(measure),
        });
        for measure in measures.collect::<BTreeSet<Measure>>() {
            add(Advice::Measure(measure));
        }
        if set.iter().any(|one| one.kind.is_none()) {
            add(Advice::MoreWhereItShows);
        }
    }
    for one in &analysis.scatter {
        add(Advice::Repeat { joint: one.joint + 1 });
    }
    // What these readings could not have shown, whatever they did show.
    let places = |kind: Kind| -> Vec<usize> {
        let of_kind = power.undetectable.iter().filter(|one| one.kind == kind && one.minimum_detectable.value.is_none());
        of_kind.filter_map(|one| one.location.index).collect()
    };
    if !columns.approach {
        add(Advice::RecordApproach);
    } else {
        let joints = places(Kind::Backlash);
        if !joints.is_empty() {
            add(Advice::BothSides { joints });
        }
    }
    if !power.detectable.iter().any(|one| one.kind.descriptor().needs.contains(&Need::Temperatures)) {
        let known = analysis.measurements.iter().any(|row| row.ambient_c.is_some() || !row.temperatures_c.is_empty());
        add(if known { Advice::WarmUp } else { Advice::RecordTemperatures });
    }
    let payload = analysis.measurements.first().and_then(|row| row.payload_kg);
    if analysis.measurements.iter().all(|row| row.payload_kg == payload) {
        add(Advice::Measure(Measure::Payloads));
    }
    if verdict != Verdict::Explained {
        if analysis.repeats.is_none() {
            add(Advice::ReadTwice);
        }
        if verdict == Verdict::NotDetectable {
            add(Advice::MoreReadings);
        }
    }
    all
}
