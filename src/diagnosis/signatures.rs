//! Whitened signatures, column by column, and their inner products. They are by far the largest thing that a diagnosis holds: as single
//! precision they are half of it (a rounding of 6e-8 of a signature is far below the noise of any sensor), and of those that are nothing
//! in most readings, as the values of a map are, only the rest is kept.

use std::ops::Range;

/// Of so many entries of a column at most one is not zero where only those are kept: each takes a number more.
const SPARSE: usize = 4;

/// Columns of one height.
#[derive(Debug)]
pub(super) struct Signatures {
    height: usize,
    columns: Vec<Column>,
    /// Whole columns, one after the other.
    whole: Vec<f32>,
    /// Of each whole column, which one it is.
    numbers: Vec<usize>,
    /// Rows and values of the others.
    entries: Vec<(u32, f32)>,
}

#[derive(Clone, Debug)]
enum Column {
    /// Number among the whole ones.
    Whole(usize),
    /// Which entries.
    Sparse(Range<usize>),
}

/// Sum of products, in an order that does not depend on the processor.
pub(super) fn dot<A: Copy + Into<f64>, B: Copy + Into<f64>>(a: &[A], b: &[B]) -> f64 {
    let product = |a: A, b: B| -> f64 { a.into() * b.into() };
    let mut sums = [0.0; 8];
    let (blocks_a, blocks_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = blocks_a.remainder().iter().zip(blocks_b.remainder()).map(|(a, b)| product(*a, *b)).sum();
    for (a, b) in blocks_a.zip(blocks_b) {
        for lane in 0..8 {
            sums[lane] += product(a[lane], b[lane]);
        }
    }
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7])) + rest
}

/// Sums of products of `own` with every column of `whole`: four columns at a time, as `own` is read once for all of them.
fn dots(own: &[f64], whole: &[f32], sums: &mut [f64]) {
    let height = own.len();
    let part = |number: usize| &whole[number * height..(number + 1) * height];
    let mut blocks = sums.chunks_exact_mut(4);
    let mut number = 0;
    for block in &mut blocks {
        let columns = [part(number), part(number + 1), part(number + 2), part(number + 3)];
        let mut lanes = [[0.0; 4]; 4];
        let even = height / 4 * 4;
        for at in (0..even).step_by(4) {
            for (lanes, column) in lanes.iter_mut().zip(columns) {
                for lane in 0..4 {
                    lanes[lane] += own[at + lane] * f64::from(column[at + lane]);
                }
            }
        }
        for ((sum, lanes), column) in block.iter_mut().zip(lanes).zip(columns) {
            *sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]) + dot(&own[even..], &column[even..]);
        }
        number += 4;
    }
    for sum in blocks.into_remainder() {
        *sum = dot(own, part(number));
        number += 1;
    }
}

impl Signatures {
    /// None yet, of so many rows.
    #[must_use]
    pub(super) fn new(height: usize) -> Signatures {
        Signatures { height, columns: Vec::new(), whole: Vec::new(), numbers: Vec::new(), entries: Vec::new() }
    }

    /// One more.
    pub(super) fn push(&mut self, column: &[f32]) {
        let some = column.iter().filter(|value| **value != 0.0).count();
        if SPARSE * some > self.height {
            self.numbers.push(self.columns.len());
            self.columns.push(Column::Whole(self.numbers.len() - 1));
            self.whole.extend(column);
            return;
        }
        let first = self.entries.len();
        let kept = column.iter().enumerate().filter(|(_, value)| **value != 0.0);
        self.entries.extend(kept.map(|(row, value)| (row as u32, *value)));
        self.columns.push(Column::Sparse(first..self.entries.len()));
    }

    fn whole(&self, number: usize) -> &[f32] {
        &self.whole[number * self.height..(number + 1) * self.height]
    }

    /// Product of column `number` with `values`.
    #[must_use]
    pub(super) fn with(&self, number: usize, values: &[f64]) -> f64 {
        match &self.columns[number] {
            Column::Whole(whole) => dot(values, self.whole(*whole)),
            Column::Sparse(entries) => with_entries(&self.entries[entries.clone()], |row| values[row]),
        }
    }

