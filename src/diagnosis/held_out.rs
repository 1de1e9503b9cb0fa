//! Nested cross-validation: effects are chosen again without each fold, and the fold shows what they are worth.
//!
//! Evidence is as good as its model of what is left. Where that is far from it (a camera whose errors no effect of the library has), what
//! evidence chooses may predict worse than geometry alone. So a fold uses what was chosen for it as far as such choices helped the other
//! folds when those were left out. Its own readings were among those that the others' choices were made from; how well they are
//! predicted does not count.

use nalgebra::{DVector, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::evidence::{Candidates, Evidence, NoisePrior};
use super::groups::Groups;
use super::linear::Linear;
use super::products::{Marginal, Products};
use super::ripple::{self, Ripple};
use super::search::climb;
use super::settings::{self, Settings};
use crate::effects::signature::library::strongest;
use crate::measurement::Measurement;

/// What one fold says.
#[derive(Clone, Debug)]
pub(crate) struct Fold {
    /// What it is called ([`Scheme::names`]).
    pub(crate) name: String,
    /// Rows.
    pub(crate) rows: usize,
    /// Sum of squares of the held-out positions, m²: base and target only.
    pub(crate) nominal: f64,
    /// With all geometry.
    pub(crate) geometry: f64,
    /// With all geometry and the first 1, 2, … effects of the best set of all readings, each as large as the other folds say.
    pub(crate) with_best: Vec<f64>,
    /// With all geometry and what was chosen without the fold, as much of it as is used.
    pub(crate) explained: f64,
    /// With the first 1, 2, … of what was chosen without the fold.
    pub(crate) with_chosen: Vec<f64>,
    /// What was chosen without the fold, in the order added.
    pub(crate) chosen: Vec<usize>,
    /// How many of these are used.
    pub(crate) used: usize,
}

impl Fold {
    /// With the first `count` effects of the best set of all readings.
    #[must_use]
    pub(crate) fn with(&self, count: usize) -> f64 {
        match self.with_best.len().min(count) {
            0 => self.geometry,
            count => self.with_best[count - 1],
        }
    }

    fn with_first_chosen(&self, count: usize) -> f64 {
        match self.with_chosen.len().min(count) {
            0 => self.geometry,
            count => self.with_chosen[count - 1],
        }
    }
}

/// What leaving out in one way says.
#[derive(Clone, Debug)]
pub(crate) struct HeldOut {
    /// What the rows of a fold share.
    pub(crate) by: Block,
    /// Fold by fold.
    pub(crate) folds: Vec<Fold>,
}

impl HeldOut {
    /// Mean square of the held-out positions with the effects that are used, m².
    #[must_use]
    pub(crate) fn explained(&self) -> f64 {
        let rows: usize = self.folds.iter().map(|fold| fold.rows).sum();
        self.folds.iter().map(|fold| fold.explained).sum::<f64>() / rows.max(1) as f64
    }
}

/// A way of leaving rows out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scheme {
    /// What the rows of a fold share.
    pub(crate) by: Block,
    /// Fold of each row.
    pub(crate) fold: Vec<usize>,
    /// Number of folds.
    pub(crate) folds: usize,
    /// What each fold is called: the payload or the session; empty for regions.
    pub(crate) names: Vec<String>,
}

/// What the rows of a fold share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A region of the workspace; of readings at fixed points, one configuration in as many as there are folds.
    Region,
    /// What the tool carries.
    Payload,
    /// The session.
    Session,
}

