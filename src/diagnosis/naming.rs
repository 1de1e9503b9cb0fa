//! What is named.

use super::Analysis;
use super::claims::{claim, place};
use super::gap::Closing;
use super::magnitude::{magnitude, unpulled};
use super::outcome::{Effect, Magnitude, Parameters, Place};
use super::parameters::{parameters, signature};
use crate::effects::{Kind, Level};

/// Effects that are named.
pub(super) struct Named {
    /// In the order added.
    pub(super) effects: Vec<Effect>,
    /// Of each member of the best set, its place in `effects`.
    pub(super) of_member: Vec<Option<usize>>,
}

/// Names what is probable enough. `unknown`: whether something is left that no effect explains.
pub(super) fn name(analysis: &Analysis<'_>, closing: &Closing<'_>, unknown: bool) -> Named {
    let folds = closing.folds;
    let unpulled = unpulled(analysis);
    let mut effects = Vec::new();
    let mut of_member: Vec<Option<usize>> = vec![None; analysis.found.best.len()];
    for (step, (hypothesis, _)) in analysis.found.best.iter().enumerate() {
        let this = claim(analysis, *hypothesis);
        let of = &analysis.evidence.candidates.hypotheses[*hypothesis];
        let probability = analysis.found.probability(this);
        let (Some(fit), Some(kind)) =
            (unpulled.as_ref().filter(|_| probability >= analysis.options.settings.decision.named), of.kind)
        else {
            continue;
        };
        let chosen = folds.iter().filter(|fold| fold.chosen.iter().any(|other| claim(analysis, *other) == this)).count();
        let (before, now) = (closing.after(step), closing.after(step + 1));
        of_member[step] = Some(effects.len());
        let signature = signature(analysis, fit, *hypothesis);
        effects.push(Effect {
            kind,
            location: place(analysis, *hypothesis),
            probability,
            magnitude: magnitude(analysis, fit, *hypothesis),
            parameters: parameters(analysis, &signature),
            signature: Some(signature),
            held_out_rms_before_m: before,
            held_out_rms_after_m: now,
            gap_closed: closing.closed(before, now),
            folds: [chosen, folds.len()],
            detail: of.detail.clone(),
        });
    }
    effects.extend(outliers(analysis, closing, unknown));
    Named { effects, of_member }
}

/// Readings that are noisier than the others.
fn outliers(analysis: &Analysis<'_>, closing: &Closing<'_>, unknown: bool) -> Option<Effect> {
    let outliers = &analysis.outliers;
    let is_left_out = analysis.options.without.contains(&Kind::MeasurementOutliers);
    // A misfit has tails, too.
    let settings = &analysis.options.settings;
    let enough = if unknown { settings.outliers.factor_beside_unknown } else { settings.outliers.factor };
    // So has the error of a joint that does not repeat.
    let scatters = !analysis.scatter.is_empty();
    let named = outliers.probability >= settings.decision.named && outliers.factor >= enough && !is_left_out && !scatters;
    named.then(|| Effect {
        kind: Kind::MeasurementOutliers,
        location: Place { level: Level::Sensor, index: None, time_s: None },
        probability: outliers.probability,
        magnitude: Magnitude { value: outliers.share, unit: "1".to_owned(), ci95: outliers.share_ci95 },
        parameters: Parameters { factor: Some(outliers.factor), ..Parameters::default() },
        signature: None,
        held_out_rms_before_m: closing.explained(),
        held_out_rms_after_m: closing.explained(),
        gap_closed: None,
        folds: [0, closing.folds.len()],
        detail: String::new(),
    })
}
