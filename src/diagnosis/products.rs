//! Inner products of residuals, geometry and signatures: all that evidence needs. They add over the folds of a cross-validation, so that
//! leaving a fold out is a subtraction, and those between signatures are made when they are asked for: a search looks at the few
//! signatures that it has chosen against all others, never at all against all.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, RwLock};

use nalgebra::{Cholesky, DMatrix, DVector};

use super::evidence::Candidates;
use super::rows::Rows;
use super::signatures::{Signatures, dot};
use crate::effects::signature::shape::Reading;
use crate::numerics::gram;

/// Inner products of `[geometry | signatures | residual]`, fold by fold.
#[derive(Debug)]
pub(crate) struct Products {
    folds: Vec<Fold>,
    geometry: usize,
    /// Columns of each hypothesis.
    columns: Vec<Range<usize>>,
    /// First entry of each hypothesis among the products of its own columns.
    first_own: Vec<usize>,
    /// Of a signature's column with all columns, fold by fold: as far as it has been asked for.
    rows: RwLock<BTreeMap<usize, Arc<Vec<f64>>>>,
}

/// The rows of one fold.
#[derive(Debug)]
struct Fold {
    /// Whitened.
    signatures: Signatures,
    /// Of the geometry.
    normal: DMatrix<f64>,
    /// Of the geometry with signatures and, last, the residual.
    mixed: DMatrix<f64>,
    /// Of the columns of each hypothesis with each other.
    own: Vec<f64>,
    with_residual: Vec<f64>,
    residual: f64,
    equations: f64,
}

fn column(matrix: &DMatrix<f64>, number: usize) -> &[f64] {
    let rows = matrix.nrows();
    &matrix.as_slice()[number * rows..(number + 1) * rows]
}

impl Products {
    /// Of the signatures of `candidates` at `readings`, of the geometry of `rows`, and of `residual` (m and rad, as it is without any
    /// effect taken out). `fold`: of each row; there are `folds` of them.
    #[must_use]
    pub(crate) fn new(
        rows: &Rows,
        readings: &[Reading],
        candidates: &Candidates,
        residual: &DVector<f64>,
        fold: &[usize],
        folds: usize,
    ) -> Products {
        Products::counted(rows, readings, candidates, residual, fold, folds, 1.0)
    }

    /// The same with each row counted `count` times: rows that stand for others.
    #[must_use]
    pub(crate) fn counted(
        rows: &Rows,
        readings: &[Reading],
        candidates: &Candidates,
        residual: &DVector<f64>,
        fold: &[usize],
        folds: usize,
        count: f64,
    ) -> Products {
        use rayon::prelude::*;
        let columns: Vec<Range<usize>> = (0..candidates.hypotheses.len()).map(|number| candidates.columns(number)).collect();
        let mut first_own = Vec::with_capacity(columns.len());
        let mut entries = 0;
        for columns in &columns {
            first_own.push(entries);
            entries += columns.len() * columns.len();
        }
        let of_fold = |number: usize| {
            let own_rows: Vec<usize> = (0..fold.len()).filter(|row| fold[*row] == number).collect();
            Fold::new(rows, readings, candidates, residual, &own_rows, &columns, count)
        };
        let folds = (0..folds).into_par_iter().map(of_fold).collect();
        Products { folds, geometry: rows.jacobian.ncols(), columns, first_own, rows: RwLock::default() }
    }

    fn width(&self) -> usize {
        self.columns.last().map_or(0, |last| last.end)
    }

    /// All columns of the hypothesis that column `number` belongs to.
    fn beside(&self, number: usize) -> Range<usize> {
        let hypothesis = self.columns.partition_point(|columns| columns.end <= number);
        self.columns[hypothesis].clone()
    }

    /// Products of column `number` with every column: as many numbers per fold as there are columns.
    fn of_column(&self, number: usize) -> Arc<Vec<f64>> {
        if let Ok(known) = self.rows.read()
            && let Some(row) = known.get(&number)
        {
            return Arc::clone(row);
        }
        let width = self.width();
        let block = self.beside(number);
        let mut rows = vec![vec![0.0; width * self.folds.len()]; block.len()];
        for (number, fold) in self.folds.iter().enumerate() {
            let parts = &mut rows.iter_mut().map(|row| &mut row[number * width..(number + 1) * width]).collect::<Vec<_>>();
            fold.signatures.add_products(block.clone(), parts);
        }
        let rows: Vec<Arc<Vec<f64>>> = rows.into_iter().map(Arc::new).collect();
        let asked = Arc::clone(&rows[number - block.start]);
        if let Ok(mut known) = self.rows.write() {
            known.extend(block.zip(rows));
        }
        asked
    }
}

