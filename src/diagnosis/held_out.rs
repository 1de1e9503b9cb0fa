//! Nested cross-validation: effects are chosen again without each fold, and the fold shows what they are worth.
//!
//! Evidence is as good as its model of what is left. Where that is far from it (a camera whose errors no effect of the library has), what
//! evidence chooses may predict worse than geometry alone. So a fold uses what was chosen for it as far as such choices helped the other
//! folds when those were left out. Its own readings were among those that the others' choices were made from; how well they are
//! predicted does not count.

use nalgebra::{Cholesky, DMatrix, DMatrixView, DVector, Vector3};
use serde::{Deserialize, Serialize};

use super::FOLDS;
use super::evidence::{Candidates, NoisePrior, coefficients};
use super::gram::{Gram, Surviving};
use super::groups::Groups;
use super::rows::Rows;
use super::search::search;
use super::whitening::Whitening;
use crate::measurement::Measurement;

/// Rows of the linear problem with what the search needs.
#[derive(Clone, Debug)]
pub struct Problem {
    /// `[geometry | signatures | residual]`, m and rad.
    pub raw: DMatrix<f64>,
    /// What makes the equations alike in noise, and weighs the rows.
    pub whitening: Whitening,
    /// Equations per row.
    pub per_row: usize,
    /// Geometric parameters.
    pub geometry: usize,
    /// Fitted geometric parameters over their prior's sigma, zero where free.
    pub offset: DVector<f64>,
    /// Which geometric parameters are base and target.
    pub free: Vec<bool>,
}

impl Problem {
    /// The problem of `rows`; `raw` as in [`Problem::raw`].
    #[must_use]
    pub fn new(rows: &Rows, raw: DMatrix<f64>) -> Problem {
        let geometry = rows.jacobian.ncols();
        let offset = DVector::from_fn(geometry, |column, _| if rows.free[column] { 0.0 } else { rows.parameters[column] });
        Problem { raw, whitening: rows.whitening.clone(), per_row: rows.per_row, geometry, offset, free: rows.free.clone() }
    }

    /// The columns of the signatures, m and rad per unit of their coefficients.
    #[must_use]
    pub fn signatures(&self) -> DMatrixView<'_, f64> {
        self.raw.columns(self.geometry, self.raw.ncols() - 1 - self.geometry)
    }

    /// Inner products fold by fold.
    #[must_use]
    pub fn grams(&self, scheme: &Scheme) -> Vec<Gram> {
        use rayon::prelude::*;
        (0..scheme.folds)
            .into_par_iter()
            .map(|number| {
                let of_fold: Vec<usize> = (0..scheme.fold.len()).filter(|row| scheme.fold[*row] == number).collect();
                let gram = Gram::new(&self.whitening.of_rows(&self.raw, &of_fold), self.geometry);
                // A row that counts half is half an equation.
                let weight: f64 = of_fold.iter().map(|row| self.whitening.weights()[*row]).sum();
                Gram { equations: self.per_row as f64 * weight, ..gram }
            })
            .collect()
    }

    /// What geometry and the effects with these coefficients leave, m and rad.
    #[must_use]
    pub fn left(&self, surviving: &Surviving, coefficients: &DVector<f64>) -> DVector<f64> {
        let last = self.raw.ncols() - 1;
        let signatures = surviving.absorbed.columns(0, last - self.geometry);
        let change = surviving.absorbed.column(last - self.geometry) - signatures * coefficients;
        self.raw.column(last) - self.raw.columns(0, self.geometry) * change - self.signatures() * coefficients
    }
}

/// What one fold says.
#[derive(Clone, Debug)]
pub struct Fold {
    /// What it is called ([`Scheme::names`]).
    pub name: String,
    /// Rows.
    pub rows: usize,
    /// Sum of squares of the held-out positions, m²: base and target only.
    pub nominal: f64,
    /// With all geometry.
    pub geometry: f64,
    /// With all geometry and the first 1, 2, … effects chosen without the fold, as many as are used; the last stands for more.
    pub explained: Vec<f64>,
    /// What evidence chose, in the order added, whether it is used or not.
    pub chosen: Vec<usize>,
    /// Sets of hypotheses with their probabilities.
    pub models: Vec<(Vec<(usize, usize)>, f64)>,
}

impl Fold {
    /// With the first `count` effects of those that are used.
    #[must_use]
    pub fn with(&self, count: usize) -> f64 {
        match self.explained.len().min(count) {
            0 => self.geometry,
            count => self.explained[count - 1],
        }
    }

    /// With all that is used.
    #[must_use]
    pub fn all(&self) -> f64 {
        self.with(usize::MAX)
    }

    /// Whether something that evidence chose is not used.
    #[must_use]
    pub fn does_without(&self) -> bool {
        self.explained.len() < self.chosen.len()
    }
}

/// What leaving out in one way says.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// What the rows of a fold share.
    pub by: Block,
    /// Fold by fold.
    pub folds: Vec<Fold>,
}

