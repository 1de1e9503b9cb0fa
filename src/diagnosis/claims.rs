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
    let row = of.shape.row().and_then(|place| analysis.conditions.in_time.get(place).copied());
    let first = row.map(|row| analysis.measurements[row]);
    let (time_s, row) = (first.map(|first| first.time_s), first.map(|first| first.index));
    Place { time_s, row, ..Place::of(of.location.level, of.location.index) }
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
                assert_eq!(place(&analysis, play), Place::of(Level::Joint, Some(3)));
                // A reading every minute: the first reading after the step is the moment.
                let mut steps = 0;
                for (number, of) in analysis.evidence.candidates.hypotheses.iter().enumerate() {
                    if let Some(row) = of.shape.row() {
                        let place = place(&analysis, number);
                        assert_eq!((place.time_s, place.row), (Some(60.0 * row as f64), Some(row)));
                        steps += 1;
                    }
                }
                assert!(steps > 20, "{steps}");
            },
        );
    }
}
