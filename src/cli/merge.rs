//! `gyroid merge`: the results of several fits as one.

use super::fit::{concluded, judged};
use super::outcome::Outcome;
use super::output::{Common, Output, command_line};
use clap::Args;
use gyroid::Result;
use gyroid::bias::Scheme;
use gyroid::config::Config;
use gyroid::export::ConfigurationOptions;
use gyroid::files::{OutputFile, Plan};
use gyroid::population::{Merged, Population, read_merged, results};
use gyroid::report::PopulationReport;
use std::path::PathBuf;

/// Makes one table of the results of several fits: the parts of `gyroid fit --shard`, or any --results.
///
/// Each log, gyro and axis is one row, known by the bytes of its file: neither the order of the parts matters, nor that a part is
/// given twice or that two overlap. A log that failed in one part and was fitted in another counts as fitted.
///
/// Exit code 3: there are logs that could not be fitted, or too few for the configuration of the population.
#[derive(Debug, Args)]
pub(crate) struct MergeArgs {
    /// Results of `gyroid fit`, .parquet or .csv
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Write all rows here (.parquet or .csv)
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Write the configuration of the population here: its means, and how far one power-on lies from them
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Configuration to copy: brings [vehicle], [encoder], the filter's sample time
    #[arg(long, value_name = "FILE", requires = "config")]
    base: Option<PathBuf>,
    /// Count also logs whose residuals are not white
    #[arg(long)]
    accept: bool,
    /// Count also logs that are not of one population with the others
    #[arg(long)]
    keep_outlying: bool,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &MergeArgs) -> Result<Outcome> {
    let plan = Plan::new().reads(&args.parts).reads(&args.base).writes("--config", &args.config);
    let output = Output::open(&args.common, "merge", plan.writes("--out", [&args.out]))?;
    results::Format::of(&args.out)?;
    let config = args.config.as_ref().map(OutputFile::claim).transpose()?;
    let base = args.base.as_ref().map(Config::read_base).transpose()?;
    let Merged { rows, repeated } = read_merged(&args.parts)?;
    results::write(&args.out, &rows)?;
    let populations = Population::by_axis(&rows, &judged(args.keep_outlying, args.accept));
    let resumed = rows.len();
    let report = PopulationReport { rows, populations, fitted: 0, resumed };
    output.say(report.text().trim_end());
    let again = if repeated > 0 { format!("; {repeated} that came more than once left out") } else { String::new() };
    output.say(format!(
        "wrote {}: {} rows of {} parts{again}",
        args.out.display(),
        report.rows.len(),
        args.parts.len()
    ));
    let mut json = report.json();
    json["parts"] = args.parts.len().into();
    json["repeated"] = repeated.into();
    let options = ConfigurationOptions {
        scheme: Scheme::Exact,
        sample_time_s: None,
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    concluded(&report, json, output, config.map(|file| (file, base, options)))
}
