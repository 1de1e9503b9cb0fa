//! What a named effect has besides kind, place and magnitude: enough to make it happen in a simulation.

use super::Analysis;
use super::evidence::Fit;
use super::outcome::Parameters;
use crate::effects::Kind;
use crate::effects::signature::shape::Shape;

/// Of a member of the best set, from the fit that tells its magnitude.
pub(super) fn parameters(analysis: &Analysis<'_>, fit: &Fit, hypothesis: usize) -> Parameters {
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    let unit = analysis.evidence.candidates.unit[hypothesis];
    let values: Vec<f64> = (analysis.evidence.candidates.columns(hypothesis).zip(&of.spread))
        .map(|(column, spread)| {
            let at = fit.columns.iter().position(|known| *known == column);
            at.map_or(0.0, |at| fit.coefficients[at] * unit * spread)
        })
        .collect();
    let vector = |from: usize| std::array::from_fn(|axis| values.get(from + axis).copied().unwrap_or(0.0));
    let moved = |mut parameters: Parameters| {
        parameters.translation_m = Some(vector(0));
        parameters.rotation_rad = Some(vector(3));
        parameters
    };
    let changed = |at: usize| {
        let times = &analysis.conditions.times;
        let (begin, end) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
        let share = |place: usize| times.get(place).map_or(1.0, |time| (time - begin) / (end - begin));
        // Between the last reading before and the first one after.
        let after = 0.5 * (share(at.saturating_sub(1)) + share(at));
        moved(Parameters { after: Some(after), row: Some(at), ..Parameters::default() })
    };
    match of.shape {
        Shape::Harmonic(_, order) => {
            // a cos + b sin = amplitude · cos(order · q + phase)
            let phase = libm::atan2(-values[1], values[0]);
            Parameters { order: Some(order), phase_rad: Some(phase), ..Parameters::default() }
        }
        Shape::Ratio { source, .. } => Parameters { source: Some(source + 1), ..Parameters::default() },
        Shape::ForceAcrossSign { held, .. } | Shape::MomentAcrossSign { held, .. } => {
            Parameters { held: Some(held), ..Parameters::default() }
        }
        Shape::BaseDrift => moved(Parameters::default()),
        Shape::BaseStep(at) | Shape::ToolStep(at) => changed(at),
        _ if of.kind == Some(Kind::Backlash) => Parameters { sign: Some(values[0].signum()), ..Parameters::default() },
        _ => Parameters::default(),
    }
}
