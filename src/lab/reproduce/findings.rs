//! What an experiment found: numbers beside the published ones, the data behind them, and the pictures.

use serde::Serialize;

use crate::figure::Figure;
use crate::statistics::Mean;

/// Everything that one experiment found on one arm.
#[derive(Clone, Debug, Serialize)]
pub struct Findings {
    /// The experiment: `globality`, `headline`, ….
    pub item: &'static str,
    /// What it repeats: the paper's tables and figures.
    pub place: &'static str,
    /// Name of the arm.
    pub arm: String,
    /// What was found.
    #[serde(flatten)]
    pub found: Found,
}

/// What came out of an experiment.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Found {
    /// The published numbers beside ours.
    pub claims: Vec<Claim>,
    /// Whether the paper's statement holds here, in a sentence with the number that says so.
    pub verdict: String,
    /// Sentences about what was assumed or left out.
    pub notes: Vec<String>,
    /// The fits behind the numbers.
    pub fits: Tally,
    /// Data behind the figures, for CSV.
    #[serde(skip)]
    pub data: Vec<Data>,
    /// Figures with their file names (without extension).
    #[serde(skip)]
    pub figures: Vec<(String, Figure)>,
}

/// How fits ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Fits made.
    pub fits: usize,
    /// Of them, those that did not converge; they are left out of all means.
    pub not_converged: usize,
    /// Of them, those that held combinations at nominal because the set does not show them; they are in the means.
    pub held: usize,
}

impl std::iter::Sum for Tally {
    fn sum<I: Iterator<Item = Tally>>(tallies: I) -> Tally {
        tallies.fold(Tally::default(), |sum, one| Tally {
            fits: sum.fits + one.fits,
            not_converged: sum.not_converged + one.not_converged,
            held: sum.held + one.held,
        })
    }
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

impl Claim {
    /// Without a bound.
    #[must_use]
    pub fn new(what: impl Into<String>, paper: Option<f64>, ours: Option<Mean>) -> Self {
        Claim { what: what.into(), paper, ours, bound: None }
    }

    /// A number that is no mean over trials.
    #[must_use]
    pub fn single(what: impl Into<String>, paper: Option<f64>, ours: Option<f64>) -> Self {
        Claim::new(what, paper, ours.map(|mean| Mean { mean, interval95: None, trials: 1 }))
    }

    /// With a bound.
    #[must_use]
    pub fn bounded(self, bound: Option<f64>) -> Self {
        Claim { bound, ..self }
    }
}

/// A mean and the ends of its interval, as three columns of a table; NaN for what there is not.
pub(super) fn with_ends(mean: Option<Mean>) -> [f64; 3] {
    let [low, high] = mean.and_then(|mean| mean.interval95).unwrap_or([f64::NAN; 2]);
    [mean.map_or(f64::NAN, |mean| mean.mean), low, high]
}

/// One of a flag that is set, as a column of a table.
pub(super) fn flag(is_set: bool) -> f64 {
    f64::from(u8::from(is_set))
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

impl Data {
    /// A table whose rows have no names.
    #[must_use]
    pub fn new(name: impl Into<String>, columns: &[&str], rows: Vec<Vec<f64>>) -> Self {
        let columns = columns.iter().map(|column| (*column).to_owned()).collect();
        Data { name: name.into(), columns, rows, labels: Vec::new() }
    }

    /// A table whose first columns are text.
    #[must_use]
    pub fn labelled(name: impl Into<String>, columns: &[&str], rows: Vec<(Vec<String>, Vec<f64>)>) -> Self {
        let (labels, rows) = rows.into_iter().unzip();
        Data { labels, ..Data::new(name, columns, rows) }
    }
}
