//! The score of a diagnosis against the truth, by how much could be seen.
//!
//! An effect is *named* where it stands among a verdict's effects with a probability of a half or more. A case with one effect is
//! *right* where that effect's kind is named, *wrong* where another kind is named, *abstained* where none is. What is outside the
//! library, or withheld, is to be *flagged* (`unknown_remains`, or something unknown present); whatever kind is named there that is not
//! in the truth is *misnamed*; a foreign effect that is a case of a known kind (worn teeth of an angle-error map) may be called so.
//!
//! What was withheld can be put back: [`Restored`] says what the whole library names and closes of the same cases.

use serde::Serialize;

use super::case::{CaseTruth, TrueEffect};
use super::verdict::{Gap, NamedEffect, Place, Verdict, level};
use crate::effects::Kind;
use crate::statistics::{Mean, median};

/// From this probability on an effect counts as named.
const NAMED: f64 = 0.5;
/// From this probability on a wrong name is a confident one.
const CONFIDENT: f64 = 0.95;
/// Bins of probability for the calibration.
const BINS: usize = 10;
/// λ from which a foreign effect must be flagged.
const FLAGGED_FROM: f64 = 60.0;
/// Of the mean square that geometry leaves, what who knows the truth must close: chance closes less, and a share of it says nothing.
const SOMETHING: f64 = 0.02;
/// Bins of λ of what is put back.
const RESTORED: [&str; 4] = ["λ < 60", "≥ 60", "no λ", "all"];
/// In place of a kind: cases that have any of those withheld, and cases that have none.
pub const ANY: &str = "any";
/// See [`ANY`].
pub const NOT_THERE: &str = "not there";

/// Lower ends of the bins of λ, and their names.
pub const LAMBDA: [(f64, &str); 5] =
    [(f64::NEG_INFINITY, "λ < 10"), (10.0, "10–20"), (20.0, "20–40"), (40.0, "≥ 40"), (f64::NAN, "no λ")];

/// Bin of a λ: the last one is for what has none.
fn bin(lambda: Option<f64>) -> usize {
    lambda.map_or(LAMBDA.len() - 1, |lambda| LAMBDA[..LAMBDA.len() - 1].iter().rposition(|(low, _)| lambda >= *low).unwrap_or(0))
}

/// The score.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Cases scored.
    pub cases: usize,
    /// Cases with exactly one effect, of a known kind, by λ; the bins of [`LAMBDA`], then all.
    pub single: Vec<Single>,
    /// The same by kind: all λ, and λ ≥ 40.
    pub by_kind: Vec<ByKind>,
    /// Cases with two or more effects, all known.
    pub several: Several,
    /// Cases with effects of known kinds beside some that are not to be known.
    pub mixed: Mixed,
    /// As competitions of diagnosis programs count: false alarms, detection, the probability of what is true.
    pub competition: Competition,
    /// Cases without an effect, by their noise.
    pub effect_free: Vec<EffectFree>,
    /// Cases with an effect that is not to be known: λ below 60, 60 and more, none.
    pub foreign: Vec<Foreign>,
    /// Whether probabilities mean what they say.
    pub calibration: Calibration,
    /// Magnitudes of effects whose kind and place are right.
    pub magnitudes: Vec<Magnitudes>,
    /// Error in time of the steps that are named, by kind.
    pub changes: Vec<Changes>,
    /// What the verdicts close of the held-out gap over what one closes who knows the truth; where that was asked for.
    pub closure: Option<Closure>,
    /// What the whole library makes of the cases; where kinds were withheld and kincal diagnoses.
    pub restored: Option<Vec<Restored>>,
    /// Which kind was named for which, by λ: truth, bin, named (or `nothing`, `unknown`, `a set`), cases.
    pub confusion: Vec<Confusion>,
}

/// Cases with one effect.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Single {
    /// Bin of λ.
    pub lambda: String,
    /// Cases.
    pub cases: usize,
    /// Right kind named.
    pub right: usize,
    /// Of these, at the right place.
    pub right_place: usize,
    /// Nothing named.
    pub abstained: usize,
    /// Of these, with the right kind and place in a set that cannot be told apart.
    pub in_a_set: usize,
    /// A wrong kind named (also beside the right one).
    pub wrong: usize,
    /// Of these, with a probability of 0.95 or more.
    pub confidently_wrong: usize,
    /// Called unknown.
    pub unknown: usize,
}

/// Cases with one effect, by kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByKind {
    /// The kind.
    pub kind: String,
    /// At all λ.
    pub all: Single,
    /// At λ ≥ 40.
    pub visible: Single,
}

/// Cases with several effects.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Several {
    /// Cases.
    pub cases: usize,
    /// Exactly the true effects named, at their places.
    pub exact: usize,
    /// Cases in which each effect has λ ≥ 40.
    pub visible_cases: usize,
    /// Of these, exact.
    pub visible_exact: usize,
    /// True effects.
    pub effects: usize,
    /// Of these, named at their places.
    pub found: usize,
    /// True effects with λ ≥ 40.
    pub visible_effects: usize,
    /// Of these, named at their places.
    pub visible_found: usize,
    /// Effects named.
    pub named: usize,
    /// Of these, right with their places.
    pub named_right: usize,
}

/// Cases with effects of known kinds beside some that are not to be known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Mixed {
    /// Cases.
    pub cases: usize,
    /// Effects of known kinds with λ ≥ 60.
    pub visible_effects: usize,
    /// Of these, named at their places.
    pub visible_found: usize,
    /// Effects named.
    pub named: usize,
    /// Of these, right with their places.
    pub named_right: usize,
    /// Cases in which one that is not to be known has λ ≥ 60.
    pub visible_outside: usize,
    /// Of these, called unknown.
    pub flagged: usize,
}