/// The ways of leaving out that `measurements` allow: by region first, then by payload and by session where there are several. Rows of
/// a configuration stay together in a region.
#[must_use]
pub(crate) fn schemes(
    measurements: &[&Measurement],
    targets: &[Vector3<f64>],
    groups: &Groups,
    settings: &settings::Validation,
) -> Vec<Scheme> {
    let folds = settings.folds;
    let points: Vec<Vector3<f64>> = groups.rows.iter().map(|rows| targets[rows[0]]).collect();
    let most = folds.min(points.len() / settings.configurations).max(2);
    // Where a fixed point is, only its own readings tell: a fold has some of each.
    let sockets = measurements.iter().any(|row| !row.is_in_frame());
    let of_group = if sockets { (0..points.len()).map(|group| group % most).collect() } else { regions(&points, most) };
    let by_region = groups.of.iter().map(|group| of_group[*group]).collect();
    let mut schemes = vec![Scheme::new(Block::Region, by_region, &[], folds)];
    let payload: Vec<f64> = measurements.iter().map(|row| row.payload_kg.unwrap_or(0.0)).collect();
    let session: Vec<&str> = measurements.iter().map(|row| row.session.as_deref().unwrap_or_default()).collect();
    let mut payloads = payload.clone();
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let mut sessions = session.clone();
    sessions.sort_unstable();
    sessions.dedup();
    let number = |of: &dyn Fn(usize) -> usize| (0..measurements.len()).map(of).collect::<Vec<_>>();
    let at_payload = number(&|row| payloads.iter().position(|known| *known == payload[row]).unwrap_or(0) % folds);
    let at_session = number(&|row| sessions.iter().position(|known| *known == session[row]).unwrap_or(0) % folds);
    let payloads: Vec<String> = payloads.iter().map(|kg| format!("{kg} kg")).collect();
    let sessions: Vec<String> = sessions.iter().map(|name| (*name).to_owned()).collect();
    for (by, fold, names) in [(Block::Payload, at_payload, payloads), (Block::Session, at_session, sessions)] {
        let scheme = Scheme::new(by, fold, &names, folds);
        if sockets && by == Block::Session {
            continue;
        }
        if (0..scheme.folds).any(|out| scheme.leaves_enough(out, settings.left)) && scheme.folds > 1 {
            schemes.push(scheme);
        }
    }
    schemes
}

impl Scheme {
    /// Whether the share `least` of the rows is left without fold `out`.
    fn leaves_enough(&self, out: usize, least: f64) -> bool {
        self.fold.iter().filter(|fold| **fold != out).count() as f64 >= least * self.fold.len() as f64
    }

    /// `names`: of what each fold holds; those beyond the number of folds share one.
    fn new(by: Block, fold: Vec<usize>, names: &[String], most: usize) -> Scheme {
        // Regions may be empty.
        let mut known = fold.clone();
        known.sort_unstable();
        known.dedup();
        let fold: Vec<usize> = fold.iter().map(|of| known.binary_search(of).unwrap_or(0)).collect();
        let name = |fold: &usize| {
            let of_fold: Vec<&str> = names.iter().skip(*fold).step_by(most).map(String::as_str).collect();
            of_fold.join(", ")
        };
        Scheme { by, folds: known.len(), names: known.iter().map(name).collect(), fold }
    }
}

/// Rounds of k-means: hundreds of points settle in fewer.
const ROUNDS: usize = 30;

/// Folds blocked by region: k-means of `points` from those farthest from each other.
#[must_use]
pub(crate) fn regions(points: &[Vector3<f64>], folds: usize) -> Vec<usize> {
    let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let far = |point: &Vector3<f64>, centres: &[Vector3<f64>]| {
        centres.iter().map(|centre| (point - centre).norm_squared()).fold(f64::INFINITY, f64::min)
    };
    let mut centres: Vec<Vector3<f64>> = vec![centre];
    for step in 0..folds {
        let next = points.iter().max_by(|a, b| far(a, &centres).total_cmp(&far(b, &centres)));
        if let Some(next) = next {
            // The middle was only there to begin from.
            if step == 0 { centres[0] = *next } else { centres.push(*next) }
        }
    }
    let mut fold = vec![0; points.len()];
    for _ in 0..ROUNDS {
        for (point, fold) in points.iter().zip(&mut fold) {
            let distance = |at: &usize| (point - centres[*at]).norm_squared();
            *fold = (0..centres.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        }
        for (number, centre) in centres.iter_mut().enumerate() {
            let of_fold: Vec<&Vector3<f64>> =
                points.iter().zip(&fold).filter(|(_, of)| **of == number).map(|(at, _)| at).collect();
            if !of_fold.is_empty() {
                *centre = of_fold.iter().copied().sum::<Vector3<f64>>() / of_fold.len() as f64;
            }
        }
    }
    fold
}

/// What is left out and chosen anew.
pub(crate) struct Validation<'a> {
    /// The readings.
    pub(crate) linear: &'a Linear<'a>,
    /// What is known of the noise.
    pub(crate) noise: NoisePrior,
    /// Rows that are no outliers; only they are counted.
    pub(crate) good: &'a [bool],
    /// The best set of all readings.
    pub(crate) best: &'a [(usize, usize)],
    /// How it is searched, and what counts.
    pub(crate) settings: &'a Settings,
}

