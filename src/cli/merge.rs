//! `gyroid merge`: the results of several runs as one.

use super::fit::{concluded, judged};
use super::outcome::Outcome;
use super::output::{Common, Output, command_line};
use super::units::{self, UnitArgs};
use clap::Args;
use gyroid::bias::Scheme;
use gyroid::config::Config;
use gyroid::effects::Library;
use gyroid::export::ConfigurationOptions;
use gyroid::files::{OutputFile, Plan};
use gyroid::fleet::{DriveRow, named, over_robots};
use gyroid::population::{Merged, NoiseRow, Population, Record, Row, read_merged, results};
use gyroid::report::{FleetReport, NoiseTableReport, PopulationReport};
use gyroid::{Error, ErrorKind, Result};
use serde_json::Value;
use std::path::PathBuf;

/// Makes one table of the results of several runs: the parts of `gyroid fit`, `gyroid noise` or `gyroid gap fleet` with --shard, or any --results.
///
/// Each log, gyro and axis is one row, known by the bytes of its file: neither the order of the parts matters, nor that a part is
/// given twice or that two overlap. A log that failed in one part and not in another counts as read.
///
/// Exit code 3: there are logs that could not be read or fitted, or too few for the configuration of the population.
#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// Results of `gyroid fit`, `gyroid noise` or `gyroid gap fleet`, .parquet or .csv
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Write all rows here (.parquet or .csv)
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Of fits: write the configuration of the population here: its means, and how far one power-on lies from them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Configuration to copy: brings [vehicle], [encoder], the filter's sample time
    #[arg(long, value_name = "FILE", requires = "config")]
    base: Option<PathBuf>,
    /// Of fits: count also logs whose residuals are not white
    #[arg(long)]
    accept: bool,
    /// Of fits: count also logs that are not of one population with the others
    #[arg(long)]
    keep_outlying: bool,
    #[command(flatten)]
    unit: UnitArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &MergeArgs) -> Result<Outcome> {
    let plan = Plan::new().reads(&args.parts).reads(&args.base).writes("--config", &args.config);
    let output = Output::open(&args.common, "merge", plan.writes("--out", [&args.out]))?;
    results::Format::of(&args.out)?;
    let config = args.config.as_ref().map(OutputFile::claim).transpose()?;
    let base = args.base.as_ref().map(Config::read_base).transpose()?;
    let columns = results::columns(&args.parts[0])?;
    if results::are::<NoiseRow>(&columns) || results::are::<DriveRow>(&columns) {
        if config.is_some() {
            let found = "is of fits, and these are no results of `gyroid fit`";
            return Err(Error::new(ErrorKind::Usage, "--config", found).hint("leave it out"));
        }
        return if results::are::<NoiseRow>(&columns) { noise(args, output) } else { drives(args, output) };
    }
    let (rows, repeated) = merged::<Row>(args)?;
    let populations = Population::by_axis(&rows, &judged(args.keep_outlying, args.accept));
    let resumed = rows.len();
    let report = PopulationReport { rows, populations, fitted: 0, resumed };
    say(args, &output, &report.text(), report.rows.len(), repeated);
    let json = told(args, report.json(), repeated);
    let options = ConfigurationOptions {
        scheme: Scheme::Exact,
        sample_time_s: None,
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    concluded(&report, json, output, config.map(|file| (file, base, options)))
}

fn noise(args: &MergeArgs, output: Output) -> Result<Outcome> {
    let (rows, repeated) = merged::<NoiseRow>(args)?;
    let report = NoiseTableReport { fitted: 0, resumed: rows.len(), rows };
    say(args, &output, &report.text(), report.rows.len(), repeated);
    output.finish(&told(args, report.json(), repeated))?;
    Ok(if report.failed() == 0 { Outcome::Done } else { Outcome::Unfit })
}

fn drives(args: &MergeArgs, output: Output) -> Result<Outcome> {
    let (rows, repeated) = merged::<DriveRow>(args)?;
    let effects = over_robots(&rows, &|row| units::of(&args.unit, &row.source.path), &Library::new());
    let report = FleetReport { fitted: 0, resumed: rows.len(), rows, effects };
    say(args, &output, &report.text(), report.rows.len(), repeated);
    if report.effects.is_empty() {
        let named = named(&report.rows).join(" ");
        if !named.is_empty() {
            output.say(format!(
                "over the robots: gyroid gap fleet … --results {} --resume --effect {named}",
                args.out.display()
            ));
        }
    }
    output.finish(&told(args, report.json(), repeated))?;
    Ok(if report.failed() == 0 { Outcome::Done } else { Outcome::Unfit })
}

/// The rows of all parts, which are written, and how many came more than once.
fn merged<R: Record>(args: &MergeArgs) -> Result<(Vec<R>, usize)> {
    let Merged { rows, repeated } = read_merged::<R>(&args.parts)?;
    results::write(&args.out, &rows)?;
    Ok((rows, repeated))
}

fn say(args: &MergeArgs, output: &Output, text: &str, rows: usize, repeated: usize) {
    output.say(text.trim_end());
    let again = if repeated > 0 { format!("; {repeated} that came more than once left out") } else { String::new() };
    output.say(format!("wrote {}: {rows} rows of {} parts{again}", args.out.display(), args.parts.len()));
}

fn told(args: &MergeArgs, mut json: Value, repeated: usize) -> Value {
    json["parts"] = args.parts.len().into();
    json["repeated"] = repeated.into();
    json
}
