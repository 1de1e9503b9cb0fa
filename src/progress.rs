//! What a long computation tells while it runs: one protocol for searches, measurements, sweeps and whole runs.
//!
//! A computation reports values of one type `T` (events of a run, steps of a search) to a [`Progress<T>`]. Where many threads work on
//! equal parts at once, what they report is a [`Step`], through [`Steps`], which all of them share.

use std::sync::{Mutex, PoisonError};

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

/// How far a computation of many equal parts is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// So many parts begin; those of before are over.
    Begin {
        /// What is done: one or two words.
        what: &'static str,
        /// Parts.
        parts: usize,
    },
    /// One of them is done.
    Done,
    /// Something for people that no result depends on, such as a time.
    Remark(String),
}

/// A [`Progress`] of [`Step`]s that the threads of a computation share. The order in which parts are done is that of the threads; no
/// result may depend on it.
pub struct Steps(Mutex<Box<dyn Progress<Step> + Send>>);

impl Steps {
    /// Steps that `progress` takes.
    pub fn new(progress: impl Progress<Step> + Send + 'static) -> Steps {
        Steps(Mutex::new(Box::new(progress)))
    }

    /// So many parts of `what` begin.
    ///
    /// # Errors
    /// If the computation is to stop.
    pub fn begin(&self, what: &'static str, parts: usize) -> Result<(), Stopped> {
        self.report(Step::Begin { what, parts })
    }

    /// A part is done.
    ///
    /// # Errors
    /// If the computation is to stop.
    pub fn done(&self) -> Result<(), Stopped> {
        self.report(Step::Done)
    }

    /// Tells people something.
    ///
    /// # Errors
    /// If the computation is to stop.
    pub fn remark(&self, text: impl Into<String>) -> Result<(), Stopped> {
        self.report(Step::Remark(text.into()))
    }

    fn report(&self, step: Step) -> Result<(), Stopped> {
        // A thread that panicked while it told has broken nothing but a bar.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).report(step)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use rayon::prelude::*;

    use super::*;

    #[test]
    fn threads_share_steps_and_are_stopped_by_whoever_takes_them() {
        let (sender, receiver) = mpsc::channel();
        let steps = Steps::new(move |step| sender.send(step).map_err(|error| Stopped(error.to_string())));
        steps.begin("parts", 100).unwrap();
        (0..100).into_par_iter().try_for_each(|_| steps.done()).unwrap();
        steps.remark("so far").unwrap();
        let told: Vec<Step> = receiver.try_iter().collect();
        assert_eq!(told.iter().filter(|step| **step == Step::Done).count(), 100);
        assert_eq!(told[0], Step::Begin { what: "parts", parts: 100 });
        assert_eq!(told[101], Step::Remark("so far".to_owned()));
        drop(receiver);
        assert!(steps.done().is_err());
    }
}
