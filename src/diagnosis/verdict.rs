//! From what was found to what it comes to: the verdict, and all that stands beside it.

use super::Analysis;
use super::advice::next;
use super::claims::claim;
use super::conclusion::{Conclusion, Remains};
use super::confusion::confusion;
use super::detectability::detectability;
use super::gap::Closing;
use super::naming::name;
use super::notes::notes;
use super::outcome::{Candidate, Effect, Gap, NoiseFloor, NoiseSource, Residual, Verdict};
use super::settings::Decision;
use super::unknown::unknown;
use crate::effects::Kind;

/// What the analysis comes to.
pub(super) fn conclude(analysis: &Analysis<'_>) -> Conclusion {
    let settings = &analysis.options.settings.decision;
    let noise_floor = noise_floor(analysis);
    let level = analysis.evidence.noise_level(&analysis.found.best);
    let closing = Closing::new(analysis, noise_floor.position_m);
    let gap = closing.gap();
    let mut unknown = unknown(analysis, level, &noise_floor);
    let named = name(analysis, &closing, unknown.present);
    let confusion_sets = confusion(analysis);
    if named.effects.is_empty() && confusion_sets.is_empty() && !unknown.present {
        unknown.remains = unsaid(analysis, &gap);
        unknown.present = !unknown.remains.is_empty();
    }
    let power = detectability(analysis, level);
    let notes = notes(analysis, level, &noise_floor, &gap);
    let verdict = decide(unknown.present, &named.effects, &confusion_sets, power.share, settings);
    Conclusion {
        verdict,
        gap,
        unknown,
        maps: analysis.maps.clone(),
        next: next(analysis, &confusion_sets, &power, verdict),
        notes,
        settings: analysis.options.settings.clone(),
        gravity_m_s2: analysis.gravity.map(Into::into),
        readings: analysis.measurements.len(),
        residuals: residuals(analysis, &named.of_member),
        noise_floor,
        effects: named.effects,
        confusion_sets,
        undetectable: power.undetectable,
        detectable: power.detectable,
        detectable_share: power.share,
    }
}

/// What is there of causes that have a name, and cannot be named: their size may be nothing, though something is.
fn unsaid(analysis: &Analysis<'_>, gap: &Gap) -> Vec<Remains> {
    let there =
        |hypothesis: usize| analysis.found.probability(claim(analysis, hypothesis)) >= analysis.options.settings.decision.there;
    let mut members = analysis.found.best.iter().map(|(hypothesis, _)| *hypothesis).filter(|hypothesis| there(*hypothesis));
    let Some(first) = members.next() else {
        return Vec::new();
    };
    let of = &analysis.evidence.candidates.hypotheses[first];
    let kind = of.kind.map_or("a shape without a name", Kind::name).replace('_', " ");
    let moved = gap.geometry_rms_m * gap.geometry_rms_m - gap.explained_rms_m * gap.explained_rms_m;
    let (detail, besides) = (format!("{kind} of {}, of a size that cannot be told", of.location), members.count());
    vec![Remains::Shape { detail, besides, rms_m: libm::sqrt(moved.max(0.0)) }]
}

/// The noise of the sensor: from repeats where there are enough, else as is said and as few repeats change it.
fn noise_floor(analysis: &Analysis<'_>) -> NoiseFloor {
    let prior = analysis.evidence.noise;
    let told = analysis.repeats.is_some_and(|repeats| repeats.degrees_of_freedom >= prior.degrees_of_freedom);
    let source = if told { NoiseSource::Repeats } else { analysis.options.noise };
    let position_m = analysis.sigma_m() * libm::sqrt(prior.level);
    // In the same proportion to that of the positions as what is left of them.
    let proportion = position_m / analysis.sigma_m();
    let rotation_rad = analysis
        .sensor
        .orientation_sigma_rad
        .filter(|_| analysis.linear.rows.equations.has_orientation())
        .map(|sigma| sigma * proportion);
    NoiseFloor { position_m, rotation_rad, source }
}