/// In the form of diagnosis competitions.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Competition {
    /// Cases without an effect, outliers of heavy tails aside.
    pub quiet_cases: usize,
    /// Of these, those in which anything is named or called unknown.
    pub false_alarms: usize,
    /// Cases with an effect with λ ≥ 40.
    pub faulty_cases: usize,
    /// Of these, those in which anything is named or called unknown.
    pub detected: usize,
    /// Mean probability that is given to the true kind at its place (named or in a set), of effects of known kinds with λ ≥ 40.
    pub mean_probability_of_true: Option<f64>,
}

/// Cases without an effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectFree {
    /// Their noise.
    pub noise: String,
    /// Cases.
    pub cases: usize,
    /// An effect named; outliers are none where the noise has heavy tails.
    pub named: usize,
    /// Called unknown.
    pub unknown: usize,
}

/// Cases with an effect that is not to be known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Foreign {
    /// Bin of λ.
    pub lambda: String,
    /// Cases.
    pub cases: usize,
    /// Called unknown.
    pub flagged: usize,
    /// A kind named that is not in the truth.
    pub misnamed: usize,
}

/// Whether probabilities mean what they say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Statements with a probability: effects named and members of sets.
    pub statements: usize,
    /// Expected calibration error.
    pub ece: Option<f64>,
    /// Mean squared error of the probabilities.
    pub brier: Option<f64>,
    /// Mean probability, share that is true, statements: bin by bin.
    pub reliability: Vec<Reliability>,
}

/// A bin of probability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reliability {
    /// Mean stated probability.
    pub stated: f64,
    /// Share that is true.
    pub true_share: f64,
    /// Statements.
    pub statements: usize,
}

/// Magnitudes of what was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Magnitudes {
    /// Bin of λ.
    pub lambda: String,
    /// Magnitudes given in the unit of the truth.
    pub given: usize,
    /// Median of |found − true| / true.
    pub median_error: Option<f64>,
    /// Intervals given.
    pub intervals: usize,
    /// Of these, those that hold the true one.
    pub covered: usize,
}

/// When a step happened, of those named.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Changes {
    /// Kind.
    pub kind: String,
    /// Times given.
    pub given: usize,
    /// Median of |found − true| over the session.
    pub median_error: Option<f64>,
    /// What nine of ten errors do not exceed.
    pub largest_of_90: Option<f64>,
}

/// What is closed of the held-out gap, over what one closes who knows which effects are there: cases with effects of the library only.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Closure {
    /// Cases in which who knows closes something.
    pub cases: usize,
    /// Cases in which that closes next to nothing: less than 2 % of the mean square.
    pub nothing_to_close: usize,
    /// Of (geometry² − explained²) of the verdict over that of who knows.
    pub median: Option<f64>,
    /// Of the same.
    pub mean: Option<f64>,
    /// Cases with 0.9 or more.
    pub nearly_all: usize,
}

/// What becomes of cases when the kinds that were withheld are put back.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Restored {
    /// Cases that have an effect of this kind; [`ANY`] of those withheld; [`NOT_THERE`]: none of them.
    pub kind: String,
    /// Bin of the λ of that effect, the largest where there are several.
    pub lambda: String,
    /// Cases.
    pub cases: usize,
    /// Every such effect named at its place; absent where there is none.
    pub right: Option<usize>,
    /// Something named that is not there, or not at that place; outliers are there where the noise has heavy tails.
    pub wrong: usize,
    /// Called unknown all the same.
    pub unknown: usize,
    /// What the whole library closes over what one closes who knows; absent where no case can tell.
    pub closure: Option<Closure>,
    /// Median 3-D RMS on held-out poses, geometry fitted, m.
    pub geometry_rms_m: Option<f64>,
    /// With what the library without the kinds chose.
    pub withheld_rms_m: Option<f64>,
    /// With the whole library.
    pub restored_rms_m: Option<f64>,
    /// What noise alone would leave.
    pub noise_rms_m: Option<f64>,
}

/// How often a kind was taken for another.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Confusion {
    /// In the truth.
    pub truth: String,
    /// Bin of λ.
    pub lambda: String,
    /// Named.
    pub named: String,
    /// Cases.
    pub cases: usize,
}

fn named(verdict: &Verdict) -> Vec<&NamedEffect> {
    verdict.effects.iter().filter(|effect| effect.probability >= NAMED).collect()
}

fn flagged(verdict: &Verdict) -> bool {
    verdict.verdict == "unknown_remains" || verdict.unknown.present
}

fn at(place: &Place, effect: &TrueEffect) -> bool {
    place.level == level(effect.location.level) && place.index == effect.location.index
}

fn is(claim: &NamedEffect, effect: &TrueEffect) -> bool {
    claim.kind == effect.kind && at(&claim.location, effect)
}

/// Whether `claim` names `effect`, for which there is no name of its own, as the kind that it is a case of.
fn is_case_of(claim: &NamedEffect, effect: &TrueEffect) -> bool {
    let kind = Kind::from_name(&effect.kind).and_then(|kind| kind.descriptor().case_of);
    kind.is_some_and(|kind| kind.name() == claim.kind) && at(&claim.location, effect)
}