impl Fold {
    fn new(
        rows: &Rows,
        readings: &[Reading],
        candidates: &Candidates,
        residual: &DVector<f64>,
        own_rows: &[usize],
        columns: &[Range<usize>],
        count: f64,
    ) -> Fold {
        let orientation = rows.equations.has_orientation();
        let (geometry, width) = (rows.jacobian.ncols(), columns.last().map_or(0, |last| last.end));
        let equations = own_rows.iter().map(|row| rows.equations.of(*row).len()).sum();
        let mut jacobian = DMatrix::zeros(equations, geometry);
        let mut left = vec![0.0; equations];
        let root = libm::sqrt(count);
        let first: Vec<usize> = own_rows
            .iter()
            .scan(0, |to, row| {
                let first = *to;
                *to += rows.equations.of(*row).len();
                Some(first)
            })
            .collect();
        let mut values = Vec::new();
        for (row, to) in own_rows.iter().zip(&first) {
            let equations = rows.equations.of(*row);
            for parameter in 0..geometry {
                values.clear();
                values.extend(equations.clone().map(|equation| rows.jacobian[(equation, parameter)]));
                rows.whitening.apply(*row, &mut values);
                values.iter().enumerate().for_each(|(i, value)| jacobian[(to + i, parameter)] = value * root);
            }
            values.clear();
            values.extend(equations.map(|equation| residual[equation]));
            rows.whitening.apply(*row, &mut values);
            values.iter().enumerate().for_each(|(i, value)| left[to + i] = value * root);
        }
        let mut signatures = Signatures::new(equations);
        let mut own_columns: Vec<f32> = Vec::new();
        for (hypothesis, of) in candidates.hypotheses.iter().enumerate() {
            let unit = candidates.unit[hypothesis];
            own_columns.clear();
            own_columns.resize(equations * columns[hypothesis].len(), 0.0);
            for (row, to) in own_rows.iter().zip(&first) {
                for (i, moved) in of.shape.columns(&readings[*row], orientation).iter().enumerate() {
                    if moved.iter().all(|value| *value == 0.0) {
                        continue;
                    }
                    let factor = unit * of.spread[i];
                    values.clear();
                    values.extend(rows.read(*row, moved).map(|moved| moved * factor));
                    rows.whitening.apply(*row, &mut values);
                    let from = i * equations + to;
                    values.iter().enumerate().for_each(|(i, value)| own_columns[from + i] = (value * root) as f32);
                }
            }
            (0..columns[hypothesis].len()).for_each(|i| signatures.push(&own_columns[i * equations..(i + 1) * equations]));
        }
        let normal = gram(&jacobian);
        let mixed = DMatrix::from_fn(geometry, width + 1, |parameter, other| {
            let of_parameter = column(&jacobian, parameter);
            if other < width { signatures.with(other, of_parameter) } else { dot(of_parameter, &left) }
        });
        let own = columns
            .iter()
            .flat_map(|of| of.clone().flat_map(move |a| of.clone().map(move |b| (a, b))))
            .map(|(a, b)| signatures.between(a, b))
            .collect();
        let with_residual = (0..width).map(|number| signatures.with(number, &left)).collect();
        // A row that counts half is half an equation.
        let weight = |row: &usize| count * rows.equations.of(*row).len() as f64 * rows.whitening.weights()[*row];
        Fold {
            residual: dot(&left, &left),
            equations: own_rows.iter().map(weight).sum(),
            signatures,
            normal,
            mixed,
            own,
            with_residual,
        }
    }
}