impl HeldOut {
    /// Mean square of the held-out positions with the effects that are used, m².
    #[must_use]
    pub fn explained(&self) -> f64 {
        let rows: usize = self.folds.iter().map(|fold| fold.rows).sum();
        self.folds.iter().map(Fold::all).sum::<f64>() / rows.max(1) as f64
    }
}

/// A way of leaving rows out.
#[derive(Clone, Debug, PartialEq)]
pub struct Scheme {
    /// What the rows of a fold share.
    pub by: Block,
    /// Fold of each row.
    pub fold: Vec<usize>,
    /// Number of folds.
    pub folds: usize,
    /// What each fold is called: the payload or the session; empty for regions.
    pub names: Vec<String>,
}

/// What the rows of a fold share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// A region of the workspace.
    Region,
    /// What the tool carries.
    Payload,
    /// The session.
    Session,
}

/// The ways of leaving out that `measurements` allow: by region first, then by payload and by session where there are several. Rows of
/// a configuration stay together in a region.
#[must_use]
pub fn schemes(measurements: &[&Measurement], targets: &[Vector3<f64>], groups: &Groups) -> Vec<Scheme> {
    let points: Vec<Vector3<f64>> = groups.rows.iter().map(|rows| targets[rows[0]]).collect();
    let most = FOLDS.min(points.len() / 4).max(2);
    let of_group = regions(&points, most);
    let by_region = groups.of.iter().map(|group| of_group[*group]).collect();
    let mut schemes = vec![Scheme::new(Block::Region, by_region, &[])];
    let payload: Vec<f64> = measurements.iter().map(|row| row.payload_kg.unwrap_or(0.0)).collect();
    let session: Vec<&str> = measurements.iter().map(|row| row.session.as_deref().unwrap_or_default()).collect();
    let mut payloads = payload.clone();
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let mut sessions = session.clone();
    sessions.sort_unstable();
    sessions.dedup();
    let number = |of: &dyn Fn(usize) -> usize| (0..measurements.len()).map(of).collect::<Vec<_>>();
    let at_payload = number(&|row| payloads.iter().position(|known| *known == payload[row]).unwrap_or(0) % FOLDS);
    let at_session = number(&|row| sessions.iter().position(|known| *known == session[row]).unwrap_or(0) % FOLDS);
    let payloads: Vec<String> = payloads.iter().map(|kg| format!("{kg} kg")).collect();
    let sessions: Vec<String> = sessions.iter().map(|name| (*name).to_owned()).collect();
    for (by, fold, names) in [(Block::Payload, at_payload, payloads), (Block::Session, at_session, sessions)] {
        let scheme = Scheme::new(by, fold, &names);
        if (0..scheme.folds).any(|out| scheme.leaves_enough(out)) && scheme.folds > 1 {
            schemes.push(scheme);
        }
    }
    schemes
}

impl Scheme {
    /// Whether a quarter of the rows is left without fold `out`: less would hardly tell where the arm stands.
    fn leaves_enough(&self, out: usize) -> bool {
        4 * self.fold.iter().filter(|fold| **fold != out).count() >= self.fold.len()
    }

    /// `names`: of what each fold holds; those beyond the number of folds share one.
    fn new(by: Block, fold: Vec<usize>, names: &[String]) -> Scheme {
        // Regions may be empty.
        let mut known = fold.clone();
        known.sort_unstable();
        known.dedup();
        let fold: Vec<usize> = fold.iter().map(|of| known.binary_search(of).unwrap_or(0)).collect();
        let name = |fold: &usize| {
            let of_fold: Vec<&str> = names.iter().skip(*fold).step_by(FOLDS).map(String::as_str).collect();
            of_fold.join(", ")
        };
        Scheme { by, folds: known.len(), names: known.iter().map(name).collect(), fold }
    }
}