/// Scores verdicts, in the order of the truths. Kinds of `withheld` count as unknown ones.
#[must_use]
pub fn score(truths: &[CaseTruth], verdicts: &[Verdict], withheld: &[String]) -> Score {
    let foreign = |effect: &TrueEffect| !effect.known || withheld.contains(&effect.kind);
    let pairs = || truths.iter().zip(verdicts);
    let single = || {
        pairs().filter_map(|(truth, verdict)| match truth.effects.as_slice() {
            [effect] if !foreign(effect) => Some((effect, verdict)),
            _ => None,
        })
    };
    let mut bins: Vec<Single> = LAMBDA
        .iter()
        .map(|(_, name)| *name)
        .chain(["all"])
        .map(|name| Single { lambda: name.to_owned(), ..Single::default() })
        .collect();
    for (effect, verdict) in single() {
        let all = bins.len() - 1;
        for bin in [bin(effect.lambda), all] {
            bins[bin].take(effect, verdict);
        }
    }
    let mut kinds: Vec<&str> = single().map(|(effect, _)| effect.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let by_kind = kinds
        .into_iter()
        .map(|kind| {
            let mut both = ["all", "≥ 40"].map(|name| Single { lambda: name.to_owned(), ..Single::default() });
            for (effect, verdict) in single().filter(|(effect, _)| effect.kind == kind) {
                both[0].take(effect, verdict);
                if bin(effect.lambda) == 3 {
                    both[1].take(effect, verdict);
                }
            }
            let [all, visible] = both;
            ByKind { kind: kind.to_owned(), all, visible }
        })
        .collect();

    let mut several = Several::default();
    for (truth, verdict) in pairs().filter(|(truth, _)| truth.effects.len() > 1 && !truth.effects.iter().any(foreign)) {
        several.take(truth, verdict);
    }
    let mut mixed = Mixed::default();
    let is_mixed = |truth: &CaseTruth| truth.effects.iter().any(foreign) && !truth.effects.iter().all(foreign);
    for (truth, verdict) in pairs().filter(|(truth, _)| is_mixed(truth)) {
        mixed.take(truth, verdict, &foreign);
    }
    Score {
        mixed,
        competition: competition(truths, verdicts, &foreign),
        cases: truths.len().min(verdicts.len()),
        single: bins,
        by_kind,
        several,
        effect_free: effect_free(truths, verdicts),
        foreign: of_foreign(truths, verdicts, &foreign),
        calibration: calibration(truths, verdicts, &foreign),
        magnitudes: magnitudes(truths, verdicts),
        changes: changes(truths, verdicts),
        closure: None,
        restored: None,
        confusion: confusion(truths, verdicts),
    }
}

impl Single {
    fn take(&mut self, effect: &TrueEffect, verdict: &Verdict) {
        let named = named(verdict);
        self.cases += 1;
        self.right += usize::from(named.iter().any(|claim| claim.kind == effect.kind));
        self.right_place += usize::from(named.iter().any(|claim| is(claim, effect)));
        self.abstained += usize::from(named.is_empty());
        let in_a_set =
            verdict.confusion_sets.iter().flatten().any(|candidate| {
                candidate.kind == effect.kind && candidate.location.as_ref().is_some_and(|place| at(place, effect))
            });
        self.in_a_set += usize::from(named.is_empty() && in_a_set);
        let mut wrong = named.iter().filter(|claim| claim.kind != effect.kind).peekable();
        self.wrong += usize::from(wrong.peek().is_some());
        self.confidently_wrong += usize::from(wrong.any(|claim| claim.probability >= CONFIDENT));
        self.unknown += usize::from(flagged(verdict));
    }
}

impl Several {
    fn take(&mut self, truth: &CaseTruth, verdict: &Verdict) {
        let named = named(verdict);
        let visible = |effect: &TrueEffect| bin(effect.lambda) == 3;
        let found = |effect: &TrueEffect| named.iter().any(|claim| is(claim, effect));
        let right = named.iter().filter(|claim| truth.effects.iter().any(|effect| is(claim, effect))).count();
        let exact = truth.effects.iter().all(found) && right == named.len() && named.len() == truth.effects.len();
        self.cases += 1;
        self.exact += usize::from(exact);
        if truth.effects.iter().all(visible) {
            self.visible_cases += 1;
            self.visible_exact += usize::from(exact);
        }
        self.effects += truth.effects.len();
        self.found += truth.effects.iter().filter(|effect| found(effect)).count();
        self.visible_effects += truth.effects.iter().filter(|effect| visible(effect)).count();
        self.visible_found += truth.effects.iter().filter(|effect| visible(effect) && found(effect)).count();
        self.named += named.len();
        self.named_right += right;
    }
}

impl Mixed {
    fn take(&mut self, truth: &CaseTruth, verdict: &Verdict, foreign: &dyn Fn(&TrueEffect) -> bool) {
        let named = named(verdict);
        let visible = |effect: &&TrueEffect| effect.lambda.is_some_and(|lambda| lambda >= FLAGGED_FROM);
        let known = || truth.effects.iter().filter(|effect| !foreign(effect));
        self.cases += 1;
        self.visible_effects += known().filter(visible).count();
        self.visible_found += known().filter(visible).filter(|effect| named.iter().any(|claim| is(claim, effect))).count();
        self.named += named.len();
        let case = |claim: &NamedEffect| truth.effects.iter().any(|effect| foreign(effect) && is_case_of(claim, effect));
        let right = |claim: &&&NamedEffect| known().any(|effect| is(claim, effect)) || case(claim);
        self.named_right += named.iter().filter(right).count();
        if truth.effects.iter().filter(|effect| foreign(effect)).any(|effect| visible(&effect)) {
            self.visible_outside += 1;
            self.flagged += usize::from(flagged(verdict) || named.iter().any(|claim| case(claim)));
        }
    }
}

fn competition(truths: &[CaseTruth], verdicts: &[Verdict], foreign: &dyn Fn(&TrueEffect) -> bool) -> Competition {
    let mut found = Competition::default();
    let mut probabilities = Vec::new();
    for (truth, verdict) in truths.iter().zip(verdicts) {
        let tails = truth.noise.tails.is_some();
        let alarm = flagged(verdict) || named(verdict).iter().any(|claim| !(tails && claim.kind == "measurement_outliers"));
        if truth.effects.is_empty() {
            found.quiet_cases += 1;
            found.false_alarms += usize::from(alarm);
        }
        if truth.effects.iter().any(|effect| bin(effect.lambda) == 3) {
            found.faulty_cases += 1;
            found.detected += usize::from(alarm);
        }
        for effect in truth.effects.iter().filter(|effect| bin(effect.lambda) == 3 && !foreign(effect)) {
            let named = verdict.effects.iter().filter(|claim| is(claim, effect)).map(|claim| claim.probability);
            let listed = verdict.confusion_sets.iter().flatten().filter(|candidate| {
                candidate.kind == effect.kind && candidate.location.as_ref().is_some_and(|place| at(place, effect))
            });
            probabilities.push(named.chain(listed.map(|candidate| candidate.probability)).fold(0.0, f64::max));
        }
    }
    let count = probabilities.len();
    found.mean_probability_of_true = (count > 0).then(|| probabilities.iter().sum::<f64>() / count as f64);
    found
}

fn effect_free(truths: &[CaseTruth], verdicts: &[Verdict]) -> Vec<EffectFree> {
    let names = ["as declared", "heavy tails", "1.3 × declared", "all"];
    let mut rows = names.map(|noise| EffectFree { noise: noise.to_owned(), cases: 0, named: 0, unknown: 0 });
    for (truth, verdict) in truths.iter().zip(verdicts).filter(|(truth, _)| truth.effects.is_empty()) {
        let tails = truth.noise.tails.is_some();
        let row = if tails { 1 } else { usize::from(truth.noise.factor > 1.0) * 2 };
        let alarm = named(verdict).iter().any(|claim| !(tails && claim.kind == "measurement_outliers"));
        for row in [row, 3] {
            rows[row].cases += 1;
            rows[row].named += usize::from(alarm);
            rows[row].unknown += usize::from(flagged(verdict));
        }
    }
    rows.into()
}

fn of_foreign(truths: &[CaseTruth], verdicts: &[Verdict], foreign: &dyn Fn(&TrueEffect) -> bool) -> Vec<Foreign> {
    let names = ["λ < 60", "≥ 60", "all"];
    let mut rows: Vec<Foreign> = names.map(|name| Foreign { lambda: name.to_owned(), ..Foreign::default() }).into();
    for (truth, verdict) in truths.iter().zip(verdicts) {
        let Some(effect) = truth.effects.iter().filter(|effect| foreign(effect)).max_by(|a, b| {
            let lambda = |effect: &TrueEffect| effect.lambda.unwrap_or(0.0);
            lambda(a).total_cmp(&lambda(b))
        }) else {
            continue;
        };
        let row = usize::from(effect.lambda.is_some_and(|lambda| lambda >= FLAGGED_FROM));
        let there = |kind: &str| truth.effects.iter().any(|effect| !foreign(effect) && effect.kind == kind);
        let right = |claim: &&NamedEffect| truth.effects.iter().any(|effect| foreign(effect) && is_case_of(claim, effect));
        let misnamed = named(verdict).iter().any(|claim| !there(&claim.kind) && !right(claim));
        for row in [row, 2] {
            rows[row].cases += 1;
            rows[row].flagged += usize::from(flagged(verdict) || named(verdict).iter().any(right));
            rows[row].misnamed += usize::from(misnamed);
        }
    }
    rows
}

fn calibration(truths: &[CaseTruth], verdicts: &[Verdict], foreign: &dyn Fn(&TrueEffect) -> bool) -> Calibration {
    let mut statements: Vec<(f64, bool)> = Vec::new();
    for (truth, verdict) in truths.iter().zip(verdicts) {
        let tails = truth.noise.tails.is_some();
        let holds = |kind: &str, place: Option<&Place>| {
            let outliers = tails && kind == "measurement_outliers";
            let unknown = kind == "unknown" && truth.effects.iter().any(foreign);
            let there = |effect: &TrueEffect| {
                let named = if foreign(effect) {
                    Kind::from_name(&effect.kind).and_then(|kind| kind.descriptor().case_of).is_some_and(|of| of.name() == kind)
                } else {
                    effect.kind == kind
                };
                named && place.is_some_and(|place| at(place, effect))
            };
            outliers || unknown || truth.effects.iter().any(there)
        };
        for effect in &verdict.effects {
            statements.push((effect.probability, holds(&effect.kind, Some(&effect.location))));
        }
        for candidate in verdict.confusion_sets.iter().flatten() {
            // What stands among the effects as well is one statement.
            let said = verdict
                .effects
                .iter()
                .any(|effect| effect.kind == candidate.kind && Some(&effect.location) == candidate.location.as_ref());
            if !said {
                statements.push((candidate.probability, holds(&candidate.kind, candidate.location.as_ref())));
            }
        }
    }
    let statements: Vec<(f64, bool)> =
        statements.into_iter().filter(|(p, _)| p.is_finite()).map(|(p, holds)| (p.clamp(0.0, 1.0), holds)).collect();
    let count = statements.len();
    let reliability: Vec<Reliability> = (0..BINS)
        .filter_map(|bin| {
            let inside: Vec<&(f64, bool)> =
                statements.iter().filter(|(p, _)| ((p * BINS as f64) as usize).min(BINS - 1) == bin).collect();
            let of = inside.len() as f64;
            (!inside.is_empty()).then(|| Reliability {
                stated: inside.iter().map(|(p, _)| p).sum::<f64>() / of,
                true_share: inside.iter().filter(|(_, holds)| *holds).count() as f64 / of,
                statements: inside.len(),
            })
        })
        .collect();
    let weighted = |bin: &Reliability| bin.statements as f64 * (bin.stated - bin.true_share).abs();
    let brier = |(p, holds): &(f64, bool)| (p - f64::from(u8::from(*holds))).powi(2);
    Calibration {
        statements: count,
        ece: (count > 0).then(|| reliability.iter().map(weighted).sum::<f64>() / count as f64),
        brier: (count > 0).then(|| statements.iter().map(brier).sum::<f64>() / count as f64),
        reliability,
    }
}

fn magnitudes(truths: &[CaseTruth], verdicts: &[Verdict]) -> Vec<Magnitudes> {
    let mut found: Vec<(Vec<f64>, usize, usize)> = vec![Default::default(); LAMBDA.len() + 1];
    for (truth, verdict) in truths.iter().zip(verdicts) {
        for effect in &truth.effects {
            let claim = named(verdict).into_iter().find(|claim| is(claim, effect));
            let Some(magnitude) = claim.and_then(|claim| claim.magnitude.as_ref()) else { continue };
            let unit = magnitude.unit.as_deref().unwrap_or(&effect.unit);
            let Some(value) = magnitude.value.filter(|_| unit == effect.unit) else { continue };
            for bin in [bin(effect.lambda), LAMBDA.len()] {
                let (errors, intervals, covered) = &mut found[bin];
                // The truth is positive: a sign is a matter of convention.
                errors.push((value.abs() / effect.magnitude - 1.0).abs());
                if let Some([low, high]) = magnitude.ci95 {
                    *intervals += 1;
                    let sign = if value < 0.0 { -1.0 } else { 1.0 };
                    let truth = sign * effect.magnitude;
                    *covered += usize::from(low <= truth && truth <= high);
                }
            }
        }
    }
    let names = LAMBDA.iter().map(|(_, name)| *name).chain(["all"]);
    names
        .zip(found)
        .map(|(name, (errors, intervals, covered))| Magnitudes {
            lambda: name.to_owned(),
            given: errors.len(),
            median_error: median(errors),
            intervals,
            covered,
        })
        .collect()
}

fn changes(truths: &[CaseTruth], verdicts: &[Verdict]) -> Vec<Changes> {
    let mut errors = std::collections::BTreeMap::<&str, Vec<f64>>::new();
    for (truth, verdict) in truths.iter().zip(verdicts) {
        let Some(session_s) = truth.session_s.filter(|session_s| *session_s > 0.0) else { continue };
        for effect in &truth.effects {
            let claim = named(verdict).into_iter().find(|claim| is(claim, effect));
            if let (Some(after), Some(time_s)) = (effect.after, claim.and_then(|claim| claim.location.time_s)) {
                errors.entry(&effect.kind).or_default().push((time_s / session_s - after).abs());
            }
        }
    }
    errors
        .into_iter()
        .map(|(kind, mut errors)| {
            errors.sort_by(f64::total_cmp);
            let nine = (9 * errors.len()).div_ceil(10).saturating_sub(1);
            Changes {
                kind: kind.to_owned(),
                given: errors.len(),
                median_error: median(errors.iter().copied()),
                largest_of_90: errors.get(nine).copied(),
            }
        })
        .collect()
}

/// Whether the score asks what a case's verdict closes: known effects only, each with λ ≥ 40.
#[must_use]
pub fn closes(truth: &CaseTruth, withheld: &[String]) -> bool {
    let known = |effect: &TrueEffect| effect.known && !withheld.contains(&effect.kind);
    let visible = |effect: &TrueEffect| bin(effect.lambda) == 3;
    !truth.effects.is_empty() && truth.effects.iter().all(|effect| known(effect) && visible(effect))
}

/// What is closed of the gap by each verdict, beside what one closes who knows the truth.
#[must_use]
pub fn closure(pairs: &[(Gap, Gap)]) -> Closure {
    let closed = |gap: &Gap| gap.geometry_rms_m * gap.geometry_rms_m - gap.explained_rms_m * gap.explained_rms_m;
    let something = |gap: &Gap| closed(gap) > SOMETHING * gap.geometry_rms_m * gap.geometry_rms_m;
    let shares: Vec<f64> =
        pairs.iter().filter(|(_, best)| something(best)).map(|(own, best)| closed(own) / closed(best)).collect();
    Closure {
        cases: shares.len(),
        nothing_to_close: pairs.len() - shares.len(),
        median: median(shares.iter().copied()),
        mean: Mean::of(&shares).map(|mean| mean.mean),
        nearly_all: shares.iter().filter(|share| **share >= 0.9).count(),
    }
}

/// Whether a case has what was withheld, and nothing that is outside the library: who knows can close its gap.
#[must_use]
pub fn restorable(truth: &CaseTruth, withheld: &[String]) -> bool {
    truth.effects.iter().any(|effect| withheld.contains(&effect.kind)) && truth.effects.iter().all(|effect| effect.known)
}

/// The same cases diagnosed without the kinds `withheld` and with the whole library, `told` being the gap of who knows the truth where
/// a case is [`restorable`]: by λ, by kind and λ, and those that have none of the kinds.
#[must_use]
pub fn restored(
    truths: &[CaseTruth],
    [without, whole]: [&[Verdict]; 2],
    told: &[Option<Gap>],
    withheld: &[String],
) -> Vec<Restored> {
    let there = |index: usize, kind: &str| {
        let effects = truths[index].effects.iter();
        effects.filter(|effect| withheld.contains(&effect.kind) && (kind == ANY || kind == effect.kind)).collect::<Vec<_>>()
    };
    let bin_of = |index: usize, kind: &str| {
        let lambda = there(index, kind).iter().filter_map(|effect| effect.lambda).max_by(f64::total_cmp);
        lambda.map_or(2, |lambda| usize::from(lambda >= FLAGGED_FROM))
    };
    let row = |kind: &str, lambda: &str, cases: &[usize]| {
        let count = |is: &dyn Fn(usize) -> bool| cases.iter().filter(|index| is(**index)).count();
        let right = |index: usize| {
            let named = named(&whole[index]);
            there(index, kind).iter().all(|effect| named.iter().any(|claim| is(claim, effect)))
        };
        let wrong = |index: usize| {
            let truth = &truths[index];
            named(&whole[index]).iter().any(|claim| {
                let outliers = truth.noise.tails.is_some() && claim.kind == "measurement_outliers";
                !outliers && !truth.effects.iter().any(|effect| is(claim, effect))
            })
        };
        let pairs: Vec<(Gap, Gap)> = cases.iter().filter_map(|index| whole[*index].gap.zip(told[*index])).collect();
        let rms = |verdicts: &[Verdict], of: &dyn Fn(Gap) -> Option<f64>| {
            median(cases.iter().filter_map(|index| verdicts[*index].gap.and_then(of)))
        };
        Restored {
            kind: kind.to_owned(),
            lambda: lambda.to_owned(),
            cases: cases.len(),
            right: (kind != NOT_THERE).then(|| count(&right)),
            wrong: count(&wrong),
            unknown: count(&|index| flagged(&whole[index])),
            closure: (kind != NOT_THERE && !pairs.is_empty()).then(|| closure(&pairs)),
            geometry_rms_m: rms(whole, &|gap| Some(gap.geometry_rms_m)),
            withheld_rms_m: rms(without, &|gap| Some(gap.explained_rms_m)),
            restored_rms_m: rms(whole, &|gap| Some(gap.explained_rms_m)),
            noise_rms_m: rms(whole, &|gap| gap.noise_rms_m),
        }
    };
    let mut kinds: Vec<&str> = withheld.iter().map(String::as_str).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let all = || 0..truths.len();
    let mut rows = Vec::new();
    for kind in [ANY].into_iter().chain(kinds) {
        for (bin, lambda) in RESTORED.into_iter().enumerate() {
            let inside = |index: &usize| !there(*index, kind).is_empty() && (bin == 3 || bin_of(*index, kind) == bin);
            rows.push(row(kind, lambda, &all().filter(inside).collect::<Vec<_>>()));
        }
    }
    rows.push(row(NOT_THERE, RESTORED[3], &all().filter(|index| there(*index, ANY).is_empty()).collect::<Vec<_>>()));
    rows
}

fn confusion(truths: &[CaseTruth], verdicts: &[Verdict]) -> Vec<Confusion> {
    let mut counts = std::collections::BTreeMap::<(String, usize, String), usize>::new();
    for (truth, verdict) in truths.iter().zip(verdicts) {
        let (kind, bin) = match truth.effects.as_slice() {
            [] => ("none".to_owned(), LAMBDA.len() - 1),
            [effect] => (effect.kind.clone(), bin(effect.lambda)),
            _ => continue,
        };
        let mut names: Vec<String> = named(verdict).iter().map(|claim| claim.kind.clone()).collect();
        names.sort();
        names.dedup();
        if names.is_empty() {
            let sets = !verdict.confusion_sets.is_empty();
            names.push(
                if flagged(verdict) {
                    "unknown"
                } else if sets {
                    "a set"
                } else {
                    "nothing"
                }
                .to_owned(),
            );
        }
        for name in names {
            *counts.entry((kind.clone(), bin, name)).or_default() += 1;
        }
    }
    let entry = |((truth, bin, named), cases): ((String, usize, String), usize)| Confusion {
        truth,
        lambda: LAMBDA[bin].1.to_owned(),
        named,
        cases,
    };
    counts.into_iter().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Level, Location};
    use crate::lab::challenge::case::{Tails, TrueNoise};
    use crate::lab::challenge::verdict::{Candidate, Magnitude, nothing_at_all, oracle};

    fn effect(kind: &str, joint: usize, lambda: f64) -> TrueEffect {
        TrueEffect {
            kind: kind.to_owned(),
            known: crate::effects::Kind::known_from_name(kind).is_some(),
            location: Location { level: Level::Joint, index: Some(joint) },
            magnitude: 2e-5,
            unit: "m".to_owned(),
            lambda: Some(lambda),
            signal: Some(2.0 * lambda),
            after: None,
            detail: String::new(),
        }
    }

    fn case(effects: Vec<TrueEffect>) -> CaseTruth {
        let noise = TrueNoise { declared_m: 20e-6, factor: 1.0, tails: None };
        CaseTruth {
            file: String::new(),
            effects,
            noise,
            lambda: None,
            session_s: Some(600.0),
            parameters: Vec::new(),
            key: String::new(),
        }
    }

    fn truths() -> Vec<CaseTruth> {
        let mut tails = case(vec![]);
        tails.noise.tails = Some(Tails { share: 0.05, factor: 5.0 });
        vec![
            case(vec![effect("radial_clearance", 3, 100.0)]),
            case(vec![effect("backlash", 2, 15.0)]),
            case(vec![effect("backlash", 2, 50.0), effect("tilt_clearance", 5, 90.0)]),
            case(vec![]),
            tails,
            case(vec![effect("worn_tooth_sector", 4, 70.0)]),
        ]
    }

    #[test]
    fn the_oracle_has_the_full_score() {
        let truths = truths();
        let verdicts: Vec<Verdict> = truths.iter().map(|truth| oracle(truth, &[])).collect();
        let score = score(&truths, &verdicts, &[]);
        let all = score.single.last().unwrap();
        assert_eq!((all.cases, all.right, all.right_place, all.abstained, all.wrong, all.unknown), (2, 2, 2, 0, 0, 0));
        assert_eq!((score.single[3].cases, score.single[1].cases), (1, 1));
        assert_eq!((score.several.cases, score.several.exact, score.several.visible_exact), (1, 1, 1));
        assert_eq!((score.several.found, score.several.named_right), (2, 2));
        assert!(score.effect_free.iter().all(|row| row.named == 0 && row.unknown == 0));
        assert_eq!((score.foreign[1].cases, score.foreign[1].flagged, score.foreign[1].misnamed), (1, 1, 0));
        assert_eq!((score.calibration.ece, score.calibration.brier), (Some(0.0), Some(0.0)));
        let found = score.magnitudes.last().unwrap();
        assert_eq!((found.given, found.covered, found.intervals), (4, 4, 4));
        assert!(found.median_error.unwrap() < 1e-12);
    }

    #[test]
    fn the_baseline_fails_where_something_is_and_nowhere_else() {
        let truths = truths();
        let verdicts: Vec<Verdict> = truths.iter().map(|_| nothing_at_all()).collect();
        let score = score(&truths, &verdicts, &[]);
        let all = score.single.last().unwrap();
        assert_eq!((all.cases, all.right, all.abstained, all.wrong), (2, 0, 2, 0));
        assert_eq!((score.several.exact, score.several.found), (0, 0));
        assert_eq!(score.effect_free[3], EffectFree { noise: "all".to_owned(), cases: 2, named: 0, unknown: 0 });
        assert_eq!((score.foreign[2].flagged, score.foreign[2].misnamed), (0, 0));
        assert_eq!((score.calibration.ece, score.calibration.statements), (None, 0));
    }

    #[test]
    fn wrong_names_are_counted_where_they_belong() {
        let claim = |kind: &str, joint, probability| NamedEffect {
            kind: kind.to_owned(),
            location: Place { level: "joint".to_owned(), index: Some(joint), time_s: None },
            probability,
            magnitude: Some(Magnitude { value: Some(-3e-5), unit: Some("m".to_owned()), ci95: Some([-2.5e-5, -1e-5]) }),
        };
        let truths = truths();
        let mut verdicts: Vec<Verdict> = truths.iter().map(|_| nothing_at_all()).collect();
        verdicts[0].effects = vec![claim("radial_clearance", 4, 0.8), claim("backlash", 1, 0.97)];
        verdicts[1].confusion_sets = vec![vec![
            Candidate { kind: "backlash".to_owned(), location: Some(claim("", 2, 0.0).location), probability: 0.55 },
            Candidate { kind: "joint_compliance".to_owned(), location: Some(claim("", 2, 0.0).location), probability: 0.45 },
        ]];
        verdicts[2].effects = vec![claim("backlash", 2, 0.9)];
        verdicts[3].effects = vec![claim("measurement_outliers", 1, 0.6)];
        verdicts[4].effects = vec![claim("measurement_outliers", 1, 0.6)];
        verdicts[5].effects = vec![claim("backlash", 4, 0.3)];
        let score = score(&truths, &verdicts, &[]);
        let (visible, faint) = (&score.single[3], &score.single[1]);
        assert_eq!((visible.right, visible.right_place, visible.wrong, visible.confidently_wrong), (1, 0, 1, 1));
        assert_eq!((faint.abstained, faint.in_a_set), (1, 1));
        assert_eq!((score.several.found, score.several.named, score.several.exact), (1, 1, 0));
        // Outliers are named where the noise has heavy tails: no alarm.
        assert_eq!((score.effect_free[0].named, score.effect_free[1].named), (1, 0));
        // Less than a half is not named.
        assert_eq!(score.foreign[1].misnamed, 0);
        // 0.8 no, 0.97 no, 0.55 yes, 0.45 no, 0.9 yes, 0.6 no, 0.6 yes (tails), 0.3 no.
        let brier = (0.64 + 0.9409 + 0.2025 + 0.2025 + 0.01 + 0.36 + 0.16 + 0.09) / 8.0;
        assert!((score.calibration.brier.unwrap() - brier).abs() < 1e-12);
        // Bins: 0.3: .3; 0.45: .45; 0.55: .45; 0.6, 0.6: |.6 − .5| twice; 0.8: .8; 0.9 and 0.97: |.935 − .5| twice.
        let ece = (0.3 + 0.45 + 0.45 + 0.2 + 0.8 + 0.87) / 8.0;
        assert!((score.calibration.ece.unwrap() - ece).abs() < 1e-12);
        let found = score.magnitudes.last().unwrap();
        assert_eq!((found.given, found.intervals, found.covered), (1, 1, 1));
        assert!((found.median_error.unwrap() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn steps_are_judged_by_their_time() {
        let mut truths: Vec<CaseTruth> = [0.25, 0.5, 0.75].map(|_| case(vec![effect("base_step", 1, 90.0)])).into();
        let mut verdicts = Vec::new();
        for (truth, (after, error)) in truths.iter_mut().zip([(0.25, 0.01), (0.5, -0.05), (0.75, 0.02)]) {
            truth.effects[0].after = Some(after);
            let mut verdict = oracle(truth, &[]);
            assert_eq!(verdict.effects[0].location.time_s, Some(600.0 * after));
            verdict.effects[0].location.time_s = Some(600.0 * (after + error));
            verdicts.push(verdict);
        }
        let changes = score(&truths, &verdicts, &[]).changes;
        assert_eq!((changes.len(), changes[0].given), (1, 3));
        assert!((changes[0].median_error.unwrap() - 0.02).abs() < 1e-12);
        assert!((changes[0].largest_of_90.unwrap() - 0.05).abs() < 1e-12);
    }

    #[test]
    fn the_gap_is_measured_by_who_knows_the_truth() {
        let gap = |before: f64, after: f64| Gap { geometry_rms_m: before, explained_rms_m: after, noise_rms_m: None };
        let best = gap(5.0, 3.0);
        let found =
            closure(&[(gap(5.0, 3.0), best), (gap(5.0, 5.0), best), (gap(5.0, 17.0_f64.sqrt()), best), (best, gap(3.0, 4.0))]);
        assert_eq!((found.cases, found.nothing_to_close, found.nearly_all), (3, 1, 1));
        // Hardly anything to close is nothing: a share of it would say what chance does.
        assert_eq!(closure(&[(gap(5.0, 4.0), gap(5.0, 4.99))]).mean, None);
        assert!((found.median.unwrap() - 0.5).abs() < 1e-12 && (found.mean.unwrap() - 0.5).abs() < 1e-12);
        let truths = truths();
        let closing: Vec<bool> = truths.iter().map(|truth| closes(truth, &[])).collect();
        assert_eq!(closing, [true, false, true, false, false, false]);
        assert!(!closes(&truths[0], &["radial_clearance".to_owned()]));
    }

    #[test]
    fn what_was_withheld_is_put_back() {
        let withheld = ["backlash", "measurement_outliers"].map(str::to_owned);
        let mut outliers = effect("measurement_outliers", 1, 0.0);
        outliers.lambda = None;
        let mut truths = truths();
        truths.push(case(vec![outliers]));
        let whole: Vec<Verdict> = truths
            .iter()
            .enumerate()
            .map(|(index, truth)| {
                let mut verdict = oracle(truth, &[]);
                // Outliers close nothing.
                let explained_rms_m = if index == 6 { 5e-5 } else { 4e-5 };
                verdict.gap = Some(Gap { geometry_rms_m: 5e-5, explained_rms_m, noise_rms_m: Some(3.5e-5) });
                verdict
            })
            .collect();
        let mut without: Vec<Verdict> = truths.iter().map(|truth| oracle(truth, &withheld)).collect();
        without[1].gap = Some(Gap { geometry_rms_m: 5e-5, explained_rms_m: 4.5e-5, noise_rms_m: None });
        let restorable: Vec<bool> = truths.iter().map(|truth| restorable(truth, &withheld)).collect();
        assert_eq!(restorable, [false, true, true, false, false, false, true]);
        let told: Vec<Option<Gap>> =
            whole.iter().zip(restorable).map(|(verdict, is)| if is { verdict.gap } else { None }).collect();
        let rows = restored(&truths, [&without, &whole], &told, &withheld);
        let cases: Vec<(&str, &str, usize)> =
            rows.iter().map(|row| (row.kind.as_str(), row.lambda.as_str(), row.cases)).filter(|row| row.2 > 0).collect();
        let expected = [
            (ANY, "λ < 60", 2),
            (ANY, "no λ", 1),
            (ANY, "all", 3),
            ("backlash", "λ < 60", 2),
            ("backlash", "all", 2),
            ("measurement_outliers", "no λ", 1),
            ("measurement_outliers", "all", 1),
            (NOT_THERE, "all", 4),
        ];
        assert_eq!(cases, expected);
        let (low, none, not_there) = (&rows[0], &rows[2], rows.last().unwrap());
        assert_eq!((low.right, low.wrong, low.unknown), (Some(2), 0, 0));
        assert_eq!(low.closure.as_ref().and_then(|closure| closure.median), Some(1.0));
        let rms = [low.geometry_rms_m, low.withheld_rms_m, low.restored_rms_m, low.noise_rms_m];
        assert_eq!(rms, [5e-5, 4.5e-5, 4e-5, 3.5e-5].map(Some));
        // Nothing to close is no share of anything.
        let closure = none.closure.as_ref().unwrap();
        assert_eq!((none.right, closure.cases, closure.nothing_to_close, closure.mean), (Some(1), 0, 1, None));
        assert_eq!((not_there.right, not_there.wrong, not_there.closure.clone()), (None, 0, None));

        // Found elsewhere is not found, and is wrong.
        let mut elsewhere = whole.clone();
        elsewhere[1].effects[0].location.index = Some(7);
        let rows = restored(&truths, [&without, &elsewhere], &told, &withheld);
        assert_eq!((rows[0].right, rows[0].wrong), (Some(1), 1));
    }

    #[test]
    fn a_withheld_kind_is_an_unknown_one() {
        let truths = vec![case(vec![effect("radial_clearance", 3, 100.0)])];
        let withheld = ["radial_clearance".to_owned()];
        let score = score(&truths, &[oracle(&truths[0], &withheld)], &withheld);
        assert_eq!((score.single.last().unwrap().cases, score.foreign[1].cases, score.foreign[1].flagged), (0, 1, 1));
    }
}
