//! `gyroid gap power`: what a log could have found.

use super::asked::AskedArgs;
use super::diagnose::{library, names, read};
use super::loads::LoadArgs;
use super::recordings::read_drive;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::files::{OutputFile, Plan};
use gyroid::gap::power::{Options, power};
use gyroid::report::PowerReport;
use gyroid::report::plot::Format;
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// What could this very log have found: the smallest size of each effect that `gyroid gap diagnose` would name
///
/// Logs with the inputs, rows and channels of this one are simulated, with each effect larger and smaller beside noise of their own,
/// and diagnosed. At rest or of a drive, as CONFIG's `kind` says. The log's readings are not used, only that it has them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap power robot.toml --inputs drive.parquet --plot power.png\n  \
    gyroid gap power sim.toml --inputs rest.csv --effect gyro.tone gyro.rate_ramp --check 40\n  \
    gyroid gap power robot.toml --inputs imu.csv wheels.csv --cases 30 --json power.json")]
pub(crate) struct PowerArgs {
    /// The nominal simulator: a configuration with [gyro]; of a drive also [vehicle] and [encoder]
    config: PathBuf,
    /// Log, in any format that `gyroid inspect` reads; of a drive, several files on one clock
    #[arg(long, value_name = "LOG", required = true, num_args = 1..)]
    inputs: Vec<PathBuf>,
    /// Probability with which the effect is to be named, 0.5 to 0.99
    #[arg(long, value_name = "P", default_value_t = 0.9)]
    probability: f64,
    /// Only these effects, by id [default: all that the log can show]
    #[arg(long, value_name = "ID", num_args = 1..)]
    effect: Vec<String>,
    /// Logs that are simulated for each effect and direction; each takes about five diagnoses, and with few the sizes are known less well
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u16).range(3..=1000))]
    cases: u16,
    /// Diagnose K further logs with each effect as large as was told, and count how often it is named
    #[arg(long, value_name = "K", default_value_t = 0)]
    check: u16,
    /// Draw how often each effect is named against its size; the format follows the ending, .svg or .png; may be given more than once
    #[arg(long, value_name = "FILE")]
    plot: Vec<PathBuf>,
    #[command(flatten)]
    loads: LoadArgs,
    #[command(flatten)]
    asked: AskedArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &PowerArgs) -> Result<Outcome> {
    places::check("gap power", &args.config, "--inputs ", &args.inputs)?;
    let plan = Plan::new().reads([&args.config]).reads(&args.inputs).writes("--plot", &args.plot);
    let output = Output::open(&args.common, "gap.power", plan)?;
    let plots = args.plot.iter().map(|path| Format::of(path).and_then(|_| OutputFile::claim(path)));
    let plots = plots.collect::<Result<Vec<_>>>()?;
    let (config, by_time) = Config::read_base(&args.config)?.by_elapsed_time();
    let config = args.loads.carried(config, &args.inputs)?;
    let library = library(&args.asked.without, Some(&config))?;
    let mut notes: Vec<String> = by_time.into_iter().collect();
    let working = output.working("reading");
    let (log, since_power_on_s) =
        read_one(&args.asked, ("--inputs", &args.inputs), (&config, &args.config), &mut notes)?;
    let options = Options {
        probability: args.probability,
        cases: args.cases.into(),
        check: args.check.into(),
        seed: args.asked.seed,
        effects: args.effect.clone(),
        since_power_on_s,
    };
    working.show("diagnosing logs without an effect");
    let named = |e: Error| match e.input.as_str() {
        "configuration" => e.named(args.config.display()),
        "effects" => e.named("--effect"),
        "power" => e.named("--probability"),
        _ => e,
    };
    let mut found = {
        let count = working.counter("effects and directions:".into());
        power(&config, &log, &library, &options, &count).map_err(named)?
    };
    drop(working);
    found.notes.extend(notes);
    let name = names(std::slice::from_ref(&args.inputs));
    let report = PowerReport { log: &name, power: &found };
    output.say(report.text());
    if !plots.is_empty() {
        let picture = report.picture()?;
        let drawn: Vec<String> = plots.iter().map(|p| p.target().display().to_string()).collect();
        plots.into_iter().try_for_each(|file| picture.write(file))?;
        output.say(format!("\ndrew {}", drawn.join(", ")));
    }
    let mut json = serde_json::json!(found);
    json["kind"] = serde_json::json!(config.kind);
    output.finish(&json)?;
    Ok(Outcome::Done)
}

/// Reads the one recording of `option`, and the time since power-on at its first row, s, where a drive does not hold it; what the
/// reader decided goes to `notes`.
pub(super) fn read_one(
    asked: &AskedArgs,
    (option, paths): (&str, &[PathBuf]),
    (config, path): (&Config, &Path),
    notes: &mut Vec<String>,
) -> Result<(Log, f64)> {
    match (config.kind, paths) {
        (Kind::Driving, paths) => {
            let log = read_drive((&asked.columns, &asked.map), (option, paths), config, notes)?;
            places::check_drive(&log, path)?;
            Ok((log, asked.columns.starts_s(1)?[0]))
        }
        (Kind::Stationary, [one]) => {
            let (log, said) = read(&asked.columns, one, path)?;
            notes.extend(said);
            Ok((log, 0.0))
        }
        (Kind::Stationary, _) => {
            let found = "several files, and the configuration is of a gyro at rest";
            Err(Error::new(ErrorKind::Usage, option, found)
                .hint("give one recording; several files on one clock can only be of a drive"))
        }
    }
}
