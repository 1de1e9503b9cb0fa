//! A set chosen from a pool of candidates, to which candidates are added and from which they are taken: what adding or taking any
//! of them would do to the criterion.
//!
//! For determinants and mean variances there are formulas: with V = X M⁻¹ Xᵀ of a candidate's block X, log det M grows by
//! log det(I + V) where it is added and falls by −log det(I − V) where it is taken; tr(L M⁻¹) falls by tr((I + V)⁻¹ W) and grows by
//! tr((I − V)⁻¹ W), where W = X M⁻¹ L M⁻¹ Xᵀ. V and W of all candidates are brought up to date by a change of low rank (Woodbury)
//! rather than computed anew: that is what makes exchange methods fast. Other criteria are valued set by set.

use std::sync::Arc;

use rayon::prelude::*;

use super::objective::{ObjectiveScratch, Set};
use super::problem::Criterion;
use super::search::Task;
use crate::numerics::dense;
use crate::quality::information::Blocks;

/// Changes after which V and W are computed anew, so that rounding does not pile up.
const REFRESH: usize = 64;
/// Candidates that one thread looks at in a row.
const CHUNK: usize = 64;

/// A set of members of a pool.
#[derive(Clone)]
pub(super) enum PoolSet<'a> {
    /// By formula.
    Fast(Box<FastSet<'a>>),
    /// Set by set.
    Plain(Box<PlainSet<'a>>),
}

/// A set of a pool, valued set by set.
#[derive(Clone)]
pub(super) struct PlainSet<'a> {
    task: &'a Task<'a>,
    pool: &'a [f64],
    members: Vec<usize>,
    set: Set<'a>,
    value: f64,
    scratch: ObjectiveScratch,
}

/// A set of a pool, valued by formula.
#[derive(Clone)]
pub(super) struct FastSet<'a> {
    task: &'a Task<'a>,
    blocks: Arc<Blocks>,
    /// L of the mean variance; none for the determinant.
    weight: Option<&'a [f64]>,
    members: Vec<usize>,
    /// Information, both triangles.
    information: Vec<f64>,
    inverse: Vec<f64>,
    /// V of every candidate, `rows × rows` each.
    v: Vec<f64>,
    /// W of every candidate; empty for the determinant.
    w: Vec<f64>,
    log_determinant: f64,
    mean_variance: f64,
    changes: usize,
}

impl<'a> PoolSet<'a> {
    /// The set of `members` (indexes, repetitions allowed) of `pool` (configurations one after the other).
    pub(super) fn new(task: &'a Task<'a>, pool: &'a [f64], members: Vec<usize>) -> Self {
        let weight = match task.objective.criterion() {
            Criterion::DOptimality => None,
            Criterion::IOptimality => Some(task.objective.models().workspace.position_matrix()),
            _ => return PoolSet::Plain(Box::new(PlainSet::new(task, pool, members))),
        };
        PoolSet::Fast(Box::new(FastSet::new(task, pool, weight, members)))
    }

    /// Members, in no order.
    pub(super) fn members(&self) -> &[usize] {
        match self {
            PoolSet::Fast(set) => &set.members,
            PoolSet::Plain(set) => &set.members,
        }
    }

    /// Value of the set.
    pub(super) fn value(&self) -> f64 {
        match self {
            PoolSet::Fast(set) => set.value(),
            PoolSet::Plain(set) => set.value,
        }
    }

    /// Adds the candidate that makes the value largest.
    pub(super) fn add_best(&mut self) {
        match self {
            PoolSet::Fast(set) => {
                let gains = set.gains(1.0);
                set.change(largest(&gains), 1.0);
            }
            PoolSet::Plain(set) => set.add_best(),
        }
    }

    /// Takes the member out without which the value is largest.
    pub(super) fn remove_worst(&mut self) {
        match self {
            PoolSet::Fast(set) => {
                set.task.spend(set.members.len() as u64);
                let losses: Vec<f64> = set.members.iter().map(|member| set.gain(*member, -1.0)).collect();
                let position = largest(&losses);
                let member = set.members.remove(position);
                set.change(member, -1.0);
            }
            PoolSet::Plain(set) => set.remove_worst(),
        }
    }
}

