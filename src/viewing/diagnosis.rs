//! What causes the rest: residuals by cause in the cell, the waterfall as bars, the report.

use nalgebra::Vector3;
use re_sdk_types::archetypes::{Arrows3D, LineStrips2D, Points2D, Points3D, TextDocument};
use re_sdk_types::components::Radius;
use rerun::{RecordingStream, RecordingStreamResult};

use super::body::point;
use super::picture::{metres, round};
use super::summary::significant;
use crate::diagnosis::outcome::{Diagnosis, Residual, Verdict};
use crate::report::diagnosis as report;

/// x and y ranges of the waterfall's drawing.
pub(super) const BOUNDS: [[f64; 2]; 2] = [[-2.0, 182.0], [-8.0, 84.0]];
/// Names stand left of the bars, which are so long at most.
const NAMES: f64 = 72.0;
const LONGEST: f64 = 84.0;
const HEIGHT: f64 = 80.0;
/// From one bar to the next, at most.
const PITCH: f64 = 14.0;
/// A bar is filled with so many lines: one thick line would have round ends.
const FILL: usize = 24;
const TEXT: [u8; 3] = [190, 194, 202];
const GRID: [u8; 3] = [70, 74, 82];
const NOMINAL: [u8; 3] = [240, 128, 84];
const GEOMETRY: [u8; 3] = [176, 188, 204];
const EXPLAINED: [u8; 3] = [72, 200, 150];
const NOISE: [u8; 3] = [120, 124, 134];
/// Of the causes, in turn: none is that of another bar.
const CAUSES: [[u8; 3]; 6] = [[255, 184, 56], [110, 170, 230], [200, 130, 220], [230, 100, 110], [190, 200, 90], [90, 200, 220]];
/// Of a reading that no named cause moves.
const UNNAMED: [u8; 3] = [132, 136, 144];

/// How the cell is looked at: its size, m, and what is up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    pub(super) stretch: f64,
    pub(super) up: Vector3<f64>,
}

fn colour(cause: Option<usize>) -> [u8; 3] {
    cause.map_or(UNNAMED, |cause| CAUSES[cause % CAUSES.len()])
}

/// Most of the way to white: what is left once the cause is taken away.
fn pale(colour: [u8; 3]) -> [u8; 3] {
    colour.map(|part| part / 4 + 191)
}

/// A panel that says that there is nothing yet.
pub(super) fn log_empty(stream: &RecordingStream) -> RecordingStreamResult<()> {
    stream.log("diagnosis/report", &TextDocument::from_markdown("nothing is diagnosed yet"))
}

/// Draws a diagnosis.
pub(super) fn log(stream: &RecordingStream, diagnosis: &Diagnosis, sight: Sight) -> RecordingStreamResult<()> {
    log_residuals(stream, diagnosis, sight)?;
    log_waterfall(stream, diagnosis)?;
    stream.log("diagnosis/report", &TextDocument::from_markdown(markdown(diagnosis)))
}

/// The causes, each with its name in words and in a path; what has none comes last.
fn causes(diagnosis: &Diagnosis) -> Vec<(Option<usize>, String, String)> {
    let mut causes: Vec<_> = diagnosis
        .effects
        .iter()
        .enumerate()
        .map(|(number, effect)| {
            let name = format!("{} {}", effect.kind, report::place(&effect.location));
            let path: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
            // Two may have one name: harmonics of several orders.
            (Some(number), name, format!("{}_{path}", number + 1))
        })
        .collect();
    causes.push((None, "no named cause".to_owned(), "unnamed".to_owned()));
    causes
}

/// Arrows before and after at each reading, an entity for each cause, so that it can be switched off. One scale for all: what the
/// causes have gained shows in the lengths.
fn log_residuals(stream: &RecordingStream, diagnosis: &Diagnosis, sight: Sight) -> RecordingStreamResult<()> {
    let residuals = &diagnosis.residuals;
    let mean = residuals.iter().map(|one| Vector3::from(one.before_m).norm()).sum::<f64>() / residuals.len().max(1) as f64;
    let scale = if mean > 0.0 && mean.is_finite() { round(0.1 * sight.stretch / mean) } else { 1.0 };
    let size = |share: f64| Radius::new_scene_units((share * sight.stretch) as f32);
    // Below the arm's top, row by row.
    let label = |row: usize, text: String, colour: [u8; 3]| {
        Points3D::new([point(&(sight.up * sight.stretch * (0.95 - 0.05 * row as f64)))])
            .with_labels([text])
            .with_show_labels(true)
            .with_colors([colour])
            .with_radii([Radius::new_ui_points(0.0)])
    };
    let scales = format!("strong: before, pale: after; arrows ×{scale}, 10 cm = {}", metres(0.1 / scale));
    stream.log("world/diagnosis/scale", &label(0, scales, TEXT))?;
    for (row, (cause, name, path)) in causes(diagnosis).into_iter().enumerate() {
        let members: Vec<&Residual> = residuals.iter().filter(|one| one.cause == cause).collect();
        let arrows = |of: fn(&Residual) -> [f64; 3]| {
            Arrows3D::from_vectors(members.iter().map(|one| of(one).map(|part| (part * scale) as f32)))
                .with_origins(members.iter().map(|one| one.position_m.map(|part| part as f32)))
        };
        let path = format!("world/diagnosis/{path}");
        let before = arrows(|one| one.before_m).with_colors([colour(cause)]).with_radii([size(0.0045)]);
        stream.log(format!("{path}/before"), &before)?;
        let after = arrows(|one| one.after_m).with_colors([pale(colour(cause))]).with_radii([size(0.0035)]);
        stream.log(format!("{path}/after"), &after)?;
        if cause.is_some() || !members.is_empty() {
            let legend = format!("{name}: {} of {} readings", members.len(), residuals.len());
            stream.log(format!("{path}/legend"), &label(row + 1, legend, colour(cause)))?;
        }
    }
    Ok(())
}

