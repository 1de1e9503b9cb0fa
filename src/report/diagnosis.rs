//! A diagnosis for people: the verdict in a sentence, the waterfall, the causes, where, and what to measure next.

use super::table;
use super::wording::blocks;
use crate::diagnosis::outcome::{Candidate, Diagnosis, Map, NoiseSource, Place};
use crate::effects::{Kind, Level, Location};
use crate::units::number;

/// The whole report.
#[must_use]
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut text = answer(diagnosis);
    text.push_str("\nWhat remains along each joint's motion, over its travel in eight parts, low to high\n(△ ▲ one way, ▽ ▼ the other, by three and by six standard errors; · by less):\n");
    for map in &diagnosis.maps {
        text.push_str(&format!("  joint {:<2} {}\n", map.joint, picture(map)));
    }
    if !diagnosis.undetectable.is_empty() {
        text.push_str(&format!("\nNot to be seen in these readings: {}.\n", blind(diagnosis)));
    }
    if !diagnosis.next_measurements.is_empty() {
        text.push_str("\nMeasure next:\n");
        for next in &diagnosis.next_measurements {
            text.push_str(&format!("  - {next}\n"));
        }
    }
    for note in &diagnosis.notes {
        text.push_str(&format!("Note: {note}.\n"));
    }
    text
}

/// The answer alone: the verdict in a sentence, the waterfall, the causes or what cannot be told apart, and what remains unknown.
#[must_use]
pub fn answer(diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n\n", diagnosis.sentence);
    text.push_str(&waterfall(diagnosis));
    if !diagnosis.effects.is_empty() {
        text.push('\n');
        text.push_str(&table(&CAUSES, causes(diagnosis)));
        text.push('\n');
    }
    for set in &diagnosis.confusion_sets {
        text.push_str("\nThese cannot be told apart:\n");
        text.push_str(&table(&CANDIDATES, candidates(set)));
        text.push('\n');
    }
    if diagnosis.unknown.present {
        let place = diagnosis.unknown.r#where.clone().unwrap_or_default();
        text.push_str(&format!("\nUnknown: {place} ({}).\n", p(diagnosis.unknown.p_value)));
    }
    text
}

/// A p-value in words.
pub(crate) fn p(value: f64) -> String {
    if value < 1e-12 { "p < 1e-12".to_owned() } else { format!("p = {}", number(value)) }
}

fn um(metres: f64) -> String {
    number(metres * 1e6)
}

/// A step of the waterfall.
pub(crate) struct Step {
    /// What is modelled so far.
    pub(crate) name: String,
    /// 3-D position RMS on held-out poses, m.
    pub(crate) rms_m: f64,
    /// Position in `effects` of the cause that this step adds.
    #[cfg_attr(not(feature = "viewer"), expect(dead_code, reason = "text needs no colour"))]
    pub(crate) effect: Option<usize>,
}

/// The steps from the nominal model to the noise.
pub(crate) fn steps(diagnosis: &Diagnosis) -> Vec<Step> {
    let gap = &diagnosis.gap;
    let source = match diagnosis.noise_floor.source {
        NoiseSource::Repeats => "from repeats",
        NoiseSource::Declared => "declared",
        NoiseSource::Assumed => "assumed",
    };
    let step = |name: &str, rms_m| Step { name: name.to_owned(), rms_m, effect: None };
    let mut steps = vec![step("nominal (base and tool fitted)", gap.nominal_rms_m), step("geometry", gap.geometry_rms_m)];
    for (number, effect) in diagnosis.effects.iter().enumerate() {
        if effect.held_out_rms_after_m != effect.held_out_rms_before_m {
            let name = format!("+ {} {}", effect.kind, place(&effect.location));
            steps.push(Step { name, rms_m: effect.held_out_rms_after_m, effect: Some(number) });
        }
    }
    steps.push(step("all that each fold uses", gap.explained_rms_m));
    steps.push(step(&format!("noise floor ({source})"), gap.noise_rms_m));
    steps
}