/// Index of the largest value, the first of equals; NaN is smallest.
fn largest(values: &[f64]) -> usize {
    (1..values.len()).fold(0, |first, index| if values[index] > values[first] || values[first].is_nan() { index } else { first })
}

impl<'a> PlainSet<'a> {
    fn new(task: &'a Task<'a>, pool: &'a [f64], members: Vec<usize>) -> Self {
        let joints = task.arm().joint_count();
        let configurations = members.iter().flat_map(|member| &pool[member * joints..(member + 1) * joints]).copied().collect();
        let mut scratch = ObjectiveScratch::default();
        let set = Set::new(task.objective, configurations, &mut scratch);
        task.spend(1);
        let value = set.value(&mut scratch);
        PlainSet { task, pool, members, set, value, scratch }
    }

    fn candidate(&self, index: usize) -> &'a [f64] {
        let joints = self.task.arm().joint_count();
        &self.pool[index * joints..(index + 1) * joints]
    }

    fn add_best(&mut self) {
        let count = self.pool.len() / self.task.arm().joint_count();
        self.task.spend(count as u64);
        let values: Vec<f64> = (0..count)
            .into_par_iter()
            .with_min_len(CHUNK / 8)
            .map_init(ObjectiveScratch::default, |scratch, index| self.set.value_plus(self.candidate(index), scratch))
            .collect();
        let best = largest(&values);
        let joints = self.candidate(best);
        self.set.push(joints, &mut self.scratch);
        self.members.push(best);
        self.value = values[best];
    }

    fn remove_worst(&mut self) {
        self.task.spend(self.members.len() as u64);
        let values: Vec<f64> = (0..self.members.len())
            .into_par_iter()
            .map_init(ObjectiveScratch::default, |scratch, index| self.set.value_without(index, scratch))
            .collect();
        let worst = largest(&values);
        self.set.remove(worst);
        self.members.remove(worst);
        self.value = values[worst];
    }
}

impl<'a> FastSet<'a> {
    fn new(task: &'a Task<'a>, pool: &[f64], weight: Option<&'a [f64]>, members: Vec<usize>) -> Self {
        let models = task.objective.models();
        let blocks = Arc::new(Blocks::of(&models.information, pool, task.arm().joint_count()));
        let rank = blocks.rank();
        let mut information = vec![0.0; rank * rank];
        models.add_ridge(&mut information);
        for member in &members {
            dense::add_gram(blocks.get(*member), 1.0, rank, &mut information);
        }
        dense::mirror(&mut information, rank);
        task.spend(1);
        let mut set = FastSet {
            task,
            weight,
            members,
            information,
            inverse: Vec::new(),
            v: Vec::new(),
            w: Vec::new(),
            log_determinant: 0.0,
            mean_variance: 0.0,
            changes: 0,
            blocks,
        };
        set.refresh();
        set
    }

    fn value(&self) -> f64 {
        match self.weight {
            None => self.log_determinant / self.blocks.rank() as f64,
            Some(_) => -libm::log(self.mean_variance),
        }
    }

    /// Everything from the information alone.
    fn refresh(&mut self) {
        let (rank, rows) = (self.blocks.rank(), self.blocks.rows_per_pose());
        let mut factor = self.information.clone();
        // The ridge keeps it positive definite; if rounding does not, the formulas go on from what they have.
        if !dense::cholesky(&mut factor, rank) {
            return;
        }
        self.log_determinant = dense::log_determinant(&factor, rank);
        self.inverse = dense::inverse(&factor, rank);
        let inverse = &self.inverse;
        let of_candidates = |middle: &[f64]| -> Vec<f64> {
            let chunks: Vec<Vec<f64>> = (0..self.blocks.len())
                .into_par_iter()
                .with_min_len(CHUNK)
                .map(|index| sandwich(self.blocks.get(index), middle, rank, rows))
                .collect();
            chunks.concat()
        };
        self.v = of_candidates(inverse);
        if let Some(weight) = self.weight {
            self.mean_variance = dense::dot(weight, inverse);
            let half = symmetric_product(inverse, weight, rank);
            self.w = of_candidates(&symmetric_product(&half, inverse, rank));
        }
        self.changes = 0;
    }