/// The held-out RMS from the nominal model to the noise, as bars. The scale is linear; the nominal model's bar is cut off where it is
/// longer than the rest together would show.
fn log_waterfall(stream: &RecordingStream, diagnosis: &Diagnosis) -> RecordingStreamResult<()> {
    let steps = report::steps(diagnosis);
    let most = steps.iter().skip(1).map(|step| step.rms_m).filter(|rms| rms.is_finite()).fold(0.0, f64::max);
    if most <= 0.0 {
        return Ok(());
    }
    let full = 1.15 * most;
    let pitch = (HEIGHT / steps.len() as f64).min(PITCH);
    let x = |rms: f64| (NAMES + LONGEST * (rms / full).clamp(0.0, 1.0)) as f32;
    let y = |row: usize| (pitch * (row as f64 + 0.5)) as f32;
    let last = steps.len() - 1;
    let colours: Vec<[u8; 3]> = steps
        .iter()
        .enumerate()
        .map(|(row, step)| match (row, step.effect) {
            (0, _) => NOMINAL,
            (1, _) => GEOMETRY,
            (_, Some(effect)) => colour(Some(effect)),
            (row, None) if row == last => NOISE,
            _ => EXPLAINED,
        })
        .collect();
    let thick = 0.6 * pitch as f32;
    let lines = steps.iter().enumerate().flat_map(|(row, step)| {
        (0..FILL).map(move |line| {
            let y = y(row) + thick * ((line as f32 + 0.5) / FILL as f32 - 0.5);
            [[NAMES as f32, y], [x(step.rms_m), y]]
        })
    });
    let bars = LineStrips2D::new(lines).with_colors(colours.iter().flat_map(|colour| [*colour; FILL]));
    stream.log("diagnosis/waterfall/bars", &bars.with_radii([Radius::new_scene_units(0.8 * thick / FILL as f32)]))?;

    // A label stands below its point.
    let above = 3.0;
    let names = steps.iter().enumerate().map(|(row, _)| [(NAMES / 2.0 - 2.0) as f32, y(row) - above]);
    let values = steps.iter().enumerate().map(|(row, step)| [x(step.rms_m) + 13.0, y(row) - above]);
    let mut labels: Vec<String> = steps.iter().map(|step| step.name.clone()).collect();
    labels.extend(steps.iter().map(|step| {
        let cut = if step.rms_m > full { "… " } else { "" };
        format!("{cut}{} µm", significant(step.rms_m * 1e6, 3))
    }));
    let text = Points2D::new(names.chain(values))
        .with_labels(labels)
        .with_show_labels(true)
        .with_colors([TEXT])
        .with_radii([Radius::new_ui_points(0.0)]);
    stream.log("diagnosis/waterfall/text", &text)?;
    let floor = x(steps[last].rms_m);
    let floor = LineStrips2D::new([[[floor, 0.0], [floor, y(last)]]]).with_colors([GRID]);
    stream.log("diagnosis/waterfall/floor", &floor.with_radii([Radius::new_ui_points(0.8)]))
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoGap => "no gap",
        Verdict::Explained => "explained",
        Verdict::Ambiguous => "ambiguous",
        Verdict::UnknownRemains => "unknown remains",
        Verdict::NotDetectable => "not detectable",
    }
}

/// The sentence under a heading, for the summary of the run.
pub(super) fn summary(diagnosis: &Diagnosis) -> String {
    format!("#### Diagnosed: {}\n{}\n\n", verdict(diagnosis.verdict), diagnosis.sentence)
}

/// The report.
fn markdown(diagnosis: &Diagnosis) -> String {
    let mut text = format!("### Diagnosis: {}\n{}\n\n", verdict(diagnosis.verdict), diagnosis.sentence);
    if !diagnosis.effects.is_empty() {
        text += &table(&report::CAUSES, &report::causes(diagnosis));
    }
    for set in &diagnosis.confusion_sets {
        text += "These cannot be told apart:\n\n";
        text += &table(&report::CANDIDATES, &report::candidates(set));
    }
    if diagnosis.unknown.present {
        let place = diagnosis.unknown.r#where.as_deref().unwrap_or_default();
        text += &format!("**Unknown:** {place} ({}).\n\n", report::p(diagnosis.unknown.p_value));
    }
    for (heading, items) in [("Measure next", &diagnosis.next_measurements), ("Notes", &diagnosis.notes)] {
        if !items.is_empty() {
            text += &format!("#### {heading}\n");
            items.iter().for_each(|item| text += &format!("- {item}\n"));
            text += "\n";
        }
    }
    text
}

fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &[&str]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(head);
    text += &line(&vec!["---"; head.len()]);
    for row in rows {
        text += &line(&row.iter().map(String::as_str).collect::<Vec<_>>());
    }
    text + "\n"
}
