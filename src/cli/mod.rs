//! Floor 7: the command line, one file a subcommand. [`run`] is the program; [`answer`] runs one command for a caller that wants
//! its answer, not its words.
//!
//! Exit codes: 0 done, 1 bad input, 2 usage, 3 done but not fit for use.

mod axes;
mod completions;
mod demo;
mod drive_args;
mod drive_plot;
mod export;
mod fit;
mod gap;
mod html;
mod init;
mod inspect;
mod log_args;
mod log_values;
mod man;
mod many;
mod mcap;
mod merge;
mod mounting_args;
mod navigate;
mod noise;
mod noise_args;
mod noise_many;
mod noise_write;
mod outcome;
mod output;
mod places;
mod read;
mod restart;
mod ros;
mod simulate;
mod study;
mod topic_args;
mod track;
mod units;
mod validate;

pub use outcome::Answer;

use clap::{CommandFactory, Parser, Subcommand};
use gyroid::ingest::DriveRecording;
use gyroid::{Error, ErrorKind, Result};
use outcome::Outcome;
use std::ffi::OsString;

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
    Merge(merge::MergeArgs),
    Track(track::TrackArgs),
    Validate(validate::ValidateArgs),
    Noise(noise::NoiseArgs),
    Simulate(simulate::SimulateArgs),
    Navigate(navigate::NavigateArgs),
    Study(study::StudyArgs),
    Export(export::ExportArgs),
    Ros(ros::RosArgs),
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
            Self::Merge(args) => merge::run(args),
            Self::Track(args) => track::run(args),
            Self::Validate(args) => validate::run(args),
            Self::Noise(args) => noise::run(args),
            Self::Simulate(args) => simulate::run(args),
            Self::Navigate(args) => navigate::run(args),
            Self::Study(args) => study::run(args),
            Self::Export(args) => export::run(args),
            Self::Ros(args) => ros::run(args),
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
    Cli::try_parse_from(words).map_err(|e| misused(&e, &words.join(" ")))?.command.run()
}

/// Runs the program with `args`, of which the first is its name: it reads, writes and prints as they say. The exit code.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let outcome = match Cli::try_parse_from(&args) {
        Ok(cli) => output::as_typed(output::typed(&args), || cli.command.run()),
        // help and version are no faults; what cannot be printed is lost either way
        Err(asked) => {
            let _ = asked.print();
            return u8::try_from(asked.exit_code()).unwrap_or(2);
        }
    };
    match outcome {
        Ok(outcome) => outcome.code(),
        Err(error) => {
            output::report(&error);
            if error.kind == ErrorKind::Usage { 2 } else { 1 }
        }
    }
}

/// Runs the command of `args`, of which the first is the program's name, and returns its answer instead of printing it.
/// Files are read and written as `args` say, also those in memory ([`crate::files::memory`]). `typed` is the command as the
/// provenance of what is written has it.
///
/// # Errors
/// Those of the command; [`ErrorKind::Usage`] for arguments that it does not know.
pub fn answer(args: impl IntoIterator<Item = OsString>, typed: &str) -> Result<Answer> {
    let cli = Cli::try_parse_from(args).map_err(|e| misused(&e, typed))?;
    let (outcome, answer) = output::captured(|| output::as_typed(typed.to_string(), || cli.command.run()));
    Ok(Answer { fit_for_use: outcome? == Outcome::Done, ..answer })
}

/// Reads a log as the commands that take a drive do: `args` are the program's name, its files and the options of the reader.
///
/// # Errors
/// As [`read_drive`](crate::ingest::read_drive); [`ErrorKind::Usage`] for arguments that it does not know.
pub fn read_log(args: impl IntoIterator<Item = OsString>, typed: &str) -> Result<DriveRecording> {
    read::Read::try_parse_from(args).map_err(|e| misused(&e, typed))?.run()
}

/// The error of arguments that the command does not know: what was found stands on the first line, what to do on the others.
fn misused(error: &clap::Error, typed: &str) -> Error {
    let text = error.render().to_string();
    let (found, rest) = text.trim_start_matches("error: ").trim_end().split_once('\n').unwrap_or((&text, ""));
    let hint: Vec<&str> = rest.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let error = Error::new(ErrorKind::Usage, typed, found);
    let hint: Vec<&str> =
        hint.into_iter().take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more")).collect();
    if hint.is_empty() { error } else { error.hint(hint.join("; ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn args(all: &[&str]) -> Vec<OsString> {
        all.iter().map(OsString::from).collect()
    }

    #[test]
    fn the_answer_is_what_the_program_would_print() {
        let dir = tempfile::tempdir().unwrap();
        let log = dir.path().join("log.csv");
        let rows: String =
            (0..3000).map(|i| format!("{},{}\n", 0.1 * f64::from(i), 1e-3 * f64::from((i * 7919) % 13 - 6))).collect();
        std::fs::write(&log, format!("t_s,gyro_z_rad_s\n{rows}")).unwrap();
        let json = dir.path().join("answer.json");
        let [log, json] = [&log, &json].map(|path| path.to_str().unwrap());
        let got = answer(args(&["gyroid", "fit", log]), "gyroid.fit()").unwrap();
        let code = run(args(&["gyroid", "fit", log, "--quiet", "--json", json]));
        let written: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
        assert_eq!((got.json, got.fit_for_use), (written, code == 0));
        assert!(got.text.contains("C1") && got.text.contains("log.csv"), "{}", got.text);
    }

    #[test]
    fn wrong_arguments_are_an_error_of_usage_with_a_hint() {
        let error = answer(args(&["gyroid", "fit", "x.csv", "--weigthing", "walk"]), "gyroid.fit()").unwrap_err();
        assert_eq!((error.kind, error.input.as_str()), (ErrorKind::Usage, "gyroid.fit()"));
        assert!(error.found.contains("--weigthing") && error.hint.unwrap().contains("--weighting"));
        assert_eq!(answer(args(&["gyroid", "fit", "no/such.csv"]), "").unwrap_err().kind, ErrorKind::Io);
        assert_eq!(read_log(args(&["gyroid"]), "").unwrap_err().kind, ErrorKind::Usage);
    }
}
