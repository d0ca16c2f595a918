//! `gyroid gap explain`: just these effects, with an interval for each parameter.

use super::diagnose::{names, read};
use super::loads::LoadArgs;
use super::recordings::shown;
use crate::cli::html::{self, HtmlArgs};
use crate::cli::log_args::ColumnArgs;
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::effects::Library;
use gyroid::files::Plan;
use gyroid::gap::explain;
use gyroid::report::ExplainReport;
use gyroid::report::html::explain_page;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Fit just these effects to a recording, at rest or of a drive as CONFIG's `kind` says: parameters with 95 % intervals
///
/// Whether they are at work is not asked: `gyroid gap diagnose` does that.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap explain sim.toml --fit fit.csv --effect gyro.tone gyro.rate_random_walk\n  \
    gyroid gap explain robot.toml --fit drive.parquet --effect vehicle.payload wheel.slip")]
pub(crate) struct ExplainArgs {
    /// The nominal simulator: a configuration with [gyro]; of a drive also [vehicle] and [encoder]
    config: PathBuf,
    /// Recording, in any format that `gyroid inspect` reads; of a drive, several files on one clock
    #[arg(long, value_name = "LOG", required = true, num_args = 1..)]
    fit: Vec<PathBuf>,
    /// The effects, by id
    #[arg(long, value_name = "ID", num_args = 1.., required = true)]
    effect: Vec<String>,
    /// Of a drive: read a column as a channel, whatever it is called: wheel_left_rad_s=wl:deg/s; may be given more than once
    #[arg(long, value_name = "CHANNEL=[-]COLUMN[:UNIT]")]
    map: Vec<String>,
    #[command(flatten)]
    loads: LoadArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &ExplainArgs) -> Result<Outcome> {
    places::check("gap explain", &args.config, "--fit ", &args.fit)?;
    let plan = args.page.planned(Plan::new().reads([&args.config]).reads(&args.fit));
    let output = Output::open(&args.common, "gap.explain", plan)?;
    let page = args.page.claim()?;
    let (config, by_time) = Config::read_base(&args.config)?.by_elapsed_time();
    let loads_kg = args.loads.of_drives(&[&args.fit], config.kind == Kind::Stationary)?;
    let config = config.carrying(loads_kg.into_iter().sum());
    let mut notes: Vec<String> = by_time.into_iter().collect();
    let working = output.working("reading");
    let (log, since_power_on_s) = match (config.kind, args.fit.as_slice()) {
        (Kind::Driving, paths) => {
            let recording = args.columns.read_drive(&args.map, paths, &config)?;
            notes.extend(recording.notes);
            let mut log = recording.log;
            log.source = shown(paths);
            places::check_drive(&log, &args.config)?;
            (log, args.columns.start_offset_s().unwrap_or(0.0))
        }
        (Kind::Stationary, [path]) if args.map.is_empty() => {
            let (log, said) = read(&args.columns, path, &args.config)?;
            notes.extend(said);
            (log, 0.0)
        }
        (Kind::Stationary, _) => {
            let found = "several files, or --map, and the configuration is of a gyro at rest";
            return Err(Error::new(ErrorKind::Usage, "--fit", found)
                .hint("give one recording, and name the gyro's column with --column"));
        }
    };
    working.show("fitting");
    let ids: Vec<&str> = args.effect.iter().map(String::as_str).collect();
    let named = |e: Error| match e.input.as_str() {
        "configuration" => e.named(args.config.display()),
        "effects" => e.named("--effect"),
        _ => e,
    };
    let library = Library::new().with_own(&config).map_err(named)?;
    let found = explain(&config, &log, &library, &ids, since_power_on_s).map_err(named)?;
    drop(working);
    let recording = names(std::slice::from_ref(&args.fit));
    output.say(ExplainReport { recording: &recording, found: &found, notes: &notes }.text());
    if let Some(file) = page {
        let origin = html::origin([&args.config].into_iter().chain(&args.fit))?;
        html::write(file, &explain_page(&recording, &found, &notes, &origin)?, &output)?;
    }
    output.finish(&serde_json::json!(found))?;
    Ok(Outcome::Done)
}
