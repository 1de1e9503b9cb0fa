//! What is named.

use super::Analysis;
use super::claims::{NAMED, SURE, claim, kind_name, place, probability, rivals};
use super::gap::Closing;
use super::magnitude::{magnitude, unpulled};
use super::outcome::{Effect, Magnitude, Parameters, Place};
use super::parameters::parameters;
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
    let has_name = |hypothesis: usize| analysis.candidates.hypotheses[hypothesis].kind.is_some();
    let mut effects = Vec::new();
    let mut of_member: Vec<Option<usize>> = vec![None; analysis.found.best.members.len()];
    for (step, (hypothesis, _)) in analysis.found.best.members.iter().enumerate() {
        let this = claim(analysis, *hypothesis);
        let of = &analysis.candidates.hypotheses[*hypothesis];
        if !has_name(*hypothesis) {
            continue;
        }
        let rivalled: f64 = rivals(analysis, this).iter().map(|(_, _, share)| share).sum();
        let probability = probability(analysis, |other| claim(analysis, other) == this) * (1.0 - rivalled);
        let chosen = folds.iter().filter(|fold| fold.chosen.iter().any(|other| claim(analysis, *other) == this)).count();
        // Beside something unknown a name may only stand in for it: it must be sure, the same whatever is left out, help on readings
        // that were not used, and help more than what has no name.
        let needed = if unknown { SURE } else { NAMED };
        let before_unknown = analysis.found.best.members[..step].iter().all(|(other, _)| has_name(*other));
        let helps = closing.after(step + 1) < closing.after(step);
        // One of some thousands of ripples fits scatter, too.
        let ripple = of.kind == Some(Kind::StrainWaveError);
        let stable = (!ripple || helps) && (!unknown || (before_unknown && helps && 5 * chosen >= 4 * folds.len()));
        let Some(fit) = unpulled.as_ref().filter(|_| probability >= needed && stable) else {
            continue;
        };
        let (before, now) = (closing.after(step), closing.after(step + 1));
        of_member[step] = Some(effects.len());
        effects.push(Effect {
            kind: kind_name(of.kind),
            location: place(analysis, *hypothesis),
            probability,
            magnitude: magnitude(analysis, fit, *hypothesis),
            parameters: parameters(analysis, fit, *hypothesis),
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
    let enough = if unknown { 9.0 } else { 4.0 };
    // So has the error of a joint that does not repeat.
    let scatters = !analysis.scatter.is_empty();
    let named = outliers.probability >= NAMED && outliers.factor >= enough && !is_left_out && !scatters;
    named.then(|| Effect {
        kind: Kind::MeasurementOutliers.name().to_owned(),
        location: Place { level: Level::Sensor, index: None, time_s: None },
        probability: outliers.probability,
        magnitude: Magnitude { value: outliers.share, unit: "1".to_owned(), ci95: outliers.share_ci95 },
        parameters: Parameters { factor: Some(outliers.factor), ..Parameters::default() },
        held_out_rms_before_m: closing.after(usize::MAX),
        held_out_rms_after_m: closing.after(usize::MAX),
        gap_closed: None,
        folds: [0, closing.folds.len()],
        detail: format!("noise about {} times that of the other readings", outliers.factor),
    })
}
