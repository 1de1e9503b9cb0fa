//! What was assumed, switched off, thinned out or left out.

use super::held_out::{Block, HeldOut};
use super::outcome::NoiseSource;
use super::sentence::whose;
use super::{Analysis, mean_sigma};

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
    notes.extend(rounding(analysis));
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

/// Steps to which joint readings are written, with the unit, rad.
const STEPS: [(f64, &str); 8] = [
    (std::f64::consts::PI / 180.0, "1°"),
    (std::f64::consts::PI / 1.8e3, "0.1°"),
    (0.01, "0.01 rad"),
    (0.001, "0.001 rad"),
    (std::f64::consts::PI / 1.8e4, "0.01°"),
    (1e-4, "0.0001 rad"),
    (std::f64::consts::PI / 1.8e5, "0.001°"),
    (1e-5, "0.00001 rad"),
];
/// Error by rounding over the sensor's from which on it is worth a word.
const ROUNDED: f64 = 0.3;

/// Whether the joint readings were rounded so much that it shows.
fn rounding(analysis: &Analysis<'_>) -> Option<String> {
    let rows = analysis.rows;
    let turns = |joint: &usize| !rows.mechanism.slides[*joint];
    let joints: Vec<usize> = (0..rows.mechanism.joint_count()).filter(turns).collect();
    let values = || analysis.measurements.iter().flat_map(|row| joints.iter().map(|joint| row.joints[*joint]));
    let on = |step: f64| values().all(|value| (value / step - (value / step).round()).abs() < 1e-6);
    let (step, name) = STEPS.into_iter().find(|(step, _)| on(*step))?;
    let mut square = 0.0;
    for (posture, target) in rows.postures.iter().zip(&rows.targets) {
        for joint in &joints {
            square += posture.axes[*joint].cross(&(target - posture.origins[*joint])).norm_squared();
        }
    }
    let error_m = step / 12_f64.sqrt() * (square / rows.postures.len() as f64).sqrt();
    let sensor_m = 3_f64.sqrt() * mean_sigma(analysis.sensor, analysis.measurements);
    (error_m > ROUNDED * sensor_m).then(|| {
        format!(
            "joint readings are rounded to {name}: if the arm stood anywhere within that, this alone is an error of {:.0} µm RMS, which \
             may look like joints that do not repeat; write them out in full (what was commanded and reached exactly is no error)",
            error_m * 1e6
        )
    })
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
