//! `gyroid simulate`: a log as the configuration would have it.

use super::drive_args::DriveArgs;
use super::outcome::Outcome;
use super::output::{Common, Output};
use super::places;
use super::restart::PowerArgs;
use clap::Args;
use gyroid::bias::Restart;
use gyroid::config::{Config, Kind};
use gyroid::effects::Library;
use gyroid::files::Plan;
use gyroid::ingest::LogWriter;
use gyroid::progress;
use gyroid::signal::Log;
use gyroid::simulate::{Course, Drive, Options, drive_with, replay_with, stationary_like, stationary_with};
use gyroid::units::duration_text;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Simulate a log: a gyro at rest, a drive along a course, or recorded torques replayed
///
/// Without --course and --inputs, and where the configuration is stationary, the gyro stands at rest. Effects of reality are
/// simulated where the configuration holds them as tables [[effect]]. The same seed gives the same bytes.
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    gyroid simulate gyroid.toml --duration 1800 --seed 1 -o power_on.csv\n  \
    gyroid simulate gyroid.toml --course square --start-offset 20 -o drive.parquet\n  \
    gyroid simulate gyroid.toml --inputs recorded.parquet -o predicted.parquet"
)]
pub(crate) struct SimulateArgs {
    /// Configuration (schema 1)
    config: PathBuf,
    /// Course to drive
    #[arg(long, value_name = "NAME", value_parser = course, help = course_help())]
    course: Option<Course>,
    /// Replay this log's torques; where it has none, its wheel speeds. At rest: its rows, temperature and supply
    #[arg(long, value_name = "LOG", conflicts_with_all = ["course", "duration"])]
    inputs: Option<PathBuf>,
    #[command(flatten)]
    columns: DriveArgs,
    /// Length of the log, s [default: 180 on a course, 1800 at rest]
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Seed of the sensors' noise, to record the motion of a log (--inputs) anew; on a course the speed control reads the encoders,
    /// and hands a little of their noise on [default: --seed]
    #[arg(long, value_name = "N")]
    sensor_seed: Option<u64>,
    #[command(flatten)]
    power: PowerArgs,
    /// Sample time, s [default: the configuration's]
    #[arg(long, value_name = "S", conflicts_with = "inputs")]
    sample_time: Option<f64>,
    /// Known load that the robot carries, a point mass at its centre of mass, kg: its mass is that of the configuration and this
    #[arg(long, value_name = "KG")]
    load: Option<f64>,
    /// Draw C1, C2 and T inside the configuration's repeatability from power-on to power-on
    #[arg(long)]
    vary_turn_on: bool,
    /// Write the true pose, velocities and gyro error of a drive to this log
    #[arg(long, value_name = "LOG")]
    truth: Option<PathBuf>,
    /// Log to write (.csv or .parquet)
    #[arg(short, long, value_name = "LOG")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

fn course(name: &str) -> std::result::Result<Course, String> {
    Course::parse(name).ok_or_else(|| format!("there are {}", course_names()))
}

fn course_names() -> String {
    Course::ALL.map(Course::name).join(", ")
}

fn course_help() -> String {
    format!("Course to drive: {}", course_names())
}

/// Default lengths, s.
const COURSE_S: f64 = 180.0;
const REST_S: f64 = 1800.0;

pub(crate) fn run(args: &SimulateArgs) -> Result<Outcome> {
    places::check("simulate", &args.config, "--inputs ", &args.inputs)?;
    let plan = Plan::new().reads([&args.config]).reads(&args.inputs);
    let plan = plan.writes("--out", [&args.out]).writes("--truth", &args.truth);
    let output = Output::open(&args.common, "simulate", plan)?;
    let out = LogWriter::claim(&args.out)?;
    let truth_out = args.truth.as_ref().map(LogWriter::claim).transpose()?;
    let name = args.config.display().to_string();
    let (mut config, by_time) = Config::read(&args.config)?.by_elapsed_time();
    if let Some(step_s) = args.sample_time {
        if !(step_s.is_finite() && step_s > 0.0) {
            return Err(usage("--sample-time", format!("{step_s} s is not a positive time")));
        }
        config.sample_time_s = Some(step_s);
    }
    let at_rest = config.kind == Kind::Stationary;
    if at_rest && args.course.is_some() {
        return Err(Error::new(ErrorKind::Usage, &name, "is stationary: its gyro drives no course")
            .at("`kind`")
            .hint("set kind = \"driving\" and add [vehicle] and [encoder], or leave out --course"));
    }
    let driven = args.course.is_some() || (args.inputs.is_some() && !at_rest);
    if args.truth.is_some() && !driven {
        return Err(usage("--truth", "a log at rest has no motion to tell".into()));
    }
    if let Some(load_kg) = args.load {
        let mass = "give the weighed load in kg, zero or more";
        let at_rest = "leave it out, or name a --course";
        if !(load_kg.is_finite() && load_kg >= 0.0) {
            return Err(usage("--load", format!("{load_kg} kg is no mass")).hint(mass));
        }
        if !driven {
            return Err(usage("--load", "a gyro at rest carries none".into()).hint(at_rest));
        }
        config = config.carrying(load_kg);
    }
    let mut options = Options {
        since_power_on_s: args.power.since_power_on_s(),
        vary_turn_on: args.vary_turn_on,
        off_time_s: args.power.off_time,
        ..Options::from(args.seed)
    };
    options.seeds.sensors = args.sensor_seed.unwrap_or(args.seed);

    let named = |error: Error| if error.input == "configuration" { error.named(&name) } else { error };
    let working = output.working("simulating");
    let inputs = args.inputs.as_ref().map(|path| args.columns.read(std::slice::from_ref(path), &config)).transpose()?;
    inputs.iter().try_for_each(|recorded| args.power.check(&recorded.log))?;
    let effects = Library::new().with_own(&config).map_err(named)?;
    let course_s = args.duration.unwrap_or(COURSE_S);
    let drive = || match (&inputs, args.course) {
        (Some(recorded), _) if driven => replay_with(&config, &recorded.log, &options, &effects).map(Some),
        (None, Some(course)) => drive_with(&config, course, course_s, &options, &effects).map(Some),
        _ => Ok(None),
    };
    let rest = || match &inputs {
        Some(recorded) => stationary_like(&config, &recorded.log, &options, &effects),
        None => stationary_with(&config, args.duration.unwrap_or(REST_S), &options, &effects),
    };
    let counter = |what: &str| working.counter(format!("{what} row"));
    let simulated = progress::listened(counter("simulating"), drive).map_err(named)?;
    let log = match &simulated {
        Some(Drive { log, .. }) => log,
        None => &progress::listened(counter("simulating"), rest).map_err(named)?,
    };
    working.show("writing");
    progress::listened(counter("writing"), || out.write(log))?;
    if let (Some(out), Some(Drive { truth, .. })) = (truth_out, &simulated) {
        progress::listened(counter("writing the truth:"), || out.write(truth))?;
    }
    drop(working);
    output.say(format!(
        "{}: {} rows, {} at {:.4} s, {}",
        args.out.display(),
        log.len(),
        duration_text(log.time.span_s()),
        log.time.median_step_s(),
        what(args)
    ));
    if let Some(load_kg) = args.load {
        output.say(format!("with a load of {load_kg} kg"));
    }
    for note in inputs.iter().flat_map(|recorded| &recorded.notes).chain(&by_time) {
        output.say(format!("note: {note}"));
    }
    if !config.effects.is_empty() {
        let ids: Vec<_> = config.effects.iter().map(|e| e.id.as_str()).collect();
        output.say(format!("with {}", ids.join(", ")));
    }
    let restart = args.power.off_time.map(|off_s| config.require_gyro()?.restart(off_s)).transpose()?;
    let mut value = json(args, log, simulated.as_ref(), restart);
    if !config.effects.is_empty() {
        value["effects"] = config.effects.iter().map(|e| e.id.as_str()).collect();
    }
    output.finish(&value)?;
    Ok(Outcome::Done)
}

fn usage(option: &str, found: String) -> Error {
    Error::new(ErrorKind::Usage, "simulate", found).at(option)
}

fn what(args: &SimulateArgs) -> String {
    match (&args.inputs, args.course) {
        (Some(path), _) => format!("inputs of {}", path.display()),
        (None, Some(course)) => format!("course {}", course.name()),
        (None, None) => "at rest".into(),
    }
}

fn json(args: &SimulateArgs, log: &Log, simulated: Option<&Drive>, restart: Option<Restart>) -> serde_json::Value {
    let channels: Vec<_> = log.channels.iter().map(|c| c.name.as_str()).collect();
    let mut value = serde_json::json!({
        "log": args.out.display().to_string(),
        "motion": what(args),
        "rows": log.len(),
        "span_s": log.time.span_s(),
        "sample_time_s": log.time.median_step_s(),
        "seed": args.seed,
        "sensor_seed": args.sensor_seed.unwrap_or(args.seed),
        "channels": channels,
    });
    if let Some(load_kg) = args.load {
        value["load_kg"] = serde_json::json!(load_kg);
    }
    if let Some(Drive { warm_up, .. }) = simulated {
        value["gyro"] = serde_json::json!({
            "c1_rad_s": warm_up.c1_rad_s,
            "c2_rad_s": warm_up.c2_rad_s,
            "time_constant_s": warm_up.time_constant_s,
            "warm_up_age_at_power_on_s": restart.map_or(0.0, |r| r.age_s(warm_up.time_constant_s)),
        });
    }
    value
}
