//! The library of effects, and how well the simulated arm obeys statics, as tables.

use serde_json::{Value, json};

use crate::effects::Kind;
use crate::effects::catalogue::{needs, place, range};
use crate::lab::effect_validation::{Line, MARK_M, MARK_POSES_PER_S, MARK_RELATIVE, MARK_SETTLING_M};
use crate::report::table;
use crate::scene::effect_file;
use crate::units::number;

/// All effects.
#[must_use]
pub fn library() -> String {
    let row = |kind: Kind| {
        let of = kind.descriptor();
        let named = if of.known.is_some() { "yes" } else { "no" };
        let needs = needs(kind);
        [of.name, place(of.level), of.unit.name(), of.magnitude, &range(of.range), &needs, named].map(str::to_owned).to_vec()
    };
    let rows = Kind::ALL.map(row).to_vec();
    let sources = Kind::ALL.map(|kind| vec![kind.name().to_owned(), kind.descriptor().source.words().to_owned()]).to_vec();
    let neighbour = |kind: Kind| {
        let others = kind.descriptor().neighbours.iter();
        others.map(move |other| [kind.name(), other.kind.name(), other.told_apart_by].map(str::to_owned).to_vec())
    };
    let neighbours = Kind::known().flat_map(neighbour).collect();
    let keys =
        effect_file::kinds().map(|(kind, keys, about)| vec![kind.to_owned(), keys.in_a_line(), about.to_owned()]).collect();
    format!(
        "Effects that a scene can inject ([[injected.effect]]); true pose = pose at the readings + effect.\n{}\n\
         Magnitudes are those of results, in SI; a scene's keys carry their own units.\n\n\
         Where the realistic ranges come from.\n{}\n\
         What is mistaken for what.\n{}\n\
         Keys of a table [[injected.effect]], besides kind; [in brackets]: may be left out.\n{}",
        table(&["kind", "place", "unit", "magnitude", "realistic", "the data must have", "known to the diagnosis"], rows),
        table(&["kind", "source"], sources),
        table(&["kind", "mistaken for", "told apart by"], neighbours),
        table(&["kind", "keys", "what happens"], keys)
    )
}

/// The same for a machine.
#[must_use]
pub fn library_json() -> Value {
    let entry = |kind: Kind| {
        let of = kind.descriptor();
        let neighbours = of.neighbours.iter();
        json!({
            "kind": of.name,
            "about": of.about,
            "place": place(of.level),
            "unit": of.unit.name(),
            "magnitude": of.magnitude,
            "realistic": range(of.range),
            "source": of.source.words(),
            "needs": of.needs.iter().map(|need| need.words()).collect::<Vec<_>>(),
            "one_signed": of.one_signed,
            "known_to_the_diagnosis": of.known.is_some(),
            "neighbours": neighbours
                .map(|other| json!({ "kind": other.kind.name(), "told_apart_by": other.told_apart_by }))
                .collect::<Vec<_>>(),
        })
    };
    let keys = |(kind, keys, about): (&str, crate::effects::SceneKeys, &str)| json!({ "kind": kind, "keys": keys.in_a_line(), "about": about });
    json!({
        "effects": Kind::ALL.map(entry).to_vec(),
        "scene_keys": effect_file::kinds().map(keys).collect::<Vec<_>>(),
    })
}

/// The table of the validation, with the marks.
#[must_use]
pub fn validation(lines: &[Line]) -> String {
    let um = |value: f64| if value > 0.0 && value < 1e-10 { "<0.0001".to_owned() } else { number(value * 1e6) };
    let row = |line: &Line| {
        vec![
            line.name.clone(),
            line.magnitude.clone(),
            um(line.displacement_rms_m),
            um(line.largest_m),
            um(line.median_m),
            if line.largest_relative < 1e-6 { "<0.0001".to_owned() } else { number(line.largest_relative * 100.0) },
            um(line.settling_error_m),
            um(line.first_order_misses_m),
            line.undecided.to_string(),
            format!("{:.0}", line.poses_per_s),
            if line.good { "met" } else { "MISSED" }.to_owned(),
        ]
    };
    let header = [
        "effect",
        "magnitude and place",
        "rms µm",
        "off, max µm",
        "median µm",
        "max %",
        "settling µm",
        "1st order misses µm",
        "undecided",
        "poses/s",
        "marks",
    ];
    format!(
        "Displacement of the tool by each effect, simulated against an independent solution.\n{}\n\
         off: simulated minus independent (statics on the displaced arm); %: of the rms; 1st order misses: largest, against the \
         converged independent solution; undecided: poses in which friction holds a play in its middle, as no load decides.\n\
         Marks: off by at most {:.0} % or {:.0} µm in every pose, settling error below {} µm, {:.0} poses/s on one core with any one \
         effect.\n{}",
        table(&header, lines.iter().map(row).collect()),
        MARK_RELATIVE * 100.0,
        MARK_M * 1e6,
        MARK_SETTLING_M * 1e6,
        MARK_POSES_PER_S,
        verdict(lines)
    )
}

fn verdict(lines: &[Line]) -> String {
    let missed: Vec<&str> = lines.iter().filter(|line| !line.good).map(|line| line.name.as_str()).collect();
    if missed.is_empty() { "All marks are met.".to_owned() } else { format!("Missed by: {}.", missed.join(", ")) }
}
