//! The verdict in a sentence, and the words that it is made of.

use super::detectability::Detectability;
use super::outcome::{Candidate, Effect, Gap, NoiseSource, Place, Unknown, Verdict};
use crate::effects::{Kind, Location};

/// The verdict in a sentence.
pub(super) fn sentence(
    verdict: Verdict,
    effects: &[Effect],
    sets: &[Vec<Candidate>],
    unknown: &Unknown,
    gap: &Gap,
    power: &Detectability,
    sure: f64,
) -> String {
    let names = |effects: &[Effect]| {
        // Two ripples of one joint are one cause.
        let mut names: Vec<String> = Vec::new();
        for effect in effects {
            let name = format!("{} ({:.0} %)", of_place(effect.kind.name(), &effect.location), 100.0 * effect.probability);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    };
    let list = |effects: &[Effect]| names(effects).join(", ");
    let um = |metres: f64| format!("{:.0} µm", metres * 1e6);
    match verdict {
        Verdict::NoGap => format!(
            "No gap: geometry explains the readings down to {} RMS on held-out poses, and {:.0} % of what is looked for would have \
             shown at a realistic size.{}",
            um(gap.geometry_rms_m),
            100.0 * power.share,
            nowhere(power)
        ),
        Verdict::NotDetectable => format!(
            "Nothing is seen, but only {:.0} % of what is looked for would have shown at a realistic size: these readings cannot tell.",
            100.0 * power.share
        ),
        Verdict::Explained => format!(
            "Explained by {}: held-out RMS {} with geometry, {} with the cause{}.",
            list(effects),
            um(gap.geometry_rms_m),
            um(gap.explained_rms_m),
            if names(effects).len() > 1 { "s" } else { "" }
        ),
        Verdict::Ambiguous => {
            let candidates: Vec<String> = sets
                .first()
                .into_iter()
                .flatten()
                .take(3)
                .map(|one| format!("{} ({:.0} %)", of_place(one.kind_name(), &one.location), 100.0 * one.probability))
                .collect();
            if names(effects).len() > 1 {
                format!(
                    "Several causes, not all settled (below {:.0} %): {}; held-out RMS {} with geometry, {} with the causes.",
                    100.0 * sure,
                    list(effects),
                    um(gap.geometry_rms_m),
                    um(gap.explained_rms_m)
                )
            } else if candidates.is_empty() {
                format!("Something is there that is not settled: {}.", list(effects))
            } else {
                format!("Something is there, and these readings cannot tell which it is: {}.", candidates.join(" or "))
            }
        }
        Verdict::UnknownRemains => {
            let place = unknown.r#where.clone().unwrap_or_default();
            if effects.is_empty() {
                format!("Something is there that no effect of the library explains: {place}.")
            } else {
                format!("Besides {}, something remains that no effect of the library explains: {place}.", list(effects))
            }
        }
    }
}

/// Kinds that would have shown at no place.
fn nowhere(power: &Detectability) -> String {
    let seen = |kind: Kind| power.detectable.iter().any(|one| one.kind == kind);
    let mut blind: Vec<String> =
        power.undetectable.iter().filter(|one| !seen(one.kind)).map(|one| one.kind.name().replace('_', " ")).collect();
    blind.sort();
    blind.dedup();
    if blind.is_empty() { String::new() } else { format!(" Nowhere to be seen would have been: {}.", blind.join(", ")) }
}

/// A kind at a place, in words.
pub(super) fn words(kind: &str, location: &Location) -> String {
    format!("{} of {location}", kind.replace('_', " "))
}

fn of_place(kind: &str, place: &Place) -> String {
    let words = words(kind, &Location { level: place.level, index: place.index });
    match place.time_s {
        Some(time) => format!("{words} at {time:.0} s"),
        None => words,
    }
}

/// Whose noise it is.
pub(super) fn whose(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Repeats => "repeats'",
        NoiseSource::Declared => "declared",
        NoiseSource::Assumed => "assumed",
    }
}
