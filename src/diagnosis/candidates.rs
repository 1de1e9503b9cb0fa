//! The hypotheses in play: the columns that they have in the linear problem, and their prior odds.

use std::collections::{BTreeMap, BTreeSet};

use super::evidence::Candidates;
use super::settings::Prior;
use crate::effects::Kind;
use crate::effects::signature::library::Hypothesis;
use crate::effects::signature::shape::Family;

/// The hypotheses with places for their columns; magnitudes are in units of the middle of what is realistic.
/// `scanned`: those that scans have found.
pub(super) fn candidates(mut hypotheses: Vec<Hypothesis>, scanned: Vec<Hypothesis>) -> Candidates {
    let from = hypotheses.len();
    hypotheses.extend(scanned);
    let mut first = Vec::new();
    let mut columns = 0;
    for hypothesis in &hypotheses {
        first.push(columns);
        columns += hypothesis.spread.len();
    }
    let unit: Vec<f64> = hypotheses.iter().map(|hypothesis| libm::sqrt(hypothesis.range[0] * hypothesis.range[1])).collect();
    let most = |of: &Hypothesis| of.kind.map_or(f64::INFINITY, |kind| kind.descriptor().most);
    let widest = hypotheses.iter().zip(&unit).map(|(of, unit)| most(of) * of.range[1] / unit).collect();
    let count = hypotheses.len();
    Candidates { hypotheses, first, unit, widest, log_odds: vec![0.0; count], active: vec![true; count], scanned: from }
}

/// A class of hypotheses that share one prior: a kind, or a family of shapes without a name.
type Class = (Option<Kind>, Option<Family>);

fn class(hypothesis: &Hypothesis) -> Class {
    match hypothesis.kind {
        Some(kind) => (Some(kind), None),
        None => (None, hypothesis.shape.unnamed().map(|(family, _)| family)),
    }
}

/// Which hypotheses have information (`information`: of each, the trace of what survives of it), and their prior odds: equal for all kinds, for all places of a kind, for all variants at a
/// place; shapes without a name share a part.
pub(super) fn weigh(candidates: &mut Candidates, information: &[f64], prior: &Prior) {
    let count = candidates.hypotheses.len();
    for number in 0..count {
        let information = information[number];
        let largest = candidates.hypotheses[number].range[1] / candidates.unit[number];
        candidates.active[number] = information * largest * largest >= prior.no_information;
    }
    let active: Vec<usize> = (0..count).filter(|number| candidates.active[*number]).collect();
    let hypotheses = &candidates.hypotheses;
    let mut classes: [BTreeSet<Class>; 2] = Default::default();
    let mut places: BTreeMap<Class, BTreeMap<Option<usize>, usize>> = BTreeMap::new();
    let joints = hypotheses.iter().filter_map(|hypothesis| hypothesis.location.index).max().unwrap_or(1);
    for number in &active {
        let class = class(&hypotheses[*number]);
        classes[usize::from(class.0.is_some())].insert(class);
        *places.entry(class).or_default().entry(hypotheses[*number].location.index).or_default() += 1;
    }
    let mut log_odds = vec![f64::NEG_INFINITY; count];
    for number in &active {
        let class = class(&hypotheses[*number]);
        let of_class = &places[&class];
        let variants = of_class[&hypotheses[*number].location.index] as f64;
        let named = class.0.is_some();
        let share = if named { 1.0 - prior.unnamed } else { prior.unnamed };
        let count = classes[usize::from(named)].len() as f64;
        let own = hypotheses[*number].share.unwrap_or(1.0 / variants);
        // A scan went over all joints, whatever it found.
        let of_class = if hypotheses[*number].share.is_some() && !named { joints } else { of_class.len() };
        log_odds[*number] = libm::log(prior.odds * share * own / (count * of_class as f64));
    }
    candidates.log_odds = log_odds;
}

