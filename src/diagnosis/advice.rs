//! What to measure next.

use super::Analysis;
use super::detectability::Detectability;
use super::outcome::{Candidate, Verdict};
use crate::effects::{Kind, Need};

/// What tells linear from saturating effects of load.
const PAYLOADS: &str =
    "linear and saturating effects of load look alike under one payload: the same configurations with two or three payloads";

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
        let has = |kind: Kind| set.iter().any(|one| one.kind == Some(kind));
        if has(Kind::JointCompliance) && has(Kind::LinkBending) {
            say("compliance or bending: load the arm sideways, tilt the base, or put a target on a link in between");
        }
        if (has(Kind::LinkBending) && has(Kind::TiltClearance)) || has(Kind::JointCompliance) || has(Kind::GravityLostMotion) {
            say(PAYLOADS);
        }
        if has(Kind::LinkThermalGrowth) || has(Kind::JointThermalDrift) || has(Kind::BaseDrift) {
            say("temperature or time: heat and cool in one session, so that temperatures return while time goes on");
        }
        if has(Kind::JointEccentricity) || has(Kind::GearCoupling) {
            say("harmonics of a joint: move it through its whole travel, other joints at rest");
        }
        if has(Kind::BaseStep) || has(Kind::ToolStep) {
            say("base or tool: read the same few configurations again with another orientation of the tool");
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
        say(PAYLOADS);
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
