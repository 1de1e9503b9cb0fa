//! What was assumed, switched off, thinned out or left out.

use nalgebra::Vector3;

use super::Analysis;
use super::conclusion::{Note, Step};
use super::held_out::HeldOut;
use super::outcome::{Gap, NoiseFloor, Residual};
use crate::effects::signature::posture::Posture;

/// All of it. `level`: mean square of the residual over the declared one.
pub(super) fn notes(analysis: &Analysis<'_>, level: f64, noise_floor: &NoiseFloor, gap: &Gap) -> Vec<Note> {
    let decision = &analysis.options.settings.decision;
    let mut notes = analysis.conditions.notes.clone();
    notes.extend(analysis.gravity.map(|gravity| Note::Gravity { m_s2: gravity.into() }));
    notes.extend(analysis.linear.rows.notes.iter().cloned().map(Note::Geometry));
    if analysis.astray {
        notes.push(Note::Astray);
    }
    if analysis.repeats.is_some_and(|repeats| !repeats.moved) {
        notes.push(Note::UnmovedRepeats);
    }
    if let Some(correlation) = analysis.correlation.filter(|correlation| *correlation > decision.correlation) {
        notes.push(Note::Alike { correlation });
    }
    notes.extend(analysis.held_out.iter().filter_map(doing_without));
    if let Some(repeats) = analysis.repeats {
        notes.push(Note::NoiseOfRepeats { degrees_of_freedom: repeats.degrees_of_freedom });
    }
    if let (true, Some(sigma)) = (analysis.orientation != 1.0, analysis.sensor.orientation_sigma_rad) {
        notes.push(Note::OrientationNoise { taken_rad: sigma * libm::sqrt(level), said_rad: sigma / analysis.orientation });
    }
    let used_m = rms_m(analysis, |row| row.after_m);
    if gap.explained_rms_m > decision.few * used_m.max(gap.noise_rms_m) {
        notes.push(Note::FewReadings { held_out_m: gap.explained_rms_m, used_m, readings: analysis.measurements.len() });
    }
    notes.extend(rounding(analysis));
    let outliers = &analysis.outliers;
    if !outliers.rows.is_empty() {
        notes.push(Note::FarOff { rows: outliers.rows.iter().map(|row| analysis.measurements[*row].index + 1).collect() });
    }
    if !(decision.usual_noise[0]..=decision.usual_noise[1]).contains(&level) {
        let beside = analysis.scatter.iter().map(|one| one.joint + 1).collect();
        notes.push(Note::UnusualNoise { ratio: libm::sqrt(level), source: noise_floor.source, beside });
    }
    notes
}

/// Steps to which joint readings are written; the first that all are on is the one.
const STEPS: [Step; 8] = [
    Step::Degrees(1.0),
    Step::Degrees(0.1),
    Step::Radians(0.01),
    Step::Radians(0.001),
    Step::Degrees(0.01),
    Step::Radians(1e-4),
    Step::Degrees(0.001),
    Step::Radians(1e-5),
];

/// RMS of one part of the residuals, m.
fn rms_m(analysis: &Analysis<'_>, part: impl Fn(&Residual) -> [f64; 3]) -> f64 {
    let square: f64 = analysis.residuals.iter().flat_map(part).map(|value| value * value).sum();
    (square / analysis.residuals.len().max(1) as f64).sqrt()
}

/// Joints whose readings were rounded so much that it shows.
fn rounding(analysis: &Analysis<'_>) -> Vec<Note> {
    let rows = analysis.linear.rows;
    let sensor_m = 3_f64.sqrt() * analysis.sigma_m();
    // By step: the joints and the square of the error that they make, m².
    let mut found: Vec<(Step, Vec<usize>, f64)> = Vec::new();
    for joint in (0..rows.mechanism.joint_count()).filter(|joint| !rows.mechanism.slides[*joint]) {
        let values: Vec<f64> = analysis.measurements.iter().map(|row| row.joints[joint]).collect();
        // A joint that stands still is on any step.
        let Some(step) = STEPS.into_iter().find(|step| is_on(*step, &values) && values.iter().any(|value| *value != values[0]))
        else {
            continue;
        };
        let moved = |(posture, target): (&Posture, &Vector3<f64>)| -> f64 {
            posture.moved(joint, false, target)[..3].iter().map(|value| value * value).sum()
        };
        let square = rows.postures.iter().zip(&rows.targets).map(moved).sum::<f64>() / rows.postures.len() as f64;
        // The variance of what is evenly spread over a step.
        let square = square * step.rad() * step.rad() / 12.0;
        match found.iter_mut().find(|(known, _, _)| *known == step) {
            Some((_, joints, sum)) => {
                joints.push(joint + 1);
                *sum += square;
            }
            None => found.push((step, vec![joint + 1], square)),
        }
    }
    let before_m = rms_m(analysis, |row| row.before_m);
    // Where less is left, the arm stood where the rounded readings say.
    let decision = &analysis.options.settings.decision;
    let shows =
        |square: f64| square.sqrt() > decision.rounded * sensor_m && square.sqrt() < decision.rounded_over_left * before_m;
    found
        .into_iter()
        .filter(|(_, _, square)| shows(*square))
        .map(|(step, joints, square)| Note::Rounded { joints, step, rms_m: square.sqrt() })
        .collect()
}

