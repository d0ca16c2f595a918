//! `gyroid gap fleet`: each drive of many robots, and which effect is the fleet's and which is one robot's.

use crate::cli::log_args::ColumnArgs;
use crate::cli::many::{ManyArgs, Table, refuse_failed, settings};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Common, Output};
use crate::cli::places;
use crate::cli::units::{self, UnitArgs};
use clap::Args;
use gyroid::config::{Config, Kind};
use gyroid::files::{self, Plan};
use gyroid::fleet::{DriveRow, Fleet, diagnose_all, named, over_robots};
use gyroid::gap::Options;
use gyroid::report::FleetReport;
use gyroid::signal::Log;
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// Diagnose each recording of many robots, and tell which effect all of them have and which is one robot's
///
/// Each recording is diagnosed by itself, some at a time, and becomes a row of a table. The effects that any diagnosis names are then fitted
/// together to every recording, also where they were not named. From these sizes follows in how many robots an effect is, in which, how large,
/// and how much it differs from robot to robot.
///
/// --shard does a part of the recordings; `gyroid merge` makes one table of the parts, and --resume goes on with it. Exit code 3: there are
/// recordings that could not be diagnosed.
#[derive(Debug, Clone, Args)]
#[command(after_help = "Examples:\n  \
    gyroid gap fleet robot.toml drives --results fleet.parquet\n  \
    gyroid gap fleet robot.toml drives --unit 'robot_(\\d+)' --json fleet.json\n  \
    gyroid gap fleet robot.toml drives --shard 1/8 -o part_1.parquet\n  \
    gyroid gap fleet robot.toml drives --results fleet.parquet --resume --effect wheel.slip vehicle.payload")]
pub(crate) struct FleetArgs {
    /// The nominal simulator of all robots: a configuration with [gyro]; of drives also [vehicle] and [encoder]
    config: PathBuf,
    /// Recordings, a file each, or folders of them, in any format that `gyroid inspect` reads
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    many: ManyArgs,
    #[command(flatten)]
    unit: UnitArgs,
    /// With --shard: the table of the part
    #[arg(short, long, value_name = "FILE", requires = "shard")]
    out: Option<PathBuf>,
    /// Fit these effects to every recording, by id [default: those that any diagnosis names; with --shard, none]
    #[arg(long, value_name = "ID", num_args = 1..)]
    effect: Vec<String>,
    /// Leave an effect out of the library; may be given more than once
    #[arg(long, value_name = "ID")]
    without: Vec<String>,
    /// Of drives: read a column as a channel, whatever it is called: wheel_left_rad_s=wl:deg/s; may be given more than once
    #[arg(long, value_name = "CHANNEL=[-]COLUMN[:UNIT]")]
    map: Vec<String>,
    /// Seed of the simulated recordings
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &FleetArgs) -> Result<Outcome> {
    let mut args = args.clone();
    args.many.of_a_part(&mut args.out);
    let args = &args;
    places::check_logs(&args.logs)?;
    let plan = args.many.planned(Plan::new().reads([&args.config]).reads(&args.logs));
    let output = Output::open(&args.common, "gap.fleet", plan)?;
    let (config, by_time) = Config::read_base(&args.config)?.by_elapsed_time();
    if config.kind == Kind::Stationary && !args.map.is_empty() {
        return Err(Error::new(
            ErrorKind::Usage,
            "--map",
            "names columns of a drive, and the configuration is of a gyro at rest",
        )
        .hint("name the gyro's column with --column"));
    }
    let library = super::diagnose::library(&args.without, Some(&config))?;
    let beside: Vec<PathBuf> = args.many.results.iter().chain(&args.common.json).cloned().collect();
    let logs = args.many.logs(&args.logs, &beside)?;
    let options = Options {
        seed: args.seed,
        since_power_on_s: args.columns.start_offset_s().unwrap_or(0.0),
        ..Options::default()
    };
    let read = |path: &Path| read(args, &config, path);
    let text = text(args)?;
    let fleet =
        |asked| Fleet { config: &config, library: &library, options: &options, asked, read: &read, text: &text };

    let working = output.working("diagnosing the recordings");
    let mut table = Table::begin(&args.many, &working, Some(logs.len()), "diagnosed")?;
    let jobs = args.many.jobs();
    let mut done = {
        let (known, mut each) = table.parts();
        diagnose_all(&logs, &fleet(&args.effect), jobs, known, &mut each)?
    };
    let asked = named(&done.rows);
    if args.effect.is_empty() && args.many.shard.is_none() && !asked.is_empty() {
        working.show("fitting the effects that are named to every recording");
        let fitted = done.fitted;
        done = diagnose_all(&logs, &fleet(&asked), jobs, &done.rows, &mut |_, _| Ok(()))?;
        (done.fitted, done.resumed) = (fitted, done.rows.len() - fitted);
    }
    let wrote = table.end(&done.rows)?;
    drop(working);

    let unit = |row: &DriveRow| units::of(&args.unit, &row.source.path);
    let effects = over_robots(&done.rows, &unit, &library);
    let report = FleetReport { rows: done.rows, effects, fitted: done.fitted, resumed: done.resumed };
    if let Some(note) = by_time {
        output.say(note);
    }
    output.say(report.text().trim_end());
    if let Some(wrote) = wrote {
        output.say(wrote);
    }
    output.finish(&report.json())?;
    refuse_failed(&report.rows, args.many.shard, "diagnosed")?;
    Ok(if report.failed() == 0 { Outcome::Done } else { Outcome::Unfit })
}

fn read(args: &FleetArgs, config: &Config, path: &Path) -> Result<(Log, Vec<String>)> {
    if config.kind == Kind::Stationary {
        return super::diagnose::read(&args.columns, path, &args.config);
    }
    let paths = [path.to_path_buf()];
    let mut notes = Vec::new();
    let log = super::recordings::read_drive((&args.columns, &args.map), ("LOG", &paths), config, &mut notes)?;
    places::check_drive(&log, &args.config)?;
    Ok((log, notes))
}

/// All that decides about a row: the simulator's bytes, and the options that are not defaults.
fn text(args: &FleetArgs) -> Result<String> {
    let settings = settings(&args.columns, vec![args.columns.axis()?])?;
    let some = |list: &[String]| (!list.is_empty()).then(|| list.to_vec());
    Ok(settings.text(vec![
        ("config_sha256", files::sha256(&args.config)?.into()),
        ("axis", args.columns.axis()?.to_string().into()),
        ("map", some(&args.map).into()),
        ("without", some(&args.without).into()),
        ("gap_seed", if args.seed == 1 { None } else { Some(args.seed) }.into()),
    ]))
}
