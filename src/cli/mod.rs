//! Floor 7: one file a subcommand. Exit codes: 0 done, 1 bad input, 2 usage, 3 done but not fit for use.

mod axes;
mod completions;
mod demo;
mod drive_plot;
mod export;
mod fit;
mod gap;
mod init;
mod inspect;
mod log_args;
mod log_values;
mod man;
mod mounting_args;
mod navigate;
mod noise;
mod noise_write;
mod outcome;
mod output;
mod places;
mod restart;
mod simulate;
mod study;
mod validate;

use clap::{CommandFactory, Parser, Subcommand};
use gyroid::{Error, ErrorKind, Result};
use outcome::Outcome;
use std::process::ExitCode;

/// Gyro warm-up bias from recorded logs, the navigation filter that uses it, and the sim-to-real gap.
#[derive(Debug, Parser)]
#[command(name = "gyroid", version, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Inspect(inspect::Inspect),
    Fit(fit::FitArgs),
    Validate(validate::ValidateArgs),
    Noise(noise::NoiseArgs),
    Simulate(simulate::SimulateArgs),
    Navigate(navigate::NavigateArgs),
    Study(study::StudyArgs),
    Export(export::ExportArgs),
    Gap(gap::GapArgs),
    Init(init::InitArgs),
    Demo(demo::DemoArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
}

impl Command {
    fn run(&self) -> Result<Outcome> {
        match self {
            Self::Inspect(args) => args.run(),
            Self::Fit(args) => fit::run(args),
            Self::Validate(args) => validate::run(args),
            Self::Noise(args) => noise::run(args),
            Self::Simulate(args) => simulate::run(args),
            Self::Navigate(args) => navigate::run(args),
            Self::Study(args) => study::run(args),
            Self::Export(args) => export::run(args),
            Self::Gap(args) => gap::run(args),
            Self::Init(args) => init::run(args),
            Self::Demo(args) => demo::run(args, &typed),
            Self::Completions(args) => completions::run(args, Cli::command()),
            Self::Man(args) => man::run(args, Cli::command()),
        }
    }
}

/// Runs a command as it would be typed, its words apart, the program's name first.
fn typed(words: &[&str]) -> Result<Outcome> {
    let usage = |e: clap::Error| Error::new(ErrorKind::Usage, words.join(" "), e.to_string().trim());
    Cli::try_parse_from(words).map_err(usage)?.command.run()
}

/// Parses the arguments, runs the command, reports its error, and says how it ended.
pub(crate) fn main() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(outcome) => ExitCode::from(outcome.code()),
        Err(error) => {
            output::report(&error);
            let usage = error.kind == ErrorKind::Usage;
            ExitCode::from(if usage { 2 } else { 1 })
        }
    }
}