    /// By how much the value's measure (log det, or minus the mean variance) grows if a candidate is added (`sign` 1) or taken (−1).
    fn gain(&self, candidate: usize, sign: f64) -> f64 {
        let rows = self.blocks.rows_per_pose();
        let size = rows * rows;
        let mut factor = [0.0; 36];
        let factor = &mut factor[..size];
        let v = &self.v[candidate * size..(candidate + 1) * size];
        for (i, (entry, value)) in factor.iter_mut().zip(v).enumerate() {
            *entry = sign * value + if i % (rows + 1) == 0 { 1.0 } else { 0.0 };
        }
        if !dense::cholesky(factor, rows) {
            // Without it the parameters are not determined.
            return f64::NEG_INFINITY;
        }
        if self.weight.is_none() {
            // Determinants compare like their logarithms.
            return (0..rows).map(|i| factor[i * rows + i]).product();
        }
        // tr((I ± V)⁻¹ W), column by column.
        let w = &self.w[candidate * size..(candidate + 1) * size];
        let inverse = dense::inverse(factor, rows);
        sign * dense::dot(&inverse, w)
    }

    fn gains(&self, sign: f64) -> Vec<f64> {
        self.task.spend(self.blocks.len() as u64);
        (0..self.blocks.len()).into_par_iter().with_min_len(CHUNK).map(|candidate| self.gain(candidate, sign)).collect()
    }

