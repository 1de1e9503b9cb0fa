//! The command line: arguments, one file per command, and what becomes an exit code.
//!
//! Exit codes: 0 done; 1 done, but the answer is bad (a fit that did not converge, a replay that differs); 2 the input is wrong.

mod arguments;
mod design;
mod export;
mod identify;
mod measure;
mod output;
mod replay;
mod reproduce;
mod run;

use std::process::ExitCode;

use clap::Parser;

use arguments::{Arguments, Command};

/// How a command that worked ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As it should.
    Good,
    /// Done, but the answer is bad.
    Bad,
}

/// Parses the arguments, runs the command, and says how it ended.
#[must_use]
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let _ = error.print();
            return if error.use_stderr() { ExitCode::from(2) } else { ExitCode::SUCCESS };
        }
    };
    match dispatch(&arguments) {
        Ok(Outcome::Good) => ExitCode::SUCCESS,
        Ok(Outcome::Bad) => ExitCode::from(1),
        Err(error) => {
            eprintln!("kincal: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn dispatch(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let global = &arguments.global;
    if let Some(threads) = global.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global()?;
    }
    match &arguments.command {
        Command::Run(options) => run::command(global, options),
        Command::Design(options) => design::command(global, options),
        Command::Measure(options) => measure::command(global, options),
        Command::Identify(options) => identify::command(global, options),
        Command::Replay(options) => replay::command(global, options),
        Command::Export(options) => export::command(global, options),
        Command::Reproduce(options) => reproduce::command(global, options),
    }
}