    /// Product of two columns.
    #[must_use]
    pub(super) fn between(&self, a: usize, b: usize) -> f64 {
        match (&self.columns[a], &self.columns[b]) {
            (Column::Whole(a), Column::Whole(b)) => dot(self.whole(*a), self.whole(*b)),
            (Column::Whole(whole), Column::Sparse(entries)) | (Column::Sparse(entries), Column::Whole(whole)) => {
                let whole = self.whole(*whole);
                with_entries(&self.entries[entries.clone()], |row| f64::from(whole[row]))
            }
            (Column::Sparse(a), Column::Sparse(b)) => {
                // Both are in the order of rows.
                let (mut a, mut b) = (self.entries[a.clone()].iter().peekable(), self.entries[b.clone()].iter().peekable());
                let mut sum = 0.0;
                while let (Some((row, value)), Some((other, of_other))) = (a.peek(), b.peek()) {
                    match row.cmp(other) {
                        std::cmp::Ordering::Less => drop(a.next()),
                        std::cmp::Ordering::Greater => drop(b.next()),
                        std::cmp::Ordering::Equal => {
                            sum += f64::from(*value) * f64::from(*of_other);
                            a.next();
                            b.next();
                        }
                    }
                }
                sum
            }
        }
    }

    /// Products of each of the columns `block` with every column, added to its `sums`.
    pub(super) fn add_products(&self, block: Range<usize>, sums: &mut [&mut [f64]]) {
        let sparse: Vec<(usize, Range<usize>)> = block
            .clone()
            .enumerate()
            .filter_map(|(at, number)| match &self.columns[number] {
                Column::Sparse(entries) => Some((at, entries.clone())),
                Column::Whole(_) => None,
            })
            .collect();
        // One look at every whole column serves all that have but few entries.
        let mut entries: Vec<(u32, usize, f64)> = sparse
            .iter()
            .flat_map(|(at, entries)| {
                self.entries[entries.clone()].iter().map(move |(row, value)| (*row, *at, f64::from(*value)))
            })
            .collect();
        entries.sort_by_key(|(row, at, _)| (*row, *at));
        let mut of_block = vec![0.0; block.len()];
        for (whole, number) in self.numbers.iter().enumerate().filter(|_| !entries.is_empty()) {
            of_block.fill(0.0);
            let column = self.whole(whole);
            for (row, at, value) in &entries {
                of_block[*at] += value * f64::from(column[*row as usize]);
            }
            sums.iter_mut().zip(&of_block).for_each(|(sums, value)| sums[*number] += value);
        }
        let mut own = vec![0.0; self.height];
        let mut of_whole = vec![0.0; self.numbers.len()];
        for (at, number) in block.enumerate() {
            match &self.columns[number] {
                Column::Whole(whole) => {
                    own.iter_mut().zip(self.whole(*whole)).for_each(|(own, value)| *own = f64::from(*value));
                    dots(&own, &self.whole, &mut of_whole);
                    self.numbers.iter().zip(&of_whole).for_each(|(number, value)| sums[at][*number] += value);
                }
                Column::Sparse(entries) => {
                    own.fill(0.0);
                    self.entries[entries.clone()].iter().for_each(|(row, value)| own[*row as usize] = f64::from(*value));
                }
            }
            for (sum, other) in sums[at].iter_mut().zip(&self.columns) {
                if let Column::Sparse(entries) = other {
                    *sum += with_entries(&self.entries[entries.clone()], |row| own[row]);
                }
            }
        }
    }
}

fn with_entries(entries: &[(u32, f32)], of: impl Fn(usize) -> f64) -> f64 {
    entries.iter().map(|(row, value)| f64::from(*value) * of(*row as usize)).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::seed::stream;

    /// Whatever is kept of columns, their products are those of the matrix.
    #[test]
    fn products_are_those_of_the_whole_columns() {
        let mut draws = stream(3, "test/signatures");
        let (height, width) = (61, 17);
        let matrix = DMatrix::from_fn(height, width, |_, column| {
            let value = draws.normal();
            if column % 3 == 1 || draws.unit() < [1.0, 0.0, 0.15][column % 3] { value as f32 } else { 0.0 }
        });
        let mut signatures = Signatures::new(height);
        matrix.column_iter().for_each(|column| signatures.push(column.into_owned().as_slice()));
        assert!(!signatures.numbers.is_empty() && signatures.numbers.len() < width);
        let whole = matrix.map(f64::from);
        let expected = whole.tr_mul(&whole);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-10, "{a} {b}");
        let values: Vec<f64> = (0..height).map(|_| draws.normal()).collect();
        for a in 0..width {
            near(signatures.with(a, &values), whole.column(a).iter().zip(&values).map(|(a, b)| a * b).sum());
            (0..width).for_each(|b| near(signatures.between(a, b), expected[(a, b)]));
        }
        for block in [0..1, 2..3, 4..9, 0..width] {
            let mut rows = vec![vec![1.0; width]; block.len()];
            signatures.add_products(block.clone(), &mut rows.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
            for (row, a) in rows.iter().zip(block) {
                (0..width).for_each(|b| near(row[b], 1.0 + expected[(a, b)]));
            }
        }
    }
}
