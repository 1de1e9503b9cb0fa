//! What these readings could have shown: the smallest magnitude of each kind at each place.

use super::Analysis;
use super::claims::{claim, place};
use super::conclusion::{Hidden, Reason, Visible};
use super::evidence::Evidence;
use super::outcome::{MinimumDetectable, Place};
use super::power::Bench;
use super::products::Marginal;
use super::search::Claim;
use crate::effects::signature::library::Hypothesis;
use crate::effects::{Kind, Level, Load, Location, Need};

/// What would show and what would not.
pub(super) struct Detectability {
    /// What would not show at a realistic magnitude.
    pub(super) undetectable: Vec<Hidden>,
    /// What would, from which magnitude on.
    pub(super) detectable: Vec<Visible>,
    /// Share of kinds and places that would.
    pub(super) share: f64,
}

/// Of all kinds and places. `noise`: mean square over the declared one.
pub(super) fn detectability(analysis: &Analysis<'_>, noise: f64) -> Detectability {
    use rayon::prelude::*;
    let candidates = analysis.evidence.candidates;
    let mut claims: Vec<(Kind, Claim, Vec<usize>)> = Vec::new();
    for number in 0..candidates.hypotheses.len() {
        let this = claim(analysis, number);
        match (claims.iter_mut().find(|(_, known, _)| *known == this), this.0) {
            (Some((_, _, variants)), _) => variants.push(number),
            (None, Some(kind)) => claims.push((kind, this, vec![number])),
            (None, None) => {}
        }
    }
    let most = analysis.options.settings.power.readings;
    let thinned = (analysis.linear.count() >= 2 * most).then(|| analysis.linear.thinned(most));
    let marginal = thinned.as_ref().and_then(|products| Marginal::new(products, None, &analysis.linear.prior));
    let evidence = Evidence { marginal: marginal.as_ref().unwrap_or(analysis.evidence.marginal), ..analysis.evidence };
    let bench = Bench::new(&evidence, noise, &analysis.found.best);
    let powers: Vec<_> = claims.par_iter().map(|(_, _, variants)| bench.power(variants)).collect();
    let (mut undetectable, mut detectable) = (Vec::new(), Vec::new());
    let (mut seen, mut all) = (0.0, 0.0);
    for ((kind, _, variants), power) in claims.into_iter().zip(powers) {
        let hypothesis = &candidates.hypotheses[variants[0]];
        let place = Place { time_s: None, row: None, ..place(analysis, variants[0]) };
        let largest = hypothesis.range[1];
        all += 1.0;
        let value = power.least.filter(|least| least.is_finite() && *least < analysis.options.settings.power.beyond * largest);
        let minimum_detectable = MinimumDetectable { value, unit: kind.unit().to_owned() };
        let reason = match value {
            Some(value) if value <= largest => {
                seen += 1.0;
                detectable.push(Visible { kind, location: place, minimum_detectable });
                continue;
            }
            Some(_) => {
                let alike = power.alike.filter(|(_, likeness)| *likeness > analysis.options.settings.power.likeness_said);
                let like = alike.and_then(|(other, likeness)| {
                    let Hypothesis { kind, location, .. } = candidates.hypotheses[other];
                    Some(Reason::Like { kind: kind?, location, likeness: libm::sqrt(likeness) })
                });
                like.unwrap_or(Reason::TooSmall)
            }
            None => why_nothing(kind),
        };
        undetectable.push(Hidden { kind, location: place, minimum_detectable, reason });
    }
    let columns = &analysis.conditions.columns;
    let joints = analysis.linear.rows.mechanism.joint_count();
    let mut missing = |kind: Kind, reason: Reason| {
        let numbered = matches!(kind.level(), Level::Joint | Level::Link);
        for index in (1..=joints).map(Some).filter(|_| numbered).chain((!numbered).then_some(None)) {
            if !analysis.options.wants(Some(kind), Location { level: kind.level(), index }) {
                continue;
            }
            all += 1.0;
            undetectable.push(Hidden {
                kind,
                location: Place::of(kind.level(), index),
                minimum_detectable: MinimumDetectable { value: None, unit: kind.unit().to_owned() },
                reason,
            });
        }
    };
    for kind in Kind::known() {
        let needs = kind.descriptor().needs;
        if needs.contains(&Need::ApproachSides) && !columns.approach {
            missing(kind, Reason::NoApproach);
        }
        if needs.contains(&Need::Moves) && !columns.moves {
            missing(kind, Reason::NoMoves);
        }
        if needs.contains(&Need::Temperatures) && !columns.temperature {
            missing(kind, Reason::NoTemperatures);
        }
    }
    Detectability { undetectable, detectable, share: seen / f64::max(all, 1.0) }
}

/// Why no magnitude of `kind` would show.
fn why_nothing(kind: Kind) -> Reason {
    let of = kind.descriptor();
    if of.load != Load::None {
        Reason::LoadedAlike
    } else if of.needs.contains(&Need::ApproachSides) {
        Reason::OneSide
    } else if kind == Kind::MeasurementScale {
        Reason::LengthsAbsorb
    } else {
        Reason::GeometryAbsorbs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::tests::with_analysis;

    /// Twice the noise hides twice as much, and what was not recorded shows nothing of any size.
    #[test]
    fn what_is_detectable_grows_with_the_noise_and_needs_what_its_kind_needs() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let (quiet, loud) = (detectability(&analysis, 1.0), detectability(&analysis, 4.0));
                assert!(loud.share < quiet.share && quiet.share < 1.0);
                let least = |of: &Detectability, kind: Kind, joint: usize| {
                    let is = |known: Kind, place: &Place| known == kind && place.index == Some(joint);
                    let seen = of.detectable.iter().filter(|one| is(one.kind, &one.location)).map(|one| &one.minimum_detectable);
                    let hidden =
                        of.undetectable.iter().filter(|one| is(one.kind, &one.location)).map(|one| &one.minimum_detectable);
                    seen.chain(hidden).next().unwrap().value
                };
                for joint in [2, 3, 4] {
                    let [a, b] = [&quiet, &loud].map(|of| least(of, Kind::Backlash, joint).unwrap());
                    assert!((b / a - 2.0).abs() < 0.1, "joint {joint}: {a} {b}");
                }
                let without = quiet.undetectable.iter().filter(|one| one.reason == Reason::NoTemperatures);
                let of_drift =
                    without.filter(|one| one.kind == Kind::JointThermalDrift && one.minimum_detectable.value.is_none());
                assert_eq!(of_drift.count(), 8);
            },
        );
    }
}