/// How far from a whole number of steps a reading that is on it may be, in steps: a table's decimals end somewhere.
const ON_A_STEP: f64 = 1e-6;

/// Whether all `values` (rad) are whole numbers of steps.
fn is_on(step: Step, values: &[f64]) -> bool {
    values.iter().all(|value| (value / step.rad() - (value / step.rad()).round()).abs() < ON_A_STEP)
}

/// How many folds do without something that evidence chose for them.
fn doing_without(held_out: &HeldOut) -> Option<Note> {
    let count = held_out.folds.iter().filter(|fold| fold.used < fold.chosen.len()).count();
    (count > 0).then_some(Note::FoldsDoWithout { by: held_out.by, count, folds: held_out.folds.len() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::held_out::Block;
    use crate::diagnosis::tests::{fold_of, with_analysis};
    use crate::measurement::Measurement;

    #[test]
    fn values_are_on_a_step_up_to_the_decimals_of_a_table() {
        let degrees = [12.3_f64, -0.7, 90.0].map(f64::to_radians);
        assert!(is_on(Step::Degrees(0.1), &degrees) && !is_on(Step::Degrees(1.0), &degrees));
        let written = degrees.map(|value| (value * 1e12).round() / 1e12);
        assert!(is_on(Step::Degrees(0.1), &written) && !is_on(Step::Radians(0.001), &written));
    }

    #[test]
    fn folds_that_use_less_than_was_chosen_are_counted() {
        let fold = |used: usize| crate::diagnosis::held_out::Fold { used, ..fold_of([9.0, 4.0, 1.0], &[], vec![3, 5]) };
        let held_out = |used: [usize; 3]| HeldOut { by: Block::Payload, folds: used.map(fold).into() };
        assert_eq!(doing_without(&held_out([2, 2, 2])), None);
        assert_eq!(doing_without(&held_out([2, 0, 1])), Some(Note::FoldsDoWithout { by: Block::Payload, count: 2, folds: 3 }));
    }

    /// A joint that was written to a tenth of a degree: evenly spread over a step, times its lever.
    #[test]
    fn rounding_is_told_with_the_error_that_it_makes() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                let rounded = |row: &&Measurement| {
                    let mut row = (*row).clone();
                    row.joints[1] = ((row.joints[1].to_degrees() * 10.0).round() / 10.0).to_radians();
                    row
                };
                // As long as the analysis, which borrows them.
                let rows: &'static [Measurement] = analysis.measurements.iter().map(rounded).collect::<Vec<_>>().leak();
                analysis.measurements = rows.iter().collect::<Vec<_>>().leak();
                analysis.residuals.iter_mut().for_each(|left| left.before_m = [5e-3; 3]);
                let found = rounding(&analysis);
                let [Note::Rounded { joints, step, rms_m }] = found.as_slice() else {
                    panic!("{found:?}");
                };
                assert_eq!((joints.as_slice(), *step), (&[2][..], Step::Degrees(0.1)));
                let mechanism = &analysis.linear.rows.mechanism;
                let lever = |row: &Measurement| {
                    let turned = |by: f64| {
                        let mut joints = row.joints.clone();
                        joints[1] += by;
                        mechanism.posture(&joints, 0.0).tool
                    };
                    (turned(1e-6) - turned(-1e-6)).norm() / 2e-6
                };
                let square = rows.iter().map(|row| lever(row).powi(2)).sum::<f64>() / rows.len() as f64;
                let wanted = 0.1_f64.to_radians() * (square / 12.0).sqrt();
                // The target is off the tool by as much as the fit says.
                assert!((rms_m / wanted - 1.0).abs() < 0.01, "{rms_m} against {wanted}");
            },
        );
    }
}