/// What is known of the geometry before the readings: the fitted values over the sigmas of their priors (zero where free), and by how
/// much those sigmas are too large (one: as they are).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GeometryPrior {
    /// Fitted values over sigma.
    pub(crate) offset: DVector<f64>,
    /// Which parameters are free.
    pub(crate) free: Vec<bool>,
    /// Sigma over that of the fit.
    pub(crate) scale: f64,
    /// What is known besides, such as distances of fixed points: residuals in sigmas, and what the parameters do to them.
    pub(crate) known: (DVector<f64>, DMatrix<f64>),
}

impl GeometryPrior {
    fn precision(&self, parameter: usize) -> f64 {
        if self.free[parameter] { 1.0 } else { 1.0 / (self.scale * self.scale) }
    }

    /// The same with another scale.
    #[must_use]
    pub(crate) fn scaled(&self, scale: f64) -> GeometryPrior {
        GeometryPrior { scale, ..self.clone() }
    }
}

/// What is left once the geometry has been fitted jointly: inner products of what survives of signatures and residual.
#[derive(Debug)]
pub(crate) struct Marginal<'a> {
    products: &'a Products,
    left_out: Option<usize>,
    /// Of geometry with signatures and residual, the prior's pull taken off the residual's.
    mixed: DMatrix<f64>,
    /// The geometry's change per unit of each signature and, last, of the residual.
    absorbed: DMatrix<f64>,
    /// Of geometry with itself, the priors' precisions added.
    normal: DMatrix<f64>,
    own: Vec<f64>,
    /// Of signatures with the residual.
    pub(crate) with_residual: Vec<f64>,
    /// Of the residual with itself.
    pub(crate) residual: f64,
    /// Equations that the geometry leaves.
    pub(crate) degrees_of_freedom: f64,
    /// Equations beyond the parameters that have no prior.
    pub(crate) beyond_free: f64,
    /// Logarithm of the evidence's part that the geometry's prior decides: half the log determinant of prior precision over posterior's.
    pub(crate) log_geometry: f64,
    rows: RwLock<BTreeMap<usize, Arc<Vec<f64>>>>,
}

