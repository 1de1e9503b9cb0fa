//! The library of effects, and how well the simulated arm obeys statics, as tables.

use serde_json::{Value, json};

use super::table;
use crate::effects::{Kind, Level};
use crate::lab::effect_validation::{Line, MARK_M, MARK_POSES_PER_S, MARK_RELATIVE, MARK_SETTLING_M};
use crate::scene::effect_file::{KINDS, KindKeys};
use crate::units::number;

/// An effect that a scene may inject: kind, where it sits, unit of its magnitude, and what is realistic at about 1 m of reach.
struct Entry {
    kind: &'static str,
    place: &'static str,
    unit: &'static str,
    range: &'static str,
    known: bool,
}

/// Realistic ranges: `../shared/design/effects.md`, where they are quoted from the calibration literature and data sheets.
fn range(kind: Kind) -> &'static str {
    match kind {
        Kind::JointCompliance => "1.7–100·10⁻⁵ (base), 6.7–50·10⁻⁵ (wrist): 1–6 and 0.2–1.5·10⁴ N·m/rad",
        Kind::LinkBending => "0.5–5·10⁻⁵",
        Kind::Backlash | Kind::GravityLostMotion => "1–6·10⁻⁴ (20–120 arcsec)",
        Kind::JointEccentricity => "0.5–5·10⁻⁴ (10–100 arcsec)",
        Kind::StrainWaveError => "0.4–2·10⁻⁴ (8–40 arcsec)",
        Kind::GearCoupling => "5–40·10⁻⁵",
        Kind::LinkThermalGrowth => "12–24·10⁻⁶",
        Kind::JointThermalDrift => "3–30·10⁻⁶",
        Kind::RadialClearance => "10–60·10⁻⁶",
        Kind::TiltClearance => "20–200·10⁻⁶",
        Kind::BaseDrift | Kind::BaseStep => "15–80·10⁻⁶",
        Kind::ToolStep => "0.05–0.5·10⁻³",
        Kind::MeasurementScale => "10–100·10⁻⁶",
        Kind::MeasurementOutliers => "0.01–0.1",
    }
}

/// Kinds that the diagnosis has no name for: kind, place, unit, range.
const UNNAMED: [(&str, &str, &str, &str); 6] = [
    ("worn_tooth_sector", "joint", "rad", "2–10·10⁻⁴"),
    ("creep_after_motion", "joint", "rad/(N·m)", "0.2–2·10⁻⁵"),
    ("moment_crosstalk", "joint", "rad/(N·m)", "1–10·10⁻⁶"),
    ("memory_hysteresis", "joint", "rad", "1–6·10⁻⁴"),
    ("wrong_payload", "tool", "kg", "0.2–3"),
    ("hardening_stiffness", "joint", "rad/(N·m)", "as joint_compliance"),
];

fn entries() -> Vec<Entry> {
    let place = |level| match level {
        Level::Joint => "joint",
        Level::Link => "link",
        Level::Base => "base or sensor",
        Level::Tool => "tool",
        Level::Sensor => "sensor",
    };
    let known = Kind::ALL.into_iter().map(|kind| Entry {
        kind: kind.name(),
        place: place(kind.level()),
        unit: kind.unit(),
        range: range(kind),
        known: true,
    });
    let unnamed = UNNAMED.into_iter().map(|(kind, place, unit, range)| Entry { kind, place, unit, range, known: false });
    known.chain(unnamed).collect()
}

/// All effects.
#[must_use]
pub fn library() -> String {
    let row = |entry: &Entry| {
        let named = if entry.known { "yes" } else { "no" };
        [entry.kind, entry.place, entry.unit, entry.range, named].map(str::to_owned).to_vec()
    };
    let rows = entries().iter().map(row).collect();
    let keys = KINDS.iter().map(|kind| vec![kind.kind.to_owned(), kind.keys(), kind.about.to_owned()]).collect();
    format!(
        "Effects that a scene can inject ([[injected.effect]]); true pose = pose at the readings + effect.\n{}\n\
         Magnitudes are those of results, in SI; a scene's keys carry their own units. Backlash and lost motion: full width; \
         clearances: radius; drift and steps: length of the translation; outliers: share of the readings.\n\n\
         Keys of a table [[injected.effect]], besides kind; [in brackets]: may be left out.\n{}",
        table(&["kind", "place", "unit", "realistic", "known to the diagnosis"], rows),
        table(&["kind", "keys", "what happens"], keys)
    )
}

/// The same for a machine.
#[must_use]
pub fn library_json() -> Value {
    let entry = |entry: &Entry| {
        json!({
            "kind": entry.kind,
            "place": entry.place,
            "unit": entry.unit,
            "realistic": entry.range,
            "known_to_the_diagnosis": entry.known,
        })
    };
    let keys = |kind: &KindKeys| json!({ "kind": kind.kind, "keys": kind.keys(), "about": kind.about });
    json!({
        "effects": entries().iter().map(entry).collect::<Vec<_>>(),
        "scene_keys": KINDS.iter().map(keys).collect::<Vec<_>>(),
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
