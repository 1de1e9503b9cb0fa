//! What a named effect has besides kind, place and magnitude: enough to make it happen in a simulation.

use super::Analysis;
use super::evidence::Fit;
use super::outcome::{Parameters, Signature};
use crate::effects::signature::shape::Shape;

/// What a member of the best set follows, with the coefficients of its columns from the fit that tells its magnitude.
pub(super) fn signature(analysis: &Analysis<'_>, fit: &Fit, hypothesis: usize) -> Signature {
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    let unit = analysis.evidence.candidates.unit[hypothesis];
    let coefficient = |(column, spread): (usize, &f64)| {
        let at = fit.columns.iter().position(|known| *known == column);
        at.map_or(0.0, |at| fit.coefficients[at] * unit * spread)
    };
    let coefficients = analysis.evidence.candidates.columns(hypothesis).zip(&of.spread).map(coefficient).collect();
    Signature { shape: of.shape, coefficients }
}

/// The same by the names that results have for it.
pub(super) fn parameters(analysis: &Analysis<'_>, signature: &Signature) -> Parameters {
    let times = &analysis.conditions.times;
    let (begin, end) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
    let share = |place: usize| times.get(place).map_or(1.0, |time| (time - begin) / (end - begin));
    // Between the last reading before and the first one after.
    named(signature, |row| 0.5 * (share(row.saturating_sub(1)) + share(row)))
}

/// `after`: share of the session that has passed between the reading before a place in time and the one at it.
pub(crate) fn named(signature: &Signature, after: impl Fn(usize) -> f64) -> Parameters {
    let value = |at: usize| signature.coefficients.get(at).copied().unwrap_or(0.0);
    let vector = |from: usize| std::array::from_fn(|axis| value(from + axis));
    let none = Parameters::default;
    let moved = || Parameters { translation_m: Some(vector(0)), rotation_rad: Some(vector(3)), ..none() };
    let changed = |row: usize| Parameters { after: Some(after(row)), row: Some(row), ..moved() };
    match signature.shape {
        // a cos + b sin = amplitude · cos(order · q + phase)
        Shape::Harmonic { order, .. } => {
            Parameters { order: Some(order), phase_rad: Some(libm::atan2(-value(1), value(0))), ..none() }
        }
        Shape::Ratio { source, .. } => Parameters { source: Some(source + 1), ..none() },
        Shape::ForceAcrossSign { held, .. } | Shape::MomentAcrossSign { held, .. } => Parameters { held: Some(held), ..none() },
        Shape::BaseDrift => moved(),
        Shape::BaseStep { row } | Shape::ToolStep { row } => changed(row),
        Shape::Direction { .. } => Parameters { sign: Some(value(0).signum()), ..none() },
        // Kind, place and magnitude say all, or the signature has what they do not; or the shape has no name.
        Shape::Torque { .. }
        | Shape::MomentAcross { .. }
        | Shape::Beam { .. }
        | Shape::TorqueSign { .. }
        | Shape::LeaningTorqueSign { .. }
        | Shape::TwoHarmonics { .. }
        | Shape::Growth { .. }
        | Shape::GrowthOnFoot { .. }
        | Shape::Warmth { .. }
        | Shape::BaseTilt
        | Shape::Scale
        | Shape::UnequalBend { .. }
        | Shape::UnequalSeat { .. }
        | Shape::UnequalShift { .. }
        | Shape::BaseCourse { .. }
        | Shape::ToolCourse { .. }
        | Shape::Bump { .. }
        | Shape::AngleCurve { .. }
        | Shape::AngleMap { .. }
        | Shape::Crosstalk { .. }
        | Shape::Softening { .. }
        | Shape::Hardening { .. }
        | Shape::TorqueMemory { .. }
        | Shape::AllYield
        | Shape::DirectionLoad { .. }
        | Shape::Memory { .. }
        | Shape::TimeCurve { .. } => none(),
    }
}