/// Logarithm of the prior odds that one of `joints` joints does what no hypothesis of `candidates` says: a class more of shapes without a name.
pub(super) fn odds_of_one_more_unnamed(candidates: &Candidates, joints: usize, prior: &Prior) -> f64 {
    let nameless = candidates.hypotheses.iter().zip(&candidates.active).filter(|(of, active)| **active && of.kind.is_none());
    let classes: BTreeSet<Class> = nameless.map(|(of, _)| class(of)).collect();
    libm::log(prior.odds * prior.unnamed / ((classes.len() + 1) * joints) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::evidence::one_signed;
    use crate::diagnosis::settings::Settings;
    use crate::diagnosis::tests::with_analysis;
    use crate::effects::signature::library::{Columns, library};
    use crate::effects::signature::shape::Shape;
    use crate::effects::signature::unnamed::Nameless;
    use crate::effects::signature::unnamed::nonlinear_torque::Softening;
    use crate::effects::{Level, Location};

    fn hypothesis(kind: Option<Kind>, joint: usize, share: Option<f64>, width: usize) -> Hypothesis {
        Hypothesis {
            share,
            kind,
            location: Location { level: Level::Joint, index: Some(joint) },
            shape: Shape::Nameless(Nameless::Softening(Softening { joint })),
            range: [0.5, 2.0],
            spread: vec![1.0; width],
            detail: String::new(),
        }
    }

    #[test]
    fn columns_follow_each_other_and_a_unit_is_the_middle_of_the_range() {
        let of = candidates([2, 1, 3].map(|width| hypothesis(None, 1, None, width)).to_vec(), Vec::new());
        assert_eq!((0..3).map(|number| of.columns(number)).collect::<Vec<_>>(), [0..2, 2..3, 3..6]);
        assert_eq!(of.unit, [1.0; 3]);
    }

    /// Links of plastic, warmed: nothing grows more, whatever the readings would like.
    #[test]
    fn no_prior_is_wider_than_the_worst_of_arms() {
        let prior = Settings::default().prior;
        let of = candidates([Some(Kind::LinkThermalGrowth), None].map(|kind| hypothesis(kind, 1, None, 1)).to_vec(), Vec::new());
        let widest = crate::diagnosis::settings::SCALES - 1;
        // The upper end of the range is two units, and plastics grow five times as much.
        assert_eq!([0, 1].map(|number| of.size(&prior, number, widest)), [10.0, prior.scales[widest]]);
        assert_eq!(of.size(&prior, 0, 0), prior.scales[0]);
    }

    /// The prior as a tree, leaf by leaf: a quarter of it for shapes without a name; kinds, then places, then variants alike.
    #[test]
    fn the_prior_is_shared_by_kinds_then_places_then_variants() {
        let (play, runout) = (Some(Kind::Backlash), Some(Kind::JointEccentricity));
        let mut of = candidates(
            vec![
                hypothesis(play, 1, None, 1),
                hypothesis(play, 2, None, 1),
                hypothesis(runout, 1, None, 1),
                hypothesis(runout, 1, None, 1),
                hypothesis(runout, 1, None, 1),
                hypothesis(None, 2, None, 1),
                hypothesis(Some(Kind::LinkBending), 1, Some(0.25), 1),
                hypothesis(Some(Kind::LinkBending), 1, Some(0.75), 1),
                // Nothing of it survives geometry: neither it nor its kind has a part.
                hypothesis(Some(Kind::GearCoupling), 1, None, 1),
            ],
            Vec::new(),
        );
        let prior = Prior { odds: 2.0, ..Settings::default().prior };
        // Twice the unit is the upper end: information of one there makes 4, just enough.
        let information = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.999];
        weigh(&mut of, &information, &prior);
        let expected = [0.125, 0.125, 0.25 / 3.0, 0.25 / 3.0, 0.25 / 3.0, 0.25, 0.0625, 0.1875, 0.0];
        for (number, share) in expected.into_iter().enumerate() {
            let found = of.log_odds[number].exp() / 2.0;
            assert!((found - share).abs() < 1e-12, "{number}: {found} against {share}");
        }
        assert_eq!(of.active, [true, true, true, true, true, true, true, true, false]);
        let all: f64 = of.log_odds.iter().map(|log| log.exp()).sum();
        assert!((all - 2.0).abs() < 1e-12, "{all}");
    }

    /// A ripple that a scan found has the part of one of all that were scanned, at one of all joints.
    #[test]
    fn what_a_scan_found_is_no_likelier_than_what_it_did_not_find() {
        let mut of = candidates(vec![hypothesis(None, 4, Some(0.01), 1), hypothesis(None, 6, None, 1)], Vec::new());
        weigh(&mut of, &[1.0; 2], &Settings::default().prior);
        // Both are of one family; the arm has six joints or more.
        assert!((of.log_odds[0].exp() - 0.25 * 0.01 / 6.0).abs() < 1e-12);
        assert!((of.log_odds[1].exp() - 0.25 / 2.0).abs() < 1e-12);
    }

    /// The evidence restricts the sign of the first coefficient alone.
    #[test]
    fn what_has_one_sign_has_one_coefficient() {
        with_analysis(
            |_, _, _, _, _| 0.0,
            |analysis| {
                let columns = Columns { temperature: true, ..analysis.conditions.columns.clone() };
                let all = library(&analysis.linear.rows.mechanism, &columns);
                let kinds: BTreeSet<Kind> = all.iter().filter(|of| one_signed(of)).filter_map(|of| of.kind).collect();
                assert!(kinds.len() > 5, "{kinds:?}");
                for of in all.iter().filter(|of| one_signed(of)) {
                    assert_eq!(of.spread.len(), 1, "{of:?}");
                }
            },
        );
    }
}
