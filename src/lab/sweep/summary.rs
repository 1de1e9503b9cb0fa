//! What the trials of a cell say together. Trials are taken one after the other, in the order of their numbers, and none is kept.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::grid::Cell;
use super::results::{Header, Record};
use crate::statistics::{Mean, Running, rms};

/// A cell's trials taken together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CellSummary {
    /// Number of the cell.
    pub cell: usize,
    /// What it is.
    #[serde(flatten)]
    pub what: Cell,
    /// Trials made.
    pub trials: usize,
    /// Of them, those whose fit did not converge; they are in no number below.
    pub not_converged: usize,
    /// Smallest and largest number of combinations told apart.
    pub rank: [usize; 2],
    /// Position error on what was held out: mean over the trials of each one's RMS, m.
    pub held_out_m: Option<Mean>,
    /// The same for the orientation, rad.
    pub held_out_rad: Option<Mean>,
    /// Residuals over the declared noise.
    pub residual_scale: Option<Mean>,
    /// How far the effect moves the fitted positions, RMS, m.
    pub displacement_m: Option<Mean>,
    /// Share of the effect's energy that geometry absorbs.
    pub swallowed: Option<Mean>,
    /// What is left of it in squared sigmas.
    pub lambda: Option<Mean>,
    /// Share of the stated 95 % intervals that hold the true combination; the interval is that of the mean over trials.
    pub coverage: Option<Mean>,
    /// Root of the mean over combinations of the squared (mean error over mean standard error).
    pub bias_in_standard_errors: Option<f64>,
    /// Every combination.
    pub combinations: Vec<CombinationSummary>,
}

/// A combination in all trials of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CombinationSummary {
    /// Name of the independent parameter.
    pub name: String,
    /// `m` or `rad`.
    pub unit: String,
    /// Identified minus true, SI.
    pub bias: Mean,
    /// Mean of the stated standard error, SI.
    pub standard_error: f64,
    /// The bias in these.
    pub bias_in_standard_errors: f64,
    /// Scatter of the errors about their mean, SI.
    pub scatter: f64,
    /// Share of the stated 95 % intervals that hold the true value.
    pub coverage: f64,
}

/// Sums over the trials of every cell.
pub struct Reduction<'a> {
    header: &'a Header,
    cells: Vec<Sums>,
}

#[derive(Clone, Default)]
struct Sums {
    trials: usize,
    not_converged: usize,
    rank: Option<[usize; 2]>,
    held_out_m: Running,
    held_out_rad: Running,
    residual_scale: Running,
    displacement_m: Running,
    swallowed: Running,
    lambda: Running,
    coverage: Running,
    combinations: BTreeMap<usize, CombinationSums>,
}

#[derive(Clone, Default)]
struct CombinationSums {
    error: Running,
    standard_error: Running,
    covered: usize,
}

impl<'a> Reduction<'a> {
    /// Nothing taken yet.
    #[must_use]
    pub fn new(header: &'a Header) -> Self {
        Reduction { header, cells: vec![Sums::default(); header.cells.len()] }
    }

    /// Takes the next trial, in the order of the file.
    pub fn take(&mut self, record: &Record) {
        let Some(sums) = self.cells.get_mut(record.cell) else { return };
        sums.trials += 1;
        if !record.converged {
            sums.not_converged += 1;
            return;
        }
        let [low, high] = sums.rank.unwrap_or([record.rank; 2]);
        sums.rank = Some([low.min(record.rank), high.max(record.rank)]);
        sums.held_out_m.push(record.held_out_m);
        for (running, value) in [
            (&mut sums.held_out_rad, record.held_out_rad),
            (&mut sums.residual_scale, record.residual_scale),
            (&mut sums.displacement_m, record.displacement_m),
            (&mut sums.swallowed, record.swallowed),
            (&mut sums.lambda, record.lambda),
        ] {
            if let Some(value) = value {
                running.push(value);
            }
        }
        if record.estimates.is_empty() {
            return;
        }
        let mut covered = 0;
        for estimate in &record.estimates {
            let combination = sums.combinations.entry(estimate.column).or_default();
            combination.error.push(estimate.error);
            combination.standard_error.push(estimate.standard_error);
            if estimate.error.abs() <= estimate.half_width {
                combination.covered += 1;
                covered += 1;
            }
        }
        sums.coverage.push(f64::from(covered) / record.estimates.len() as f64);
    }

    /// The summaries, cell by cell.
    #[must_use]
    pub fn finish(&self) -> Vec<CellSummary> {
        self.cells.iter().enumerate().map(|(cell, sums)| self.summary(cell, sums)).collect()
    }

    fn summary(&self, cell: usize, sums: &Sums) -> CellSummary {
        let combinations: Vec<CombinationSummary> = sums
            .combinations
            .iter()
            .filter_map(|(column, sums)| {
                let (name, unit) = self.header.parameters.get(*column)?;
                let (bias, standard_error) = (sums.error.mean()?, sums.standard_error.mean()?.mean);
                Some(CombinationSummary {
                    name: name.clone(),
                    unit: unit.clone(),
                    bias,
                    standard_error,
                    bias_in_standard_errors: bias.mean / standard_error,
                    scatter: sums.error.deviation(),
                    coverage: sums.covered as f64 / sums.error.count() as f64,
                })
            })
            .collect();
        let bias = combinations.iter().map(|combination| combination.bias_in_standard_errors);
        let bias_in_standard_errors = (!combinations.is_empty()).then(|| rms(bias));
        CellSummary {
            cell,
            what: self.header.cells[cell].clone(),
            trials: sums.trials,
            not_converged: sums.not_converged,
            rank: sums.rank.unwrap_or_default(),
            held_out_m: sums.held_out_m.mean(),
            held_out_rad: sums.held_out_rad.mean(),
            residual_scale: sums.residual_scale.mean(),
            displacement_m: sums.displacement_m.mean(),
            swallowed: sums.swallowed.mean(),
            lambda: sums.lambda.mean(),
            coverage: sums.coverage.mean(),
            bias_in_standard_errors,
            combinations,
        }
    }
}