    /// Adds or takes a candidate, and brings V and W of all up to date.
    fn change(&mut self, candidate: usize, sign: f64) {
        let (rank, rows) = (self.blocks.rank(), self.blocks.rows_per_pose());
        let size = rows * rows;
        let blocks = Arc::clone(&self.blocks);
        let block = blocks.get(candidate);
        if sign > 0.0 {
            self.members.push(candidate);
        }
        dense::add_gram(block, sign, rank, &mut self.information);
        dense::mirror(&mut self.information, rank);
        self.changes += 1;
        if self.changes >= REFRESH {
            self.refresh();
            return;
        }
        // B = M⁻¹ Xᵀ R with R Rᵀ = (I + sV)⁻¹, as rows of Bᵀ.
        let mut factor: Vec<f64> = self.v[candidate * size..(candidate + 1) * size].iter().map(|value| sign * value).collect();
        (0..rows).for_each(|i| factor[i * rows + i] += 1.0);
        if !dense::cholesky(&mut factor, rows) {
            self.refresh();
            return;
        }
        self.log_determinant += dense::log_determinant(&factor, rows);
        let mut b = vec![0.0; rows * rank];
        for (row, out) in block.chunks_exact(rank).zip(b.chunks_exact_mut(rank)) {
            for (entry, inverse_row) in out.iter_mut().zip(self.inverse.chunks_exact(rank)) {
                *entry = dense::dot(row, inverse_row);
            }
        }
        // L⁻¹ from the left: forward substitution on whole rows.
        for i in 0..rows {
            let (done, rest) = b.split_at_mut(i * rank);
            let target = &mut rest[..rank];
            for (j, source) in done.chunks_exact(rank).enumerate() {
                let share = factor[i * rows + j];
                target.iter_mut().zip(source).for_each(|(entry, value)| *entry -= share * value);
            }
            let over = 1.0 / factor[i * rows + i];
            target.iter_mut().for_each(|entry| *entry *= over);
        }
        // Q = M⁻¹ L B and T = Bᵀ L B, with the inverse as it was.
        let (mut q, mut t) = (Vec::new(), vec![0.0; size]);
        if let Some(weight) = self.weight {
            let mut lb = vec![0.0; rows * rank];
            for (row, out) in b.chunks_exact(rank).zip(lb.chunks_exact_mut(rank)) {
                out.iter_mut().zip(weight.chunks_exact(rank)).for_each(|(entry, line)| *entry = dense::dot(row, line));
            }
            q.resize(rows * rank, 0.0);
            for (row, out) in lb.chunks_exact(rank).zip(q.chunks_exact_mut(rank)) {
                out.iter_mut().zip(self.inverse.chunks_exact(rank)).for_each(|(entry, line)| *entry = dense::dot(row, line));
            }
            for (i, row) in b.chunks_exact(rank).enumerate() {
                for (j, other) in lb.chunks_exact(rank).enumerate() {
                    t[i * rows + j] = dense::dot(row, other);
                }
            }
            self.mean_variance -= sign * (0..rows).map(|i| t[i * rows + i]).sum::<f64>();
        }
        // M⁻¹ − s B Bᵀ.
        for row in b.chunks_exact(rank) {
            for (value, line) in row.iter().zip(self.inverse.chunks_exact_mut(rank)) {
                let share = sign * value;
                line.iter_mut().zip(row).for_each(|(entry, other)| *entry -= share * other);
            }
        }
        let update = |index: usize, v: &mut [f64], w: Option<&mut [f64]>| {
            let block = self.blocks.get(index);
            let mut z = [0.0; 36];
            multiply(block, &b, rank, rows, &mut z);
            for i in 0..rows {
                for j in 0..rows {
                    v[i * rows + j] -= sign * short_dot(&z[i * rows..(i + 1) * rows], &z[j * rows..(j + 1) * rows]);
                }
            }
            if let Some(w) = w {
                let (mut y, mut zt) = ([0.0; 36], [0.0; 36]);
                multiply(block, &q, rank, rows, &mut y);
                for i in 0..rows {
                    for j in 0..rows {
                        zt[i * rows + j] = short_dot(&z[i * rows..(i + 1) * rows], &t[j * rows..(j + 1) * rows]);
                    }
                }
                for i in 0..rows {
                    for j in 0..rows {
                        let cross = short_dot(&z[i * rows..(i + 1) * rows], &y[j * rows..(j + 1) * rows])
                            + short_dot(&y[i * rows..(i + 1) * rows], &z[j * rows..(j + 1) * rows]);
                        let square = short_dot(&zt[i * rows..(i + 1) * rows], &z[j * rows..(j + 1) * rows]);
                        w[i * rows + j] += square - sign * cross;
                    }
                }
            }
        };
        let mut v = std::mem::take(&mut self.v);
        let mut w = std::mem::take(&mut self.w);
        if w.is_empty() {
            v.par_chunks_exact_mut(size).with_min_len(CHUNK).enumerate().for_each(|(index, v)| update(index, v, None));
        } else {
            v.par_chunks_exact_mut(size)
                .zip(w.par_chunks_exact_mut(size))
                .with_min_len(CHUNK)
                .enumerate()
                .for_each(|(index, (v, w))| update(index, v, Some(w)));
        }
        (self.v, self.w) = (v, w);
    }
}

/// Inner product of two short rows.
fn short_dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `out[i][j] = block row i · other row j`.
fn multiply(block: &[f64], other: &[f64], rank: usize, rows: usize, out: &mut [f64; 36]) {
    for (i, row) in block.chunks_exact(rank).enumerate() {
        for (j, line) in other.chunks_exact(rank).enumerate() {
            out[i * rows + j] = dense::dot(row, line);
        }
    }
}

/// `X A Xᵀ` of a block and a symmetric matrix.
fn sandwich(block: &[f64], middle: &[f64], rank: usize, rows: usize) -> Vec<f64> {
    let mut out = vec![0.0; rows * rows];
    let mut line = vec![0.0; rank];
    for (i, row) in block.chunks_exact(rank).enumerate() {
        line.iter_mut().zip(middle.chunks_exact(rank)).for_each(|(entry, middle)| *entry = dense::dot(row, middle));
        for (j, other) in block.chunks_exact(rank).enumerate() {
            out[i * rows + j] = dense::dot(&line, other);
        }
    }
    out
}

/// `A B` of symmetric matrices, row-major: entry (i, j) is row i of A times row j of B.
fn symmetric_product(a: &[f64], b: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    for (row, out) in a.chunks_exact(n).zip(out.chunks_exact_mut(n)) {
        out.iter_mut().zip(b.chunks_exact(n)).for_each(|(entry, other)| *entry = dense::dot(row, other));
    }
    out
}