impl<'a> Marginal<'a> {
    /// Of all rows, or of all but those of the fold `left_out`. `None` where the rows do not tell where the arm stands.
    #[must_use]
    pub(crate) fn new(products: &'a Products, left_out: Option<usize>, prior: &GeometryPrior) -> Option<Marginal<'a>> {
        let count = products.geometry;
        let folds: Vec<&Fold> =
            products.folds.iter().enumerate().filter(|(number, _)| Some(*number) != left_out).map(|(_, fold)| fold).collect();
        let first = folds.first()?;
        let (mut normal, mut mixed, mut own) = (first.normal.clone(), first.mixed.clone(), first.own.clone());
        let (mut with_residual, mut residual, mut equations) = (first.with_residual.clone(), first.residual, first.equations);
        for fold in &folds[1..] {
            normal += &fold.normal;
            mixed += &fold.mixed;
            own.iter_mut().zip(&fold.own).for_each(|(sum, value)| *sum += value);
            with_residual.iter_mut().zip(&fold.with_residual).for_each(|(sum, value)| *sum += value);
            residual += fold.residual;
            equations += fold.equations;
        }
        let last = mixed.ncols() - 1;
        let mut log_geometry = 0.0;
        for parameter in 0..count {
            let (precision, offset) = (prior.precision(parameter), prior.offset[parameter]);
            normal[(parameter, parameter)] += precision;
            mixed[(parameter, last)] -= precision * offset;
            residual += precision * offset * offset;
            log_geometry += 0.5 * libm::log(precision);
        }
        let (of_known, by_known) = &prior.known;
        if !of_known.is_empty() {
            normal += by_known.tr_mul(by_known);
            let mut of_residual = mixed.column_mut(last);
            of_residual += by_known.tr_mul(of_known);
            residual += of_known.norm_squared();
        }
        let cholesky = Cholesky::new(normal.clone())?;
        let absorbed = cholesky.solve(&mixed);
        let inverse = cholesky.inverse();
        let pinned: f64 = (0..count).map(|i| prior.precision(i) * inverse[(i, i)]).sum();
        log_geometry -= (0..count).map(|i| libm::log(cholesky.l_dirty()[(i, i)])).sum::<f64>();
        let taken = |a: usize, b: usize| dot(column(&mixed, a), column(&absorbed, b));
        for (hypothesis, columns) in products.columns.iter().enumerate() {
            let (first, width) = (products.first_own[hypothesis], columns.len());
            for i in 0..width {
                for j in 0..width {
                    own[first + i * width + j] -= taken(columns.start + i, columns.start + j);
                }
            }
        }
        for (number, value) in with_residual.iter_mut().enumerate() {
            *value -= taken(number, last);
        }
        let residual = (residual - taken(last, last)).max(1e-12);
        Some(Marginal {
            degrees_of_freedom: (equations - (count as f64 - pinned)).max(1.0),
            beyond_free: (equations - prior.free.iter().filter(|free| **free).count() as f64).max(1.0),
            products,
            left_out,
            mixed,
            absorbed,
            normal,
            own,
            with_residual,
            residual,
            log_geometry,
            rows: RwLock::default(),
        })
    }

    /// What survives of column `number` with every column.
    #[must_use]
    pub(crate) fn row(&self, number: usize) -> Arc<Vec<f64>> {
        if let Ok(known) = self.rows.read()
            && let Some(row) = known.get(&number)
        {
            return Arc::clone(row);
        }
        let width = self.products.width();
        let block = self.products.beside(number);
        let mut rows = vec![vec![0.0; width]; block.len()];
        if self.left_out.is_some() {
            for (row, number) in rows.iter_mut().zip(block.clone()) {
                let by_fold = self.products.of_column(number);
                for (fold, values) in by_fold.chunks_exact(width.max(1)).enumerate() {
                    if Some(fold) != self.left_out {
                        row.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                    }
                }
            }
        } else {
            // Of many columns, which no fold asks for.
            for fold in &self.products.folds {
                let parts = &mut rows.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>();
                fold.signatures.add_products(block.clone(), parts);
            }
        }
        for (row, number) in rows.iter_mut().zip(block.clone()) {
            let mixed = column(&self.mixed, number);
            for (other, value) in row.iter_mut().enumerate() {
                *value -= dot(mixed, column(&self.absorbed, other));
            }
        }
        let rows: Vec<Arc<Vec<f64>>> = rows.into_iter().map(Arc::new).collect();
        let asked = Arc::clone(&rows[number - block.start]);
        if let Ok(mut known) = self.rows.write() {
            known.extend(block.zip(rows));
        }
        asked
    }

    /// What survives of `these` columns with each other: where nobody asks for those with all others, far less than [`Marginal::row`].
    #[must_use]
    pub(crate) fn between(&self, these: &[usize]) -> DMatrix<f64> {
        let known: Vec<Option<Arc<Vec<f64>>>> = match self.rows.read() {
            Ok(rows) => these.iter().map(|number| rows.get(number).cloned()).collect(),
            Err(_) => vec![None; these.len()],
        };
        let folds = || self.products.folds.iter().enumerate().filter(|(number, _)| Some(*number) != self.left_out);
        let mut between = DMatrix::zeros(these.len(), these.len());
        for (i, a) in these.iter().enumerate() {
            for (j, b) in these.iter().enumerate().skip(i) {
                let value = match (&known[i], &known[j]) {
                    (Some(row), _) => row[*b],
                    (None, Some(row)) => row[*a],
                    (None, None) => {
                        let all: f64 = folds().map(|(_, fold)| fold.signatures.between(*a, *b)).sum();
                        all - dot(column(&self.mixed, *a), column(&self.absorbed, *b))
                    }
                };
                (between[(i, j)], between[(j, i)]) = (value, value);
            }
        }
        between
    }

    /// What survives of columns `i` and `j` of `hypothesis`, counted from its first.
    #[must_use]
    pub(crate) fn own(&self, hypothesis: usize, i: usize, j: usize) -> f64 {
        let width = self.products.columns[hypothesis].len();
        self.own[self.products.first_own[hypothesis] + i * width + j]
    }

    /// What survives of the columns of each hypothesis with each other, one hypothesis after the other, row by row.
    #[must_use]
    pub(crate) fn own_blocks(&self) -> &[f64] {
        &self.own
    }

    /// Where those of `hypothesis` begin.
    #[must_use]
    pub(crate) fn first_own(&self, hypothesis: usize) -> usize {
        self.products.first_own[hypothesis]
    }

    /// Information about a coefficient of one of all columns of `hypothesis`: the trace of its block.
    #[must_use]
    pub(crate) fn information(&self, hypothesis: usize) -> f64 {
        (0..self.products.columns[hypothesis].len()).map(|i| self.own(hypothesis, i, i)).sum()
    }

    /// Of the information about `hypothesis`, the share of each of its columns.
    #[must_use]
    pub(crate) fn shares(&self, hypothesis: usize) -> Vec<f64> {
        let all = self.information(hypothesis).max(1e-300);
        (0..self.products.columns[hypothesis].len()).map(|i| self.own(hypothesis, i, i).max(0.0) / all).collect()
    }

    /// The geometry's change beside signatures with these coefficients (column and value).
    #[must_use]
    pub(crate) fn geometry(&self, coefficients: &[(usize, f64)]) -> DVector<f64> {
        let last = self.absorbed.ncols() - 1;
        let mut change = self.absorbed.column(last).into_owned();
        for (number, value) in coefficients {
            change.axpy(-value, &self.absorbed.column(*number), 1.0);
        }
        change
    }

    /// The geometry's change per unit of column `number`.
    #[must_use]
    pub(crate) fn absorbed(&self, number: usize) -> DVector<f64> {
        self.absorbed.column(number).into_owned()
    }

    /// The geometry's change where base and target are fitted and all else is nominal.
    #[must_use]
    pub(crate) fn free_only(&self, prior: &GeometryPrior) -> Option<DVector<f64>> {
        let free: Vec<usize> = (0..self.products.geometry).filter(|parameter| prior.free[*parameter]).collect();
        let last = self.mixed.ncols() - 1;
        let normal = DMatrix::from_fn(free.len(), free.len(), |i, j| self.normal[(free[i], free[j])]);
        // What is fitted of the frames is taken back, and with it what it does to the readings.
        let right = DVector::from_fn(free.len(), |i, _| {
            let back: f64 = (0..self.products.geometry).map(|j| self.normal[(free[i], j)] * prior.offset[j]).sum();
            self.mixed[(free[i], last)] + back
        });
        let change = Cholesky::new(normal)?.solve(&right);
        let mut all = -&prior.offset;
        for (at, parameter) in free.iter().enumerate() {
            all[*parameter] += change[at];
        }
        Some(all)
    }
}

/// Products of made-up signatures without any geometry, for tests of what is made of them.
#[cfg(test)]
pub(super) struct TestProducts(Products);

#[cfg(test)]
impl TestProducts {
    pub(super) fn marginal(&self) -> Marginal<'_> {
        let prior = GeometryPrior {
            offset: DVector::zeros(0),
            free: Vec::new(),
            scale: 1.0,
            known: (DVector::zeros(0), DMatrix::zeros(0, 0)),
        };
        Marginal::new(&self.0, None, &prior).unwrap()
    }
}

