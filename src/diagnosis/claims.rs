//! What the hypotheses of a set claim.

use super::Analysis;
use super::outcome::Place;
use super::search::Claim;
use crate::effects::Kind;

/// What hypothesis number `hypothesis` claims.
pub(super) fn claim(analysis: &Analysis<'_>, hypothesis: usize) -> Claim {
    let hypothesis = &analysis.evidence.candidates.hypotheses[hypothesis];
    (hypothesis.kind, hypothesis.location)
}

/// Where it is and, of a step, when.
pub(super) fn place(analysis: &Analysis<'_>, hypothesis: usize) -> Place {
    let of = &analysis.evidence.candidates.hypotheses[hypothesis];
    let time_s = of.shape.row().and_then(|row| analysis.conditions.times.get(row).copied());
    Place { level: of.location.level, index: of.location.index, time_s }
}

/// The kind's name, or that it has none.
pub(crate) fn kind_name(kind: Option<Kind>) -> &'static str {
    kind.map_or("unknown", Kind::name)
}