/// `unknown`: whether something is left. `share`: of the kinds and places that would have shown.
fn decide(unknown: bool, effects: &[Effect], sets: &[Vec<Candidate>], share: f64, settings: &Decision) -> Verdict {
    // Sure, and the same for enough folds.
    let settled = |effect: &&Effect| {
        effect.probability >= settings.sure && effect.folds[0] as f64 >= settings.folds * effect.folds[1] as f64
    };
    let named: Vec<&Effect> = effects.iter().filter(|effect| effect.kind != Kind::MeasurementOutliers).collect();
    let open = sets.iter().any(|set| set.iter().map(|candidate| candidate.probability).sum::<f64>() >= settings.there);
    if unknown {
        Verdict::UnknownRemains
    } else if !named.is_empty() && named.iter().all(settled) {
        Verdict::Explained
    } else if !named.is_empty() || open {
        Verdict::Ambiguous
    } else if !effects.is_empty() {
        Verdict::Explained
    } else if share >= settings.detectable {
        Verdict::NoGap
    } else {
        Verdict::NotDetectable
    }
}

/// What is left of each reading, with the effect that moves it most.
fn residuals(analysis: &Analysis<'_>, of_member: &[Option<usize>]) -> Vec<Residual> {
    let rows = analysis.residuals.iter().zip(&analysis.moved.most);
    rows.map(|(residual, moved)| Residual { cause: moved.and_then(|member| of_member[member]), ..residual.clone() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::outcome::{Magnitude, Parameters, Place};
    use crate::effects::Level;

    const NOWHERE: Place = Place::of(Level::Joint, Some(2));

    fn effect(kind: Kind, probability: f64, chosen: usize) -> Effect {
        Effect {
            kind,
            location: NOWHERE,
            probability,
            magnitude: Magnitude { value: 1e-4, unit: "rad".to_owned(), ci95: [0.9e-4, 1.1e-4] },
            parameters: Parameters::default(),
            signature: None,
            held_out_rms_before_m: 1e-4,
            held_out_rms_after_m: 5e-5,
            gap_closed: None,
            folds: [chosen, 5],
            detail: String::new(),
        }
    }

    fn set(probabilities: &[f64]) -> Vec<Vec<Candidate>> {
        let candidate = |probability: &f64| Candidate {
            kind: Some(Kind::Backlash),
            location: NOWHERE,
            probability: *probability,
            detail: String::new(),
        };
        vec![probabilities.iter().map(candidate).collect()]
    }

    /// The verdict table of the guide, line by line.
    #[test]
    fn verdicts_are_those_of_the_guide() {
        let decide = |unknown: bool, effects: &[Effect], sets: &[Vec<Candidate>], share: f64| {
            super::decide(unknown, effects, sets, share, &Decision::default())
        };
        let backlash = |probability: f64, chosen: usize| effect(Kind::Backlash, probability, chosen);
        // Nothing is seen: how much could have been decides.
        assert_eq!(decide(false, &[], &[], 0.5), Verdict::NoGap);
        assert_eq!(decide(false, &[], &[], 0.49), Verdict::NotDetectable);
        // All causes sure, and chosen by half of the folds.
        assert_eq!(decide(false, &[backlash(0.95, 3), backlash(1.0, 5)], &[], 0.9), Verdict::Explained);
        assert_eq!(decide(false, &[backlash(0.95, 2)], &[], 0.9), Verdict::Ambiguous);
        assert_eq!(decide(false, &[backlash(0.94, 5)], &[], 0.9), Verdict::Ambiguous);
        assert_eq!(decide(false, &[backlash(0.99, 5), backlash(0.7, 5)], &[], 0.9), Verdict::Ambiguous);
        // Readings far off are all there is: how folds choose says nothing of them.
        assert_eq!(decide(false, &[effect(Kind::MeasurementOutliers, 0.8, 0)], &[], 0.9), Verdict::Explained);
        // Something is there, and nothing is named.
        assert_eq!(decide(false, &[], &set(&[0.3, 0.3]), 0.9), Verdict::Ambiguous);
        assert_eq!(decide(false, &[], &set(&[0.2, 0.2]), 0.9), Verdict::NoGap);
        // Whatever is named, something else remains.
        assert_eq!(decide(true, &[backlash(1.0, 5)], &[], 0.9), Verdict::UnknownRemains);
        assert_eq!(decide(true, &[], &[], 0.0), Verdict::UnknownRemains);
        // The numbers that decide can be changed.
        let strict = Decision { sure: 0.999, ..Decision::default() };
        assert_eq!(super::decide(false, &[backlash(0.99, 5)], &[], 0.9, &strict), Verdict::Ambiguous);
    }
}