/// Folds blocked by region: k-means of `points` from those farthest from each other.
#[must_use]
pub fn regions(points: &[Vector3<f64>], folds: usize) -> Vec<usize> {
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
    for _ in 0..30 {
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

/// Leaves out each fold of `scheme` in turn. `good`: rows that are no outliers; only they are counted.
#[must_use]
pub fn cross_validate(
    problem: &Problem,
    scheme: &Scheme,
    good: &[bool],
    grams: &[Gram],
    candidates: &Candidates,
    noise: NoisePrior,
    most: usize,
) -> HeldOut {
    use rayon::prelude::*;
    let total = sum(grams);
    let mut folds: Vec<Fold> = (0..grams.len())
        .into_par_iter()
        .filter(|number| scheme.leaves_enough(*number))
        .filter_map(|number| {
            let rows: Vec<usize> = (0..good.len()).filter(|row| scheme.fold[*row] == number && good[*row]).collect();
            let fold = leave_out(problem, &total.without(&grams[number]), &rows, candidates, noise, most)?;
            Some(Fold { name: scheme.names[number].clone(), ..fold })
        })
        .collect();
    let used: Vec<usize> = (0..folds.len()).map(|number| used(&folds, number)).collect();
    for (fold, used) in folds.iter_mut().zip(used) {
        fold.explained.truncate(used);
    }
    HeldOut { by: scheme.by, folds }
}

/// How many of the effects chosen for fold `number` are used, by what as many of theirs did to the other folds: the most with which
/// those were predicted no worse than by geometry alone, or by no more than one standard error, for evidence has the benefit of the
/// doubt. All of them where fewer than two other folds can tell. Folds are compared, not readings: those of a region err alike.
pub(super) fn used(folds: &[Fold], number: usize) -> usize {
    let chosen = folds[number].explained.len();
    let others = || folds.iter().enumerate().filter(|(other, _)| *other != number).map(|(_, fold)| fold);
    let count = others().count() as f64;
    if count < 2.0 {
        return chosen;
    }
    let no_worse = |effects: &usize| {
        let worse: Vec<f64> = others().map(|fold| fold.with(*effects) - fold.geometry).collect();
        let mean = worse.iter().sum::<f64>() / count;
        let scatter: f64 = worse.iter().map(|worse| (worse - mean) * (worse - mean)).sum();
        mean <= libm::sqrt(scatter / (count * (count - 1.0)))
    };
    (1..=chosen).rev().find(no_worse).unwrap_or(0)
}

/// The sum of all blocks.
#[must_use]
pub fn sum(grams: &[Gram]) -> Gram {
    let mut total = grams[0].clone();
    for gram in &grams[1..] {
        total.products += &gram.products;
        total.equations += gram.equations;
    }
    total
}

/// `train`: inner products of all rows but those of the fold; `rows`: those of the fold that count.
fn leave_out(
    problem: &Problem,
    train: &Gram,
    rows: &[usize],
    candidates: &Candidates,
    noise: NoisePrior,
    most: usize,
) -> Option<Fold> {
    if rows.is_empty() {
        return None;
    }
    let surviving = train.surviving(&problem.offset)?;
    let found = search(&surviving, candidates, noise, most);
    let last = problem.raw.ncols() - 1;
    let squares = |members: &[(usize, usize)]| -> f64 {
        let coefficients = coefficients(&surviving, candidates, noise, members);
        // The geometry answers to what the effects leave.
        let signatures = surviving.absorbed.columns(0, last - problem.geometry);
        let change = surviving.absorbed.column(last - problem.geometry) - signatures * &coefficients;
        let mut sum = 0.0;
        for row in rows {
            for axis in 0..3 {
                let equation = problem.raw.row(row * problem.per_row + axis);
                let geometry: f64 = (0..problem.geometry).map(|column| equation[column] * change[column]).sum();
                let effects: f64 = members
                    .iter()
                    .flat_map(|(hypothesis, _)| candidates.columns(*hypothesis))
                    .map(|column| equation[problem.geometry + column] * coefficients[column])
                    .sum();
                let left = equation[last] - geometry - effects;
                sum += left * left;
            }
        }
        sum
    };
    let geometry = squares(&[]);
    let mut explained = Vec::new();
    for count in 1..=found.best.members.len() {
        explained.push(squares(&found.best.members[..count]));
    }
    Some(Fold {
        name: String::new(),
        rows: rows.len(),
        nominal: nominal(problem, train, rows)?,
        geometry,
        explained,
        chosen: found.best.members.iter().map(|(hypothesis, _)| *hypothesis).collect(),
        models: found.models,
    })
}

/// Base and target fitted to all other folds (inner products `train`); sum of squares of the positions of `rows`.
fn nominal(problem: &Problem, train: &Gram, rows: &[usize]) -> Option<f64> {
    let free: Vec<usize> = (0..problem.geometry).filter(|column| problem.free[*column]).collect();
    let last = problem.raw.ncols() - 1;
    // What the nominal arm leaves: the fitted frames taken back.
    let back = |equation: usize| -> f64 {
        let fitted: f64 = (0..problem.geometry).map(|column| problem.raw[(equation, column)] * problem.offset[column]).sum();
        problem.raw[(equation, last)] + fitted
    };
    let count = free.len();
    // Base and target answer to it with the priors' unit precision, as the joint fit does.
    let normal = DMatrix::from_fn(count, count, |i, j| train.products[(free[i], free[j])] + f64::from(u8::from(i == j)));
    let right = DVector::from_fn(count, |i, _| {
        let fitted: f64 = (0..problem.geometry).map(|column| train.products[(free[i], column)] * problem.offset[column]).sum();
        train.products[(free[i], last)] + fitted
    });
    let change = Cholesky::new(normal)?.solve(&right);
    let mut sum = 0.0;
    for row in rows {
        for axis in 0..3 {
            let equation = row * problem.per_row + axis;
            let fitted: f64 = (0..count).map(|at| problem.raw[(equation, free[at])] * change[at]).sum();
            let left = back(equation) - fitted;
            sum += left * left;
        }
    }
    Some(sum)
}
