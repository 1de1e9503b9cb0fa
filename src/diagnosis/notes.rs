//! What was assumed, switched off, thinned out or left out.

use super::Analysis;
use super::held_out::{Block, HeldOut};
use super::outcome::NoiseSource;
use super::sentence::whose;

/// Mean squares of the residual, over the declared one, that are nothing to speak of.
const USUAL: std::ops::RangeInclusive<f64> = 0.44..=2.25;

/// All of it. `level`: mean square of the residual over the declared one.
pub(super) fn notes(analysis: &Analysis<'_>, level: f64, source: NoiseSource) -> Vec<String> {
    let mut notes = analysis.conditions.notes.clone();
    notes.extend(analysis.rows.notes.iter().cloned());
    if analysis.repeats.is_some_and(|repeats| !repeats.moved) {
        notes.push(
            "the repeats were read without a move between them: they show the sensor's noise, not what the arm repeats to"
                .to_owned(),
        );
    }
    if let Some(correlation) = analysis.correlation.filter(|correlation| *correlation > 0.05) {
        notes.push(format!(
            "readings of the same configuration are alike (correlation {correlation:.2} of what is left): they are weighted down, n of \
             them to n / (1 + {correlation:.2} (n − 1))"
        ));
    }
    notes.extend(analysis.held_out.iter().filter_map(doing_without));
    let outliers = &analysis.outliers;
    if !outliers.rows.is_empty() {
        let names: Vec<String> =
            outliers.rows.iter().take(20).map(|row| (analysis.measurements[*row].index + 1).to_string()).collect();
        let more = if outliers.rows.len() > 20 { format!(" and {} more", outliers.rows.len() - 20) } else { String::new() };
        notes
            .push(format!("readings far off, weighted down and not counted in held-out errors: rows {}{more}", names.join(", ")));
    }
    if !USUAL.contains(&level) {
        notes.push(format!("the residuals are {:.2} times the {} noise", libm::sqrt(level), whose(source)));
    }
    notes
}

/// How many folds do without something that evidence chose for them.
fn doing_without(held_out: &HeldOut) -> Option<String> {
    let what = match held_out.by {
        Block::Region => "regions",
        Block::Payload => "payloads",
        Block::Session => "sessions",
    };
    let count = held_out.folds.iter().filter(|fold| fold.does_without()).count();
    (count > 0).then(|| {
        format!(
            "{count} of {} folds ({what}) leave out effects that evidence chose for them, because these did not help on readings that \
             were not used",
            held_out.folds.len()
        )
    })
}
