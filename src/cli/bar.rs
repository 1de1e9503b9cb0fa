//! The progress bar, for people at a terminal: it draws the events of a run and the steps of long computations.

use std::io::{IsTerminal, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::arguments::Global;
use crate::design::problem::Criterion;
use crate::event::Event;
use crate::progress::{Progress, Step, Steps, Stopped};
use crate::report::criterion::Words;

/// A bar, hidden for everyone who is not at a terminal. Copies are the same bar.
#[derive(Clone)]
pub(crate) struct Bar {
    bar: ProgressBar,
    criterion: Words,
    quiet: bool,
}

impl Bar {
    /// Nothing is drawn yet. Values of `criterion` are shown while configurations are chosen.
    pub(crate) fn new(global: &Global, criterion: Option<Criterion>) -> Bar {
        let visible = !global.quiet && std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        Bar { bar: ProgressBar::with_draw_target(None, target), criterion: Words::new(criterion), quiet: global.quiet }
    }

    /// Steps that threads share, drawn by this bar.
    pub(crate) fn steps(&self) -> Steps {
        Steps::new(self.clone())
    }

    /// Takes the bar away.
    pub(crate) fn end(&self) {
        self.bar.finish_and_clear();
    }

    fn start(&self, what: &'static str, length: u64) {
        if let Ok(style) = ProgressStyle::with_template("{prefix:>10} {bar:40} {pos}/{len} {msg} {eta}") {
            self.bar.set_style(style);
        }
        self.bar.reset();
        self.bar.set_prefix(what);
        self.bar.set_message("");
        self.bar.set_length(length);
    }
}

impl Progress<&Event> for Bar {
    fn report(&mut self, event: &Event) -> Result<(), Stopped> {
        match event {
            Event::Swarm(iteration) => {
                if iteration.iteration == 0 {
                    self.start("choosing", iteration.iterations as u64);
                }
                self.bar.set_position(iteration.iteration as u64);
                let best = iteration.best_value();
                self.bar.set_message(best.map(|best| self.criterion.value(best)).unwrap_or_default());
            }
            Event::Designed(outcome) => self.start("measuring", outcome.configurations.len() as u64),
            Event::Measured(measurement) => self.bar.set_position(measurement.index as u64 + 1),
            Event::Search(step) => {
                if step.step == 0 {
                    self.start("choosing", step.budget);
                }
                self.bar.set_position(step.evaluations);
                self.bar.set_message(self.criterion.value(step.best));
            }
            Event::Start(_) | Event::Identified(_) | Event::Diagnosed(_) | Event::Note(_) | Event::NotDiagnosed(_) => {}
        }
        Ok(())
    }
}

impl Progress<Step> for Bar {
    fn report(&mut self, step: Step) -> Result<(), Stopped> {
        match step {
            Step::Begin { what, parts } => self.start(what, parts as u64),
            Step::Done => self.bar.inc(1),
            Step::Remark(text) if !self.quiet => self.bar.suspend(|| {
                // Nobody reads it: no reason to stop.
                let _ = writeln!(std::io::stderr().lock(), "{}", super::output::plain(&text));
            }),
            Step::Remark(_) => {}
        }
        Ok(())
    }
}