impl Validation<'_> {
    /// Leaves out each fold of `scheme` in turn; `products` are by its folds.
    #[must_use]
    pub(crate) fn run(&self, scheme: &Scheme, products: &Products) -> HeldOut {
        use rayon::prelude::*;
        let mut folds: Vec<Fold> = (0..scheme.folds)
            .into_par_iter()
            .filter(|number| scheme.leaves_enough(*number, self.settings.validation.left))
            .filter_map(|number| {
                let rows: Vec<usize> =
                    (0..self.good.len()).filter(|row| scheme.fold[*row] == number && self.good[*row]).collect();
                let fold = self.leave_out(products, scheme, number, &rows)?;
                Some(Fold { name: scheme.names[number].clone(), ..fold })
            })
            .collect();
        use_what_helps(&mut folds, &self.settings.validation);
        HeldOut { by: scheme.by, folds }
    }

    /// `rows`: those of fold `number` that count.
    fn leave_out(&self, products: &Products, scheme: &Scheme, number: usize, rows: &[usize]) -> Option<Fold> {
        if rows.is_empty() {
            return None;
        }
        let linear = self.linear;
        let marginal = Marginal::new(products, Some(number), &linear.prior)?;
        let candidates = self.candidates(&marginal, |row| scheme.fold[row] != number);
        let evidence = Evidence { marginal: &marginal, candidates: &candidates, noise: self.noise, settings: self.settings };
        let (chosen, _) = climb(&evidence, &[], self.settings.search.most);
        let squares = |members: &[(usize, usize)]| {
            let coefficients = evidence.coefficients(members);
            linear.squares(rows, &marginal.geometry(&coefficients), &linear.made(&coefficients))
        };
        let first =
            |members: &[(usize, usize)]| -> Vec<f64> { (1..=members.len()).map(|count| squares(&members[..count])).collect() };
        let geometry = squares(&[]);
        Some(Fold {
            name: String::new(),
            rows: rows.len(),
            nominal: self.nominal(&marginal, rows)?,
            geometry,
            with_best: first(self.best),
            explained: geometry,
            with_chosen: first(&chosen),
            chosen: chosen.iter().map(|(hypothesis, _)| *hypothesis).collect(),
            used: 0,
        })
    }

    /// What is in play where only the rows that `counts` are known: of what scans of all readings have found only what a scan of these
    /// rows finds, too.
    fn candidates(&self, marginal: &Marginal<'_>, counts: impl Fn(usize) -> bool + Sync) -> Candidates {
        let linear = self.linear;
        let mut candidates = linear.candidates.clone();
        let found = candidates.scanned..candidates.active.len();
        let were_active = candidates.active[found.clone()].to_vec();
        // A closer look at when something happens looks nowhere else.
        for number in found.clone() {
            candidates.active[number] &= strongest(&candidates.hypotheses[number].shape).is_none();
        }
        let mut members = Vec::new();
        while found.clone().any(|number| were_active[number - found.start] && !candidates.active[number]) {
            let evidence = Evidence { marginal, candidates: &candidates, noise: self.noise, settings: self.settings };
            members = climb(&evidence, &members, self.settings.search.most).0;
            let of_rows = Linear { candidates: &candidates, ..linear.clone() };
            let again = ripple::look(&of_rows, &evidence, &members, &counts);
            let is_again = |number: &usize| {
                let (joint, order) = strongest(&candidates.hypotheses[*number].shape).unwrap_or_default();
                let same = |one: &Ripple| one.joint == joint && f64::from(one.waves) == order;
                were_active[number - found.start] && again.iter().any(same)
            };
            let more: Vec<usize> = found.clone().filter(is_again).collect();
            if more.is_empty() {
                break;
            }
            more.into_iter().for_each(|number| candidates.active[number] = true);
        }
        candidates
    }

    /// Base and target fitted to all other folds; sum of squares of the positions of `rows`.
    fn nominal(&self, marginal: &Marginal<'_>, rows: &[usize]) -> Option<f64> {
        let linear = self.linear;
        let change = marginal.free_only(&linear.prior)?;
        Some(linear.squares(rows, &change, &DVector::zeros(linear.residual.len())))
    }
}

