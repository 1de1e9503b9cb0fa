//! What the hypotheses of a set claim.

use super::Analysis;
use super::outcome::Place;
use super::search::Claim;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::{hypothesis, with_analysis};
    use crate::effects::{Kind, Level, Location};

    #[test]
    fn a_claim_is_a_kind_at_a_place_and_a_step_has_its_moment() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let play = hypothesis(&analysis, Some(Kind::Backlash), 3);
                assert_eq!(claim(&analysis, play), (Some(Kind::Backlash), Location { level: Level::Joint, index: Some(3) }));
                assert_eq!(place(&analysis, play), Place { level: Level::Joint, index: Some(3), time_s: None });
                // A reading every minute: the first reading after the step is the moment.
                let mut steps = 0;
                for (number, of) in analysis.evidence.candidates.hypotheses.iter().enumerate() {
                    if let Some(row) = of.shape.row() {
                        assert_eq!(place(&analysis, number).time_s, Some(60.0 * row as f64));
                        steps += 1;
                    }
                }
                assert!(steps > 20, "{steps}");
            },
        );
    }
}
