//! What a long computation tells while it runs: one protocol for searches, measurements, sweeps and whole runs.

/// Takes what a computation reports, in order; an error stops the computation.
///
/// A closure `FnMut(T) -> Result<(), Stopped>` is one, [`Silent`] takes everything and does nothing.
pub trait Progress<T> {
    /// Takes the next report.
    ///
    /// # Errors
    /// If the computation is to stop, because the report could not be written or shown.
    fn report(&mut self, report: T) -> Result<(), Stopped>;
}

impl<T, F: FnMut(T) -> Result<(), Stopped>> Progress<T> for F {
    fn report(&mut self, report: T) -> Result<(), Stopped> {
        self(report)
    }
}

/// Takes every report and does nothing: for computations that leave no trace.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl<T> Progress<T> for Silent {
    fn report(&mut self, _: T) -> Result<(), Stopped> {
        Ok(())
    }
}

/// Whoever took the reports stopped the computation, and why.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Stopped(pub String);
