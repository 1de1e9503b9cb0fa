//! Nested cross-validation: effects are chosen again without each fold, and the fold shows what they are worth.

use nalgebra::{DMatrix, DVector, Vector3};

use super::evidence::{Candidates, NoisePrior, fit};
use super::gram::{Gram, Surviving};
use super::search::search;

/// Rows of the linear problem with what the search needs.
pub struct Problem<'a> {
    /// `[geometry | signatures | residual]`, m and rad.
    pub raw: &'a DMatrix<f64>,
    /// One over sigma of each equation.
    pub whitening: &'a DVector<f64>,
    /// Equations per row.
    pub per_row: usize,
    /// Geometric parameters.
    pub geometry: usize,
    /// Fitted geometric parameters over their prior's sigma, zero where free.
    pub offset: &'a DVector<f64>,
    /// Which geometric parameters are base and target.
    pub free: &'a [bool],
    /// Fold of each row.
    pub fold: &'a [usize],
    /// Rows that are no outliers.
    pub good: &'a [bool],
}

/// What one fold says.
#[derive(Clone, Debug)]
pub struct Fold {
    /// Rows.
    pub rows: usize,
    /// Sum of squares of the held-out positions, m²: base and target only.
    pub nominal: f64,
    /// With all geometry.
    pub geometry: f64,
    /// With all geometry and the first 1, 2, … effects chosen without the fold; the last stands for more.
    pub explained: Vec<f64>,
    /// What was chosen, in the order added.
    pub chosen: Vec<usize>,
}

/// Folds blocked by region: k-means of the targets from the points farthest from each other.
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

/// Leaves out each fold in turn.
#[must_use]
pub fn cross_validate(
    problem: &Problem<'_>,
    grams: &[Gram],
    candidates: &Candidates,
    noise: NoisePrior,
    most: usize,
) -> Vec<Fold> {
    use rayon::prelude::*;
    let total = sum(grams);
    (0..grams.len())
        .into_par_iter()
        .filter_map(|number| leave_out(problem, &total, grams, number, candidates, noise, most))
        .collect()
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

fn leave_out(
    problem: &Problem<'_>,
    total: &Gram,
    grams: &[Gram],
    number: usize,
    candidates: &Candidates,
    noise: NoisePrior,
    most: usize,
) -> Option<Fold> {
    let train = total.without(&grams[number]);
    let all = vec![true; problem.geometry];
    let surviving = train.surviving(&all, problem.offset)?;
    let found = search(&surviving, candidates, noise, most);
    let rows: Vec<usize> = (0..problem.fold.len()).filter(|row| problem.fold[*row] == number && problem.good[*row]).collect();
    if rows.is_empty() {
        return None;
    }
    let last = problem.raw.ncols() - 1;
    let squares = |surviving: &Surviving, members: &[(usize, usize)]| -> Option<f64> {
        let mut coefficients = DVector::zeros(last - problem.geometry);
        if !members.is_empty() {
            let fit = fit(surviving, candidates, noise, members)?;
            for (column, value) in fit.columns.iter().zip(fit.coefficients.iter()) {
                coefficients[*column] = *value;
            }
        }
        // The geometry answers to what the effects leave.
        let signatures = surviving.absorbed.columns(0, last - problem.geometry);
        let change = surviving.absorbed.column(last - problem.geometry) - signatures * &coefficients;
        let mut sum = 0.0;
        for row in &rows {
            for axis in 0..3 {
                let equation = problem.raw.row(row * problem.per_row + axis);
                let geometry: f64 = (0..problem.geometry).map(|column| equation[column] * change[column]).sum();
                let effects: f64 = surviving_columns(members, candidates)
                    .map(|column| equation[problem.geometry + column] * coefficients[column])
                    .sum();
                let left = equation[last] - geometry - effects;
                sum += left * left;
            }
        }
        Some(sum)
    };
    let geometry = squares(&surviving, &[])?;
    let mut explained = Vec::new();
    for count in 1..=found.best.members.len() {
        explained.push(squares(&surviving, &found.best.members[..count])?);
    }
    Some(Fold {
        rows: rows.len(),
        nominal: nominal(problem, number, &rows)?,
        geometry,
        explained,
        chosen: found.best.members.iter().map(|(hypothesis, _)| *hypothesis).collect(),
    })
}

fn surviving_columns<'a>(members: &'a [(usize, usize)], candidates: &'a Candidates) -> impl Iterator<Item = usize> + 'a {
    members.iter().flat_map(|(hypothesis, _)| candidates.columns(*hypothesis))
}

/// Base and target fitted to all other folds; sum of squares of this fold's positions.
fn nominal(problem: &Problem<'_>, number: usize, rows: &[usize]) -> Option<f64> {
    let free: Vec<usize> = (0..problem.geometry).filter(|column| problem.free[*column]).collect();
    let last = problem.raw.ncols() - 1;
    let equations = problem.raw.nrows();
    // What the nominal arm leaves: the fitted frames taken back.
    let back = DVector::from_fn(problem.geometry, |column, _| problem.offset[column]);
    let residual = problem.raw.column(last) + problem.raw.columns(0, problem.geometry) * back;
    let mut matrix = DMatrix::zeros(equations, free.len() + 1);
    for (at, column) in free.iter().enumerate() {
        matrix.set_column(at, &problem.raw.column(*column));
    }
    matrix.set_column(free.len(), &residual);
    let mut whitening = problem.whitening.clone();
    for row in 0..problem.fold.len() {
        if problem.fold[row] == number {
            whitening.rows_mut(row * problem.per_row, problem.per_row).fill(0.0);
        }
    }
    let gram = Gram::new(&super::rows::scaled(&matrix, &whitening), free.len());
    let change = gram.surviving(&vec![true; free.len()], &DVector::zeros(free.len()))?.absorbed;
    let mut sum = 0.0;
    for row in rows {
        for axis in 0..3 {
            let equation = row * problem.per_row + axis;
            let fitted: f64 = (0..free.len()).map(|at| matrix[(equation, at)] * change[(at, 0)]).sum();
            let left = matrix[(equation, free.len())] - fitted;
            sum += left * left;
        }
    }
    Some(sum)
}
