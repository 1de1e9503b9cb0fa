//! What was assumed, switched off, thinned out or left out.

use nalgebra::Vector3;

use super::Analysis;
use super::held_out::{Block, HeldOut};
use super::outcome::{Gap, NoiseFloor, Residual};
use super::sentence::whose;
use crate::effects::signature::posture::Posture;

/// All of it. `level`: mean square of the residual over the declared one.
pub(super) fn notes(analysis: &Analysis<'_>, level: f64, noise_floor: &NoiseFloor, gap: &Gap) -> Vec<String> {
    let decision = &analysis.options.settings.decision;
    let source = noise_floor.source;
    let mut notes = analysis.conditions.notes.clone();
    notes.extend(analysis.linear.rows.notes.iter().cloned());
    if analysis.repeats.is_some_and(|repeats| !repeats.moved) {
        notes.push(
            "the repeats were read without a move between them: they show the sensor's noise, not what the arm repeats to"
                .to_owned(),
        );
    }
    if let Some(correlation) = analysis.correlation.filter(|correlation| *correlation > decision.correlation) {
        notes.push(format!(
            "readings of the same configuration are alike (correlation {correlation:.2} of what is left): they are weighted down, n of \
             them to n / (1 + {correlation:.2} (n − 1))"
        ));
    }
    notes.extend(analysis.held_out.iter().filter_map(doing_without));
    if let Some(repeats) = analysis.repeats {
        notes.push(format!(
            "the noise is that of repeats: {:.0} differences between readings of one configuration that agree in all that was recorded \
             (±{:.0} %)",
            repeats.degrees_of_freedom / 3.0,
            100.0 / libm::sqrt(2.0 * repeats.degrees_of_freedom)
        ));
    }
    if let (true, Some(sigma)) = (analysis.orientation != 1.0, analysis.sensor.orientation_sigma_rad) {
        notes.push(format!(
            "orientations are taken to be read to {:.4}°, not to {:.4}° as is said of them: so much is left of them beside what is left of the \
             positions",
            (sigma * libm::sqrt(level)).to_degrees(),
            (sigma / analysis.orientation).to_degrees()
        ));
    }
    let left = rms_m(analysis, |row| row.after_m);
    if gap.explained_rms_m > decision.few * left.max(gap.noise_rms_m) {
        notes.push(format!(
            "held-out errors ({:.0} µm) are far above what is left of the readings that were used ({:.0} µm): {} readings are too few to \
             tell this arm's geometry, and what is named rests on few",
            gap.explained_rms_m * 1e6,
            left * 1e6,
            analysis.measurements.len()
        ));
    }
    notes.extend(rounding(analysis));
    let outliers = &analysis.outliers;
    if !outliers.rows.is_empty() {
        let names: Vec<String> =
            outliers.rows.iter().take(20).map(|row| (analysis.measurements[*row].index + 1).to_string()).collect();
        let more = if outliers.rows.len() > 20 { format!(" and {} more", outliers.rows.len() - 20) } else { String::new() };
        notes
            .push(format!("readings far off, weighted down and not counted in held-out errors: rows {}{more}", names.join(", ")));
    }
    if !(decision.usual_noise[0]..=decision.usual_noise[1]).contains(&level) {
        let joints: Vec<String> = analysis.scatter.iter().map(|one| (one.joint + 1).to_string()).collect();
        let beside =
            if joints.is_empty() { String::new() } else { format!(" (beside the scatter of joint {})", joints.join(" and ")) };
        let large = if level < 1.0 { ": it is said to be larger than it is, and hides what is there" } else { "" };
        notes.push(format!("the residuals are {:.2} times the {} noise{beside}{large}", libm::sqrt(level), whose(source)));
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

/// RMS of one part of the residuals, m.
fn rms_m(analysis: &Analysis<'_>, part: impl Fn(&Residual) -> [f64; 3]) -> f64 {
    let square: f64 = analysis.residuals.iter().flat_map(part).map(|value| value * value).sum();
    (square / analysis.residuals.len().max(1) as f64).sqrt()
}

/// Joints whose readings were rounded so much that it shows.
fn rounding(analysis: &Analysis<'_>) -> Vec<String> {
    let rows = analysis.linear.rows;
    let sensor_m = 3_f64.sqrt() * analysis.sigma_m();
    // By step: the joints and the square of the error that they make, m².
    let mut found: Vec<(&str, Vec<String>, f64)> = Vec::new();
    for joint in (0..rows.mechanism.joint_count()).filter(|joint| !rows.mechanism.slides[*joint]) {
        let values: Vec<f64> = analysis.measurements.iter().map(|row| row.joints[joint]).collect();
        let on = |step: f64| values.iter().all(|value| (value / step - (value / step).round()).abs() < 1e-6);
        // A joint that stands still is on any step.
        let Some((step, name)) = STEPS.into_iter().find(|(step, _)| on(*step) && values.iter().any(|value| *value != values[0]))
        else {
            continue;
        };
        let moved = |(posture, target): (&Posture, &Vector3<f64>)| -> f64 {
            posture.moved(joint, false, target)[..3].iter().map(|value| value * value).sum()
        };
        let square = rows.postures.iter().zip(&rows.targets).map(moved).sum::<f64>() / rows.postures.len() as f64;
        let square = square * step * step / 12.0;
        match found.iter_mut().find(|(known, _, _)| *known == name) {
            Some((_, joints, sum)) => {
                joints.push((joint + 1).to_string());
                *sum += square;
            }
            None => found.push((name, vec![(joint + 1).to_string()], square)),
        }
    }
    let before_m = rms_m(analysis, |row| row.before_m);
    // Where less is left, the arm stood where the rounded readings say.
    let shows =
        |square: f64| square.sqrt() > analysis.options.settings.decision.rounded * sensor_m && square.sqrt() < 1.5 * before_m;
    found
        .into_iter()
        .filter(|(_, _, square)| shows(*square))
        .map(|(step, joints, square)| {
            format!(
                "readings of joint {} are rounded to {step}: where the arm stood anywhere within that, this alone is an error of {:.0} µm \
                 RMS, which may look like joints that do not repeat or like ripple; write them out in full",
                joints.join(", "),
                square.sqrt() * 1e6
            )
        })
        .collect()
}

/// How many folds do without something that evidence chose for them.
fn doing_without(held_out: &HeldOut) -> Option<String> {
    let what = match held_out.by {
        Block::Region => "regions",
        Block::Payload => "payloads",
        Block::Session => "sessions",
    };
    let count = held_out.folds.iter().filter(|fold| fold.used < fold.chosen.len()).count();
    (count > 0).then(|| {
        format!(
            "{count} of {} folds ({what}) leave out effects that evidence chose for them, because these did not help on readings that \
             were not used",
            held_out.folds.len()
        )
    })
}