/// Decides what each fold uses of what was chosen for it ([`used`]). Where all of that together predicts worse than geometry alone, it
/// is no model of these readings, and no fold uses any.
fn use_what_helps(folds: &mut [Fold], settings: &settings::Validation) {
    let counts: Vec<usize> = (0..folds.len()).map(|number| used(folds, number, settings)).collect();
    let of_all = |count: &dyn Fn(usize) -> usize| -> f64 {
        folds.iter().enumerate().map(|(number, fold)| fold.with_first_chosen(count(number))).sum()
    };
    let helps = of_all(&|number| counts[number]) <= of_all(&|_| 0);
    for (fold, count) in folds.iter_mut().zip(counts) {
        fold.used = if helps { count } else { 0 };
        fold.explained = fold.with_first_chosen(fold.used);
    }
}

/// How many of the effects chosen for fold `number` are used, by what as many of theirs did to the other folds: the most with which
/// those were predicted no worse than by geometry alone, in the mean of the logarithms of how much less is left. No fold's gain counts
/// for more than [`settings::Validation::largest_gain`], and no loss for more than `largest_loss`: one that goes wild outvotes others, and others do not outvote it. All of them where fewer than two other folds can tell.
pub(super) fn used(folds: &[Fold], number: usize, settings: &settings::Validation) -> usize {
    let chosen = folds[number].with_chosen.len();
    let others = || folds.iter().enumerate().filter(|(other, _)| *other != number).map(|(_, fold)| fold);
    let count = others().count() as f64;
    if count < 2.0 {
        return chosen;
    }
    let no_worse = |effects: &usize| {
        let logs: Vec<f64> = others()
            .map(|fold| {
                libm::log(fold.with_first_chosen(*effects) / fold.geometry.max(1e-300))
                    .clamp(-settings.largest_gain, settings.largest_loss)
            })
            .collect();
        logs.iter().sum::<f64>() <= 0.0
    };
    (1..=chosen).rev().find(no_worse).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::settings::Settings;
    use crate::diagnosis::tests::fold_of;

    fn folds(with_chosen: [f64; 5]) -> Vec<Fold> {
        with_chosen.map(|left| Fold { used: 0, ..fold_of([9.0, 4.0, left], &[], vec![7]) }).into()
    }

    /// What helps elsewhere is used, and of what helps most folds but spoils one so much that geometry alone is better nothing is.
    #[test]
    fn what_predicts_worse_than_geometry_is_never_reported() {
        let settings = &Settings::default().validation;
        let mut helped = folds([1.0, 1.0, 2.0, 1.0, 4.5]);
        use_what_helps(&mut helped, settings);
        assert!(helped.iter().all(|fold| fold.used == 1));
        assert_eq!(helped.iter().map(|fold| fold.explained).sum::<f64>(), 9.5);
        let mut wild = folds([1.0, 1.0, 2.0, 1.0, 90.0]);
        assert_eq!(used(&wild, 4, settings), 1, "the others, which cannot know, are for it");
        use_what_helps(&mut wild, settings);
        assert!(wild.iter().all(|fold| fold.used == 0 && fold.explained == fold.geometry));
    }
}
