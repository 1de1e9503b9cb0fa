//! The command line: arguments, one file per command, and what becomes an exit code.
//!
//! Exit codes: 0 done; 1 done, but the answer is bad (a fit that did not converge, a replay that differs); 2 the input is wrong.

mod arguments;
mod bar;
mod challenge;
mod correct;
mod design;
mod diagnose;
mod effects;
mod export;
mod identify;
mod import;
mod input;
mod measure;
mod output;
mod power;
mod replay;
mod reproduce;
mod run;
mod sweep;

use std::io::Write;
use std::process::ExitCode;

use anyhow::ensure;
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
            // Where even stderr is full, the exit code must do.
            let _ = writeln!(std::io::stderr().lock(), "kincal: {}", output::plain(&in_full(&error)));
            ExitCode::from(2)
        }
    }
}

/// The error with its causes, each said once: many errors tell their cause in their own words.
fn in_full(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |text, cause| {
        let cause = cause.to_string();
        match text.as_str() {
            "" => cause,
            text if text.contains(&cause) => text.to_owned(),
            text => format!("{text}: {cause}"),
        }
    })
}

fn dispatch(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let global = &arguments.global;
    if let Some(threads) = global.threads {
        rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global()?;
    }
    if let (
        Some(seed),
        Command::Correct(_)
        | Command::Diagnose(_)
        | Command::Identify(_)
        | Command::Import(_)
        | Command::Replay(_)
        | Command::Export(_),
    ) = (global.seed, &arguments.command)
    {
        ensure!(
            false,
            "--seed {seed}: this command draws nothing; leave it out, or give it to run, design, measure, reproduce, sweep or challenge new"
        );
    }
    output::check_rerun(global)?;
    match &arguments.command {
        Command::Run(options) => run::command(global, options),
        Command::Design(options) => design::command(global, options),
        Command::Measure(options) => measure::command(global, options),
        Command::Import(options) => import::command(global, options),
        Command::Correct(options) => correct::command(global, options),
        Command::Diagnose(options) => diagnose::command(global, options),
        Command::Identify(options) => identify::command(global, options),
        Command::Replay(options) => replay::command(global, options),
        Command::Export(options) => export::command(global, options),
        Command::Effects(options) => effects::command(global, options),
        Command::Reproduce(options) => reproduce::command(global, options),
        Command::Sweep(options) => sweep::command(global, options),
        Command::Challenge { command } => challenge::command(global, command),
    }
}
