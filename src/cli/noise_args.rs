//! Arguments of `gyroid noise`, and the options of the library that they stand for.

use super::html::HtmlArgs;
use super::log_args::{ColumnArgs, MemoryArgs};
use super::many::{AxesArgs, ManyArgs};
use super::mcap::McapArgs;
use super::noise_write::WriteArgs;
use super::output::Common;
use clap::Args;
use gyroid::config::Config;
use gyroid::files::Plan;
use gyroid::identify::terms::{TermOptions, WarmUpRemoval};
use gyroid::noise::TermKind;
use gyroid::noise::datasheet::Datasheet;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Estimates the noise terms of a log at rest together, its warm-up removed first, and the deviations of the Allan family.
///
/// Says which terms the log supports and how long to record for those that it does not; holds them against a datasheet,
/// and tells which cause adds how much to the heading error over a horizon. Exit code 3: the terms do not explain the log.
///
/// Of several logs or a folder it makes a table with one row a log, gyro and axis, and says how much each term differs from log to log.
#[derive(Debug, Clone, Args)]
pub(crate) struct NoiseArgs {
    /// Logs of a gyro at rest, or folders of them: CSV, JSON lines, Parquet, bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    #[arg(value_name = "LOG", required = true)]
    pub(super) logs: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) many: ManyArgs,
    #[command(flatten)]
    pub(super) axes: AxesArgs,
    /// Terms to choose from, by letter or name: Q,N,B,K,R,GM,BW,NB [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse_term)]
    terms: Vec<TermKind>,
    /// Fit all of --terms instead of choosing among them
    #[arg(long, requires = "terms")]
    no_selection: bool,
    /// Take the warm-up out before: where the fit finds one and knows its time constant, always, or never
    #[arg(long, value_enum, default_value_t = WarmUpName::Found)]
    warm_up: WarmUpName,
    /// Fit no frequencies above this, Hz: where a filter in the sensor cuts its white noise off
    #[arg(long, value_name = "HZ")]
    max_frequency: Option<f64>,
    /// Compare with the datasheet of this gyro
    #[arg(long, value_name = "NAME", value_parser = parse_datasheet)]
    pub(super) datasheet: Option<Datasheet>,
    /// How long a heading is carried without correction: 60s, 5min, 1h
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_duration)]
    horizon: f64,
    /// Standard deviation of the bias from one power-on to the next, rad/s [default: the configuration's]
    #[arg(long, value_name = "RAD_S")]
    turn_on_std: Option<f64>,
    /// Configuration that says how much the bias varies from one power-on to the next [default: that of --write]
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Draw the Allan deviation with the terms here (.png or .svg); may be given more than once
    #[arg(long, value_name = "FILE")]
    pub(super) plot: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) page: HtmlArgs,
    #[command(flatten)]
    pub(super) recording: McapArgs,
    #[command(flatten)]
    pub(super) write: WriteArgs,
    /// Probability at which a model that fits is called unfit
    #[arg(long, value_name = "P", default_value_t = 0.01)]
    pub(super) level: f64,
    /// Logs drawn from the model for the goodness of fit
    #[arg(long, value_name = "N", default_value_t = 199)]
    draws: usize,
    /// Their seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    pub(super) common: Common,
    #[command(flatten)]
    pub(super) memory: MemoryArgs,
    #[command(flatten)]
    pub(super) columns: ColumnArgs,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum WarmUpName {
    Found,
    Always,
    Never,
}

fn parse_term(text: &str) -> std::result::Result<TermKind, String> {
    TermKind::parse(text).ok_or_else(|| {
        let all: Vec<String> = TermKind::ALL.iter().map(|k| format!("{} ({})", k.symbol(), k.id())).collect();
        format!("no term {text:?}; there are {}", all.join(", "))
    })
}

fn parse_datasheet(text: &str) -> std::result::Result<Datasheet, String> {
    Datasheet::find(text).map_err(|e| format!("{}; {}", e.found, e.hint.unwrap_or_default()))
}

fn parse_duration(text: &str) -> std::result::Result<f64, String> {
    let text = text.trim();
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E').unwrap_or(text.len());
    let value: f64 = text[..split].trim().parse().map_err(|_| format!("{text:?} is no time; write 60s, 5min or 1h"))?;
    let factor = match text[split..].trim() {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "min" | "m" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        other => return Err(format!("no unit of time {other:?}; there are ms, s, min, h, d")),
    };
    if value > 0.0 && value.is_finite() { Ok(value * factor) } else { Err(format!("{text:?} is not positive")) }
}

pub(super) fn plan(args: &NoiseArgs) -> Plan {
    let plan = Plan::new().reads(&args.logs).reads(&args.config).writes("--plot", &args.plot);
    args.many.planned(args.write.planned(args.recording.planned(args.page.planned(plan))))
}

pub(super) fn options(args: &NoiseArgs) -> Result<TermOptions> {
    if !(args.level > 0.0 && args.level < 1.0) || (args.draws as f64) < 1.0 / args.level - 1.0 {
        let found = format!("level {} with {} draws cannot be decided", args.level, args.draws);
        return Err(Error::new(ErrorKind::Usage, "--level, --draws", found)
            .hint("give a level between 0 and 1, and at least 1/level draws"));
    }
    let config = args.config.as_ref().or(args.write.write.as_ref()).map(Config::read).transpose()?;
    let stated = config.and_then(|c| c.gyro).and_then(|g| g.turn_on_bias_std_rad_s);
    Ok(TermOptions {
        among: if args.terms.is_empty() { TermKind::ALL.to_vec() } else { args.terms.clone() },
        all_of_them: args.no_selection,
        warm_up: match args.warm_up {
            WarmUpName::Found => WarmUpRemoval::Found,
            WarmUpName::Always => WarmUpRemoval::Always,
            WarmUpName::Never => WarmUpRemoval::Never,
        },
        max_frequency_hz: args.max_frequency,
        draws: args.draws,
        seed: args.seed,
        horizon_s: args.horizon,
        turn_on_std_rad_s: args.turn_on_std.or(stated),
        ..TermOptions::default()
    })
}
