//! What is named.

use super::Analysis;
use super::claims::{claim, place};
use super::gap::Closing;
use super::magnitude::{magnitude, unpulled};
use super::outcome::{Effect, Magnitude, Parameters, Place};
use super::parameters::{parameters, signature};
use crate::effects::signature::shape::Size;
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
        let magnitude = magnitude(analysis, fit, *hypothesis);
        // What may be nothing has no name, however well its place is filled by something.
        if magnitude.ci95[0] <= 0.0 && magnitude.ci95[1] >= 0.0 {
            continue;
        }
        let chosen = folds.iter().filter(|fold| fold.chosen.iter().any(|other| claim(analysis, *other) == this)).count();
        let (before, now) = (closing.after(step), closing.after(step + 1));
        of_member[step] = Some(effects.len());
        let signature = signature(analysis, fit, *hypothesis);
        effects.push(Effect {
            kind,
            location: place(analysis, *hypothesis),
            probability,
            magnitude,
            parameters: parameters(analysis, fit, *hypothesis, &signature),
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
    // A misfit has tails, too, and so has what lies between the values of a map.
    let settings = &analysis.options.settings;
    let is_rough = |hypothesis: usize| analysis.evidence.candidates.hypotheses[hypothesis].shape.size() == Size::Rms;
    let rough = analysis.found.best.iter().any(|(hypothesis, _)| is_rough(*hypothesis));
    let enough = if unknown || rough { settings.outliers.factor_beside_unknown } else { settings.outliers.factor };
    // So has the error of a joint that does not repeat.
    let scatters = !analysis.scatter.is_empty();
    let named = outliers.probability >= settings.decision.named && outliers.factor >= enough && !is_left_out && !scatters;
    named.then(|| Effect {
        kind: Kind::MeasurementOutliers,
        location: Place::of(Level::Sensor, None),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::held_out::{Block, HeldOut};
    use crate::diagnosis::outliers::Outliers;
    use crate::diagnosis::scatter::Scatter;
    use crate::diagnosis::search::Found;
    use crate::diagnosis::tests::{SIGMA, belief, fold_of, with_analysis};

    #[test]
    fn what_is_probable_is_named_with_the_folds_that_choose_it() {
        let play = |_: &crate::arm::Arm, _: &[f64], approach: &[i8], joint: usize, _: f64| {
            if joint == 2 { 2e-4 * f64::from(approach[2]) } else { 0.0 }
        };
        with_analysis(play, |mut analysis| {
            let sure = belief(&analysis, Some(Kind::Backlash), 3, 0.9);
            let unsure = belief(&analysis, Some(Kind::JointCompliance), 4, 0.4);
            let best = vec![(unsure.hypothesis, 1), (sure.hypothesis, 1)];
            analysis.found = Found { best, claims: vec![sure, unsure], ..Found::default() };
            let fold = |chosen: Vec<usize>| fold_of([1e-6, 1e-7, 1e-8], &[9e-8, 1e-8], chosen);
            let [this, other] = [sure.hypothesis, unsure.hypothesis];
            let chosen = [vec![this], vec![other, this], vec![other], vec![this], vec![]];
            analysis.held_out = vec![HeldOut { by: Block::Region, folds: chosen.into_iter().map(fold).collect() }];
            let named = name(&analysis, &Closing::new(&analysis, SIGMA), false);
            assert_eq!(named.of_member, [None, Some(0)]);
            let [effect] = &named.effects[..] else { panic!("{:?}", named.effects) };
            assert_eq!((effect.kind, effect.location.index, effect.folds), (Kind::Backlash, Some(3), [3, 5]));
            assert!((effect.magnitude.value / 4e-4 - 1.0).abs() < 0.1, "{:?}", effect.magnitude);
            // It is the second member: ten readings of a fold have 9e-8 m² before it and 1e-8 after.
            assert!((effect.held_out_rms_before_m - 9e-9_f64.sqrt()).abs() < 1e-12);
            assert!((effect.held_out_rms_after_m - 1e-9_f64.sqrt()).abs() < 1e-12);
        });
    }

    #[test]
    fn readings_far_off_are_named_where_nothing_else_has_tails() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |mut analysis| {
                let far =
                    |factor: f64| Outliers { probability: 0.9, share: 0.05, share_ci95: [0.02, 0.1], factor, rows: vec![1] };
                analysis.outliers = far(6.0);
                let named = |analysis: &Analysis<'_>, unknown: bool| {
                    let effects = name(analysis, &Closing::new(analysis, SIGMA), unknown).effects;
                    effects.iter().map(|effect| (effect.kind, effect.parameters.factor)).collect::<Vec<_>>()
                };
                assert_eq!(named(&analysis, false), [(Kind::MeasurementOutliers, Some(6.0))]);
                assert!(named(&analysis, true).is_empty());
                analysis.outliers = far(9.0);
                assert_eq!(named(&analysis, true).len(), 1);
                analysis.scatter = vec![Scatter { joint: 0, sigma: 1e-4, log_odds: 5.0 }];
                assert!(named(&analysis, false).is_empty());
            },
        );
    }
}
