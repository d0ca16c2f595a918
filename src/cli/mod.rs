//! Floor 7: one file a subcommand. Exit codes: 0 done, 1 bad input, 2 usage, 3 done but not fit for use.

mod axes;
mod drive_plot;
mod export;
mod fit;
mod gap;
mod html;
mod inspect;
mod log_args;
mod log_values;
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

use clap::{Parser, Subcommand};
use gyroid::Result;
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
}

/// Parses the arguments, runs the command, reports its error, and says how it ended.
pub(crate) fn main() -> ExitCode {
    let cli = Cli::parse();
    let outcome: Result<Outcome> = match &cli.command {
        Command::Inspect(args) => args.run(),
        Command::Fit(args) => fit::run(args),
        Command::Validate(args) => validate::run(args),
        Command::Noise(args) => noise::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Navigate(args) => navigate::run(args),
        Command::Study(args) => study::run(args),
        Command::Export(args) => export::run(args),
        Command::Gap(args) => gap::run(args),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Unfit) => ExitCode::from(3),
        Err(error) => {
            output::report(&error);
            let usage = error.kind == gyroid::ErrorKind::Usage;
            ExitCode::from(if usage { 2 } else { 1 })
        }
    }
}
