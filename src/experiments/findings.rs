//! What an experiment found: numbers beside the published ones, the data behind them, and the pictures.

use serde::Serialize;

use super::statistics::Mean;
use crate::report::figure::Figure;

/// Everything that one experiment found on one arm.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// The experiment: `globality`, `headline`, ….
    pub item: &'static str,
    /// What it repeats: the paper's tables and figures.
    pub place: &'static str,
    /// Name of the arm.
    pub arm: String,
    /// The published numbers beside ours.
    pub claims: Vec<Claim>,
    /// Whether the paper's statement holds here, in a sentence with the number that says so.
    pub verdict: String,
    /// Sentences about what was assumed or left out.
    pub notes: Vec<String>,
    /// Data behind the figures, for CSV.
    #[serde(skip)]
    pub data: Vec<Data>,
    /// Figures with their file names (without extension).
    #[serde(skip)]
    pub figures: Vec<(String, Figure)>,
}

/// A number of the paper and ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// What it is, with its unit: `position error, m = 8 (mm)`.
    pub what: String,
    /// As published; absent where the paper has no such number.
    pub paper: Option<f64>,
    /// Ours; absent where it could not be had (the notes say why).
    pub ours: Option<Mean>,
    /// What no choice of configurations can go beyond, where there is such a bound.
    pub bound: Option<f64>,
}

/// A table of numbers for CSV.
#[derive(Clone, Debug, PartialEq)]
pub struct Data {
    /// File name without extension.
    pub name: String,
    /// Column names, with units.
    pub columns: Vec<String>,
    /// Rows; a missing value is NaN and becomes an empty field.
    pub rows: Vec<Vec<f64>>,
    /// Text of the first columns of each row, where rows have names; as many columns for every row.
    pub labels: Vec<Vec<String>>,
}