fn waterfall(diagnosis: &Diagnosis) -> String {
    let gap = &diagnosis.gap;
    let most = gap.geometry_rms_m.max(gap.explained_rms_m).max(gap.noise_rms_m).max(1e-12);
    // In proportion; what geometry takes is out of it.
    let bar = |value: f64| {
        let length = (24.0 * value / most).round().clamp(1.0, 24.0);
        let beyond = if value > 1.02 * most { "…" } else { "" };
        format!("{}{beyond}", "█".repeat(length as usize))
    };
    let rows = steps(diagnosis).into_iter().map(|step| vec![step.name, um(step.rms_m), bar(step.rms_m)]).collect();
    let mut text = table(&[&format!("held out, {} folds", gap.folds), "RMS, µm", ""], rows);
    text.push('\n');
    for other in &gap.blocked {
        let by = blocks(other.by);
        let of_fold: Vec<String> = other
            .left_out
            .iter()
            .map(|one| format!("{} {} → {}", one.name, um(one.geometry_rms_m), um(one.explained_rms_m)))
            .collect();
        text.push_str(&format!(
            "Whole {by} left out: {} → {} µm ({}).\n",
            um(other.geometry_rms_m),
            um(other.explained_rms_m),
            of_fold.join("; ")
        ));
    }
    if let Some(closed) = gap.gap_closed {
        let interval = gap
            .gap_closed_ci95
            .map(|[low, high]| format!(" (95 %: {:.0} to {:.0} %)", 100.0 * low, 100.0 * high))
            .unwrap_or_default();
        text.push_str(&format!("Of the gap between geometry and noise, {:.0} % is closed{interval}.\n", 100.0 * closed));
    }
    text
}

/// Head of the table of causes.
pub(crate) const CAUSES: [&str; 8] = ["cause", "where", "probability", "magnitude", "95 %", "of its gap", "folds", ""];

/// Its rows, one per effect.
pub(crate) fn causes(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    diagnosis
        .effects
        .iter()
        .map(|effect| {
            let magnitude = &effect.magnitude;
            let (unit, factor) = shown(&magnitude.unit);
            vec![
                effect.kind.to_string(),
                place(&effect.location),
                format!("{:.1} %", 100.0 * effect.probability),
                format!("{} {unit}", number(magnitude.value * factor)),
                format!("{} to {}", number(magnitude.ci95[0] * factor), number(magnitude.ci95[1] * factor)),
                effect.gap_closed.map_or_else(|| "–".to_owned(), |closed| format!("{:.0} %", 100.0 * closed)),
                format!("{} of {}", effect.folds[0], effect.folds[1]),
                effect.detail.clone(),
            ]
        })
        .collect()
}

/// A unit for people, and the factor to it.
fn shown(unit: &str) -> (&str, f64) {
    match unit {
        "m" => ("µm", 1e6),
        "rad" => ("µrad", 1e6),
        "rad/(N·m)" => ("µrad/(N·m)", 1e6),
        "rad/rad" => ("µrad/rad", 1e6),
        "1/K" => ("µm/(m·K)", 1e6),
        "rad/K" => ("µrad/K", 1e6),
        "1" => ("%", 1e2),
        other => (other, 1.0),
    }
}

/// A place in words.
pub(crate) fn place(place: &Place) -> String {
    let at = Location { level: place.level, index: place.index };
    match place.when() {
        Some(when) => format!("{at}, {when}"),
        None => at.to_string(),
    }
}

/// Head of the table of a confusion set.
pub(crate) const CANDIDATES: [&str; 4] = ["kind", "where", "probability", ""];

/// Its rows, one per hypothesis.
pub(crate) fn candidates(set: &[Candidate]) -> Vec<Vec<String>> {
    set.iter()
        .map(|one| {
            vec![
                one.kind_name().to_owned(),
                place(&one.location),
                format!("{:.1} %", 100.0 * one.probability),
                one.detail.clone(),
            ]
        })
        .collect()
}

/// A map as a line: 0 to 4 steps of two standard errors above or below nothing.
fn picture(map: &Map) -> String {
    let mut text = String::new();
    for (mean, error) in map.mean.iter().zip(&map.standard_error) {
        let steps = if *error > 0.0 { mean / (2.0 * error) } else { 0.0 };
        text.push(match steps {
            steps if steps >= 3.0 => '▲',
            steps if steps >= 1.5 => '△',
            steps if steps <= -3.0 => '▼',
            steps if steps <= -1.5 => '▽',
            _ => '·',
        });
    }
    text
}

/// Kinds with the places at which they cannot be seen.
fn blind(diagnosis: &Diagnosis) -> String {
    let mut kinds: Vec<(Kind, Vec<String>)> = Vec::new();
    // What was seen although four of five such arms would not have shown it, was seen.
    let seen = |kind, place| diagnosis.effects.iter().any(|effect| effect.kind == kind && effect.location == place);
    for one in diagnosis.undetectable.iter().filter(|one| !seen(one.kind, one.location)) {
        let whole = if one.location.level == Level::Link { "whole arm" } else { "" };
        let index = one.location.index.map_or_else(|| whole.to_owned(), |index| index.to_string());
        match kinds.iter_mut().find(|(kind, _)| *kind == one.kind) {
            Some((_, places)) => places.push(index),
            None => kinds.push((one.kind, vec![index])),
        }
    }
    let said: Vec<String> =
        kinds.iter().map(|(kind, places)| format!("{kind} {}", places.join(", ")).trim().to_owned()).collect();
    said.join("; ")
}
