//! `gyroid gap plan`: the next experiment.

use super::asked::AskedArgs;
use super::diagnose::{library, names};
use super::loads::LoadArgs;
use super::power::read_one;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::config::Config;
use gyroid::files::Plan as Files;
use gyroid::gap::plan::{Options, plan};
use gyroid::gap::{self, Answer};
use gyroid::ingest::LogWriter;
use gyroid::report::PlanReport;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// The next experiment, by what it would tell apart and this log cannot: courses and recordings, ranked by expected evidence
///
/// The effects in question are fitted to the log, and every experiment is simulated with each of them. Of a drive, an experiment
/// is diagnosed together with the log; one that brings channels which the log lacks, and every one at rest, by itself. Torques
/// that the log lacks are asked for only where nothing else tells.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap plan robot.toml --fit drive.parquet -o next.parquet\n  \
    gyroid gap plan robot.toml --fit drive.parquet --answer answer.json --duration 120\n  \
    gyroid gap plan robot.toml --fit drive.parquet --among vehicle.payload motor.torque_gain\n  \
    gyroid simulate robot.toml --inputs next.parquet -o planned.parquet")]
pub(crate) struct PlanArgs {
    /// The nominal simulator: a configuration with [gyro]; of a drive also [vehicle] and [encoder]
    config: PathBuf,
    /// Recording, in any format that `gyroid inspect` reads; of a drive, several files on one clock
    #[arg(long, value_name = "LOG", required = true, num_args = 1..)]
    fit: Vec<PathBuf>,
    /// Its answer, as `gyroid gap diagnose --json` writes it [default: the log is diagnosed]
    #[arg(long, value_name = "FILE")]
    answer: Option<PathBuf>,
    /// Tell these effects apart, by id [default: those that the answer cannot tell apart]
    #[arg(long, value_name = "ID", num_args = 1..)]
    among: Vec<String>,
    /// Compare only these experiments, by name [default: all that this log could be followed by]
    #[arg(long, value_name = "NAME", num_args = 1..)]
    experiment: Vec<String>,
    /// Least length of a course, s [default: that of the log, within 30 and 300, and where none tells what the best one needs, up to 600]
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Write the first experiment as inputs that `gyroid simulate --inputs` follows (.csv or .parquet): commands, wheel speeds and torques;
    /// without one that tells the effects apart nothing is written, and the exit code is 3
    #[arg(short, long, value_name = "LOG")]
    out: Option<PathBuf>,
    #[command(flatten)]
    loads: LoadArgs,
    #[command(flatten)]
    asked: AskedArgs,
    #[command(flatten)]
    common: Common,
}

/// Longest course, s.
const LONGEST_S: f64 = 3600.0;

pub(crate) fn run(args: &PlanArgs) -> Result<Outcome> {
    places::check("gap plan", &args.config, "--fit ", &args.fit)?;
    let files = Files::new().reads([&args.config]).reads(&args.fit).reads(&args.answer).writes("--out", &args.out);
    let output = Output::open(&args.common, "gap.plan", files)?;
    let out = args.out.as_ref().map(LogWriter::claim).transpose()?;
    let (config, by_time) = Config::read_base(&args.config)?.by_elapsed_time();
    let config = args.loads.carried(config, &args.fit)?;
    let library = library(&args.asked.without, Some(&config))?;
    if let Some(duration_s) = args.duration.filter(|s| !(*s > 0.0 && *s <= LONGEST_S)) {
        return Err(Error::new(ErrorKind::Usage, "--duration", format!("{duration_s} s is not within an hour"))
            .hint("give a positive number of seconds, 120 say"));
    }
    let mut notes: Vec<String> = by_time.into_iter().collect();
    let given = args.answer.as_deref().map(read_answer).transpose()?;
    let working = output.working("reading");
    let (log, since_power_on_s) = read_one(&args.asked, ("--fit", &args.fit), (&config, &args.config), &mut notes)?;
    let named = |e: Error| match e.input.as_str() {
        "configuration" => e.named(args.config.display()),
        "among" => e.named("--among"),
        "experiments" => e.named("--experiment"),
        _ => e,
    };
    let answer = match given {
        Some(answer) => Some(answer),
        None if !args.among.is_empty() => None,
        None => {
            working.show("diagnosing the log");
            let options = gap::Options { seed: args.asked.seed, since_power_on_s, ..gap::Options::default() };
            Some(gap::diagnose(&config, &log, None, &library, &options).map_err(named)?.answer)
        }
    };
    let options = Options {
        among: args.among.clone(),
        experiments: args.experiment.clone(),
        duration_s: args.duration,
        seed: args.asked.seed,
        since_power_on_s,
    };
    let mut found = {
        let count = working.counter("experiments:".into());
        plan(&config, &log, answer.as_ref(), &library, &options, &count).map_err(named)?
    };
    drop(working);
    found.notes.extend(notes);
    let name = names(std::slice::from_ref(&args.fit));
    output.say(PlanReport { log: &name, plan: &found }.text());
    let mut outcome = Outcome::Done;
    if let (Some(out), Some(path)) = (out, &args.out) {
        match found.first() {
            Some(first) => {
                out.write(&first.inputs)?;
                output.say(format!("\nwrote {}: {}", path.display(), first.name));
            }
            None => outcome = Outcome::Unfit,
        }
    }
    let mut json = serde_json::json!(found);
    json["kind"] = serde_json::json!(config.kind);
    output.finish(&json)?;
    Ok(outcome)
}

/// The answer of a diagnosis.
fn read_answer(path: &Path) -> Result<Answer> {
    let text = gyroid::files::memory::read(path).map_err(|e| Error::io(path, &e))?;
    serde_json::from_slice(&text).map_err(|e| {
        Error::new(ErrorKind::Value, path.display(), format!("is no answer of a diagnosis: {e}"))
            .hint("write one with gyroid gap diagnose CONFIG --fit LOG --json FILE")
    })
}
