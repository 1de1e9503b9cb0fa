//! What to measure next.

use std::collections::BTreeSet;

use super::Analysis;
use super::detectability::Detectability;
use super::outcome::{Candidate, Verdict};
use crate::effects::{Advice, Kind, Measure, Need};

/// What would tell apart what these readings do not, and show what they could not.
pub(super) fn next(analysis: &Analysis<'_>, sets: &[Vec<Candidate>], power: &Detectability, verdict: Verdict) -> Vec<String> {
    let mut said: Vec<String> = Vec::new();
    let mut say = |text: &str| {
        if !said.iter().any(|known| known == text) {
            said.push(text.to_owned());
        }
    };
    let columns = &analysis.conditions.columns;
    for set in sets {
        let kinds: BTreeSet<Kind> = set.iter().filter_map(|one| one.kind).collect();
        let advice = kinds.iter().filter_map(|kind| kind.descriptor().known).flat_map(|known| known.advice);
        let measures = advice.filter_map(|advice| match *advice {
            Advice::Alone(measure) => Some(measure),
            Advice::Beside(other, measure) => kinds.contains(&other).then_some(measure),
        });
        for measure in measures.collect::<BTreeSet<Measure>>() {
            say(measure.words());
        }
        if set.iter().any(|one| one.kind.is_none()) {
            say("a shape without a name: more configurations where it shows");
        }
    }
    for one in &analysis.scatter {
        say(&format!(
            "joint {}: read a few configurations many times, with a move of this joint alone between, from both sides in turn, and record \
             the side",
            one.joint + 1
        ));
    }
    // What these readings could not have shown, whatever they did show.
    let places = |kind: Kind| -> Vec<String> {
        let of_kind = power.undetectable.iter().filter(|one| one.kind == kind && one.minimum_detectable.value.is_none());
        of_kind.filter_map(|one| one.location.index).map(|index| index.to_string()).collect()
    };
    if !columns.approach {
        say(
            "backlash could not show: record from which side each joint was approached (columns approach1, …), and use both sides",
        );
    } else {
        let joints = places(Kind::Backlash);
        if !joints.is_empty() {
            say(&format!(
                "backlash of joint {} could not show, for it was always approached from the same side: approach it from both",
                joints.join(", ")
            ));
        }
    }
    if !power.detectable.iter().any(|one| one.kind.descriptor().needs.contains(&Need::Temperatures)) {
        let known = analysis.measurements.iter().any(|row| row.ambient_c.is_some() || !row.temperatures_c.is_empty());
        say(if known {
            "thermal effects could not show, for the temperature hardly changed: let the arm warm up and cool down in one session"
        } else {
            "thermal effects could not show: record temperatures (temp_ambient_c, temp1_c, …) while the arm warms up and cools down"
        });
    }
    let payload = analysis.measurements.first().and_then(|row| row.payload_kg);
    if analysis.measurements.iter().all(|row| row.payload_kg == payload) {
        say(Measure::Payloads.words());
    }
    if verdict != Verdict::Explained {
        if analysis.repeats.is_none() {
            say("read some configurations twice, approached alike: repeats tell the noise");
        }
        if verdict == Verdict::NotDetectable {
            say("more configurations, or a sensor with less noise");
        }
    }
    said
}
