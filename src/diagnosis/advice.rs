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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::outcome::Place;
    use crate::diagnosis::scatter::Scatter;
    use crate::diagnosis::tests::with_analysis;
    use crate::effects::Level;
    use crate::measurement::Measurement;

    fn one(kind: Option<Kind>) -> Candidate {
        let location = Place::of(Level::Joint, Some(2));
        Candidate { kind, location, probability: 0.5, detail: String::new() }
    }

    fn nothing_seen() -> Detectability {
        Detectability { undetectable: Vec::new(), detectable: Vec::new(), share: 0.0 }
    }

    #[test]
    fn what_was_recorded_is_not_asked_for_again() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                // Sides and two payloads are there, temperatures and repeats are not.
                let asked = next(&analysis, &[], &nothing_seen(), Verdict::NotDetectable);
                assert_eq!(asked, [Advice::RecordTemperatures, Advice::ReadTwice, Advice::MoreReadings]);
                let with_air = |row: &&Measurement| Measurement { ambient_c: Some(20.0), ..(*row).clone() };
                // As long as the analysis, which borrows them.
                let rows: &'static [Measurement] = analysis.measurements.iter().map(with_air).collect::<Vec<_>>().leak();
                analysis.measurements = rows.iter().collect::<Vec<_>>().leak();
                assert_eq!(next(&analysis, &[], &nothing_seen(), Verdict::Explained), [Advice::WarmUp]);
            },
        );
    }

    #[test]
    fn what_tells_a_set_apart_is_asked_for_once() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                analysis.scatter = vec![Scatter { joint: 4, sigma: 1e-3, log_odds: 9.0 }];
                let sets = vec![vec![one(Some(Kind::JointEccentricity)), one(None)], vec![one(None)]];
                let asked = next(&analysis, &sets, &nothing_seen(), Verdict::Explained);
                let count = |advice: &Advice| asked.iter().filter(|one| *one == advice).count();
                assert_eq!((count(&Advice::MoreWhereItShows), count(&Advice::Repeat { joint: 5 })), (1, 1), "{asked:?}");
                assert_eq!(asked.len(), asked.iter().filter(|one| count(one) == 1).count());
            },
        );
    }
}