#[cfg(test)]
pub(super) fn test_marginal(candidates: &Candidates, signatures: &DMatrix<f64>, residual: &DVector<f64>) -> TestProducts {
    let columns: Vec<Range<usize>> = (0..candidates.hypotheses.len()).map(|number| candidates.columns(number)).collect();
    let signatures = &signatures.map(|value| f64::from(value as f32));
    let (mut first_own, mut own) = (Vec::new(), Vec::new());
    for of in &columns {
        first_own.push(own.len());
        own.extend(
            of.clone()
                .flat_map(|a| of.clone().map(move |b| (a, b)))
                .map(|(a, b)| signatures.column(a).dot(&signatures.column(b))),
        );
    }
    let width = signatures.ncols();
    let mut whole = Signatures::new(signatures.nrows());
    signatures.column_iter().for_each(|column| {
        whole.push(&column.iter().map(|value| *value as f32).collect::<Vec<_>>());
    });
    let fold = Fold {
        signatures: whole,
        normal: DMatrix::zeros(0, 0),
        mixed: DMatrix::zeros(0, width + 1),
        own,
        with_residual: signatures.tr_mul(residual).as_slice().to_vec(),
        residual: residual.norm_squared(),
        equations: signatures.nrows() as f64,
    };
    TestProducts(Products { folds: vec![fold], geometry: 0, columns, first_own, rows: RwLock::default() })
}
