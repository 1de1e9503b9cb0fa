//! From what was found to what is said: the verdict, and all that stands beside it.

use super::Analysis;
use super::advice::next;
use super::confusion::confusion;
use super::detectability::detectability;
use super::gap::Closing;
use super::naming::name;
use super::notes::notes;
use super::outcome::{Candidate, Diagnosis, Effect, NoiseFloor, NoiseSource, Residual, Unknown, Verdict};
use super::sentence::sentence;
use super::settings::Decision;
use super::unknown::unknown;
use crate::effects::Kind;

/// Puts the analysis into words and numbers.
pub(super) fn put(analysis: &Analysis<'_>) -> Diagnosis {
    let settings = &analysis.options.settings.decision;
    let noise_floor = noise_floor(analysis);
    let level = analysis.evidence.noise_level(&analysis.found.best);
    let closing = Closing::new(analysis, noise_floor.position_m);
    let gap = closing.gap();
    let unknown = unknown(analysis, level, &noise_floor);
    let named = name(analysis, &closing, unknown.present);
    let confusion_sets = confusion(analysis);
    let power = detectability(analysis, level);
    let notes = notes(analysis, level, &noise_floor, &gap);
    let verdict = decide(&unknown, &named.effects, &confusion_sets, power.share, settings);
    Diagnosis {
        verdict,
        sentence: sentence(verdict, &named.effects, &confusion_sets, &unknown, &gap, &power, settings.sure),
        gap,
        unknown,
        maps: analysis.maps.clone(),
        next_measurements: next(analysis, &confusion_sets, &power, verdict),
        notes,
        settings: analysis.options.settings.clone(),
        readings: analysis.measurements.len(),
        residuals: residuals(analysis, &named.of_member),
        noise_floor,
        effects: named.effects,
        confusion_sets,
        undetectable: power.undetectable,
        detectable: power.detectable,
    }
}

/// The noise of the sensor: from repeats where there are any.
fn noise_floor(analysis: &Analysis<'_>) -> NoiseFloor {
    let (position_m, source) = match analysis.repeats {
        Some(repeats) => (repeats.position_m, NoiseSource::Repeats),
        None => (analysis.sigma_m(), analysis.options.noise),
    };
    // In the same proportion to that of the positions as what is left of them.
    let proportion = position_m / analysis.sigma_m();
    let rotation_rad = analysis
        .sensor
        .orientation_sigma_rad
        .filter(|_| analysis.linear.rows.equations.has_orientation())
        .map(|sigma| sigma * proportion);
    NoiseFloor { position_m, rotation_rad, source }
}

/// `share`: of the kinds and places that would have shown.
fn decide(unknown: &Unknown, effects: &[Effect], sets: &[Vec<Candidate>], share: f64, settings: &Decision) -> Verdict {
    // Sure, and the same for half of the folds at least.
    let settled = |effect: &&Effect| effect.probability >= settings.sure && 2 * effect.folds[0] >= effect.folds[1];
    let named: Vec<&Effect> = effects.iter().filter(|effect| effect.kind != Kind::MeasurementOutliers).collect();
    let open = sets.iter().any(|set| set.iter().map(|candidate| candidate.probability).sum::<f64>() >= settings.named);
    if unknown.present {
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
    let rows = analysis.residuals.iter().zip(&analysis.moved);
    rows.map(|(residual, moved)| Residual { cause: moved.and_then(|member| of_member[member]), ..residual.clone() }).collect()
}
