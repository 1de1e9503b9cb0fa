//! What `kincal reproduce` repeats: every table and figure of Chen et al. 2019, and what goes beyond them.
//!
//! One file per experiment. Each computes its trials side by side (`Bench::trials`) and returns what it [`Found`]: the paper's numbers
//! beside ours, a verdict, the data and the figures. [`Experiment::run`] says of which experiment and arm that is.

pub mod advice;
pub mod arms;
pub mod bake_off;
pub mod bench;
pub mod count_error;
pub mod count_index;
pub mod findings;
pub mod globality;
pub mod headline;
pub mod limits;
pub mod optimise;
mod pictures;
pub mod published;
pub mod quality;
pub mod sets;
pub mod situation;

use crate::session::SessionError;
use bench::Bench;
use findings::{Findings, Found};

/// An experiment by its name.
pub struct Experiment {
    /// Name on the command line.
    pub name: &'static str,
    /// What it repeats.
    pub place: &'static str,
    /// In a few words.
    pub about: &'static str,
    /// Trials if nobody asks for another number: the paper's, or enough for a decent interval.
    pub trials: usize,
    /// Makes as many trials.
    work: fn(&Bench<'_>, usize) -> Result<Found, SessionError>,
}

impl Experiment {
    /// Makes as many trials on the arm of `bench`.
    ///
    /// # Errors
    /// Whatever a trial reports.
    pub fn run(&self, bench: &Bench<'_>, trials: usize) -> Result<Findings, SessionError> {
        let found = (self.work)(bench, trials)?;
        Ok(Findings { item: self.name, place: self.place, arm: bench.scene.arm.name.clone(), found })
    }
}

/// Experiments that go beyond the paper: each is asked for by its name.
pub const BEYOND: &[Experiment] = &[bake_off::EXPERIMENT, advice::EXPERIMENT];

/// The paper's experiments in its order.
pub const ALL: &[Experiment] = &[
    globality::EXPERIMENT,
    quality::EXPERIMENT,
    count_index::EXPERIMENT,
    count_error::EXPERIMENT,
    optimise::EXPERIMENT,
    sets::EXPERIMENT,
    headline::EXPERIMENT,
];
