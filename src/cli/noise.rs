//! `gyroid noise`: Allan deviation and the joint noise model of a log at rest.

use super::axes::{self, Section};
use super::html::{self, HtmlArgs};
use super::log_args::{LogArgs, LogRead};
use super::mcap::McapArgs;
use super::noise_write::WriteArgs;
use super::outcome::Outcome;
use super::output::{Common, Output};
use super::places;
use clap::Args;
use gyroid::config::Config;
use gyroid::files::{OutputFile, Plan};
use gyroid::identify::terms::{TermOptions, WarmUpRemoval, noise_model, noise_model_reduced};
use gyroid::noise::TermKind;
use gyroid::noise::datasheet::Datasheet;
use gyroid::report::html::noise_page;
use gyroid::report::mcap::{NoiseRecording, Shown};
use gyroid::report::plot::Format;
use gyroid::report::{LogFacts, NoiseReport};
use gyroid::signal::names;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Estimates the noise terms of a log at rest together, its warm-up removed first, and the deviations of the Allan family.
///
/// Says which terms the log supports and how long to record for those that it does not; holds them against a datasheet,
/// and tells which cause adds how much to the heading error over a horizon. Exit code 3: the terms do not explain the log.
#[derive(Debug, Args)]
pub(crate) struct NoiseArgs {
    #[command(flatten)]
    log: LogArgs,
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
    datasheet: Option<Datasheet>,
    /// How long a heading is carried without correction: 60s, 5min, 1h
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_duration)]
    horizon: f64,
    /// Standard deviation of the bias from one power-on to the next, rad/s [default: the configuration's]
    #[arg(long, value_name = "RAD_S")]
    turn_on_std: Option<f64>,
    /// Configuration that says how much the bias varies from one power-on to the next [default: that of --write]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Draw the Allan deviation with the terms here (.png or .svg); may be given more than once
    #[arg(long, value_name = "FILE")]
    plot: Vec<PathBuf>,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    recording: McapArgs,
    #[command(flatten)]
    write: WriteArgs,
    /// Probability at which a model that fits is called unfit
    #[arg(long, value_name = "P", default_value_t = 0.01)]
    level: f64,
    /// Logs drawn from the model for the goodness of fit
    #[arg(long, value_name = "N", default_value_t = 199)]
    draws: usize,
    /// Their seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    common: Common,
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

pub(crate) fn run(args: &NoiseArgs) -> Result<Outcome> {
    places::check_logs([args.log.path()])?;
    if args.log.axes().len() > 1 {
        axes::refuse(&[
            ("--write", args.write.write.is_some()),
            ("--plot", !args.plot.is_empty()),
            ("--html", args.page.wanted()),
            ("--mcap", args.recording.wanted()),
        ])?;
        let output = Output::open(&args.common, "noise", plan(args))?;
        let options = options(args)?;
        return axes::each(&args.log, output, "estimating the noise terms", |log| {
            let report = estimated(args, log, facts(args, log), &options)?;
            let fit = report.fits() || args.write.accept;
            Ok(Section { text: report.text(), json: report.json(), fit })
        });
    }
    // every output is claimed before the work begins
    let output = Output::open(&args.common, "noise", plan(args))?;
    let plots = args.plot.iter().map(|path| Format::of(path).and_then(|_| OutputFile::claim(path)));
    let plots = plots.collect::<Result<Vec<_>>>()?;
    let page = args.page.claim()?;
    let mcap = args.recording.claim()?;
    let options = options(args)?;
    let pending = args.write.claim()?;

    let working = output.working("reading the log");
    let log = args.log.read(&working)?;
    drop(working);
    let working = output.working("estimating the noise terms");
    let facts = facts(args, &log);
    pending.iter().try_for_each(|p| p.check(&facts))?;
    let report = estimated(args, &log, facts, &options)?;
    drop(working);
    output.say(report.text());
    if !plots.is_empty() {
        let picture = report.picture()?;
        let names: Vec<String> = plots.iter().map(|p| p.target().display().to_string()).collect();
        plots.into_iter().try_for_each(|file| picture.write(file))?;
        output.say(format!("drew {}", names.join(", ")));
    }
    if let Some(file) = page {
        let origin = html::origin([args.log.path()].into_iter().chain(args.config.as_deref()))?;
        html::write(file, &noise_page(&report, &origin)?, &output)?;
    }
    if let Some(mcap) = mcap {
        let readings = match &log {
            LogRead::Whole(recording, time) => Some((time, recording.log.require(names::GYRO_Z)?)),
            LogRead::Streamed(_) => None,
        };
        mcap.write(Shown::Noise, |file| NoiseRecording { report: &report, readings }.write(file), &output)?;
    }
    let usable = report.fits() || args.write.accept;
    let written = match pending {
        Some(pending) if usable => Some(pending.write(&report, &output)?),
        Some(_) => {
            output.say("terms not written; --accept writes them all the same");
            None
        }
        None => None,
    };
    let mut json = report.json();
    json["configuration"] = written.into();
    output.finish(&json)?;
    Ok(if usable { Outcome::Done } else { Outcome::Unfit })
}

fn plan(args: &NoiseArgs) -> Plan {
    let plan = Plan::new().reads([args.log.path()]).reads(&args.config).writes("--plot", &args.plot);
    args.write.planned(args.recording.planned(args.page.planned(plan)))
}

fn facts(args: &NoiseArgs, log: &LogRead) -> LogFacts {
    match log {
        LogRead::Whole(recording, _) => args.log.facts(recording),
        LogRead::Streamed(recording) => args.log.facts_streamed(recording),
    }
}

fn estimated(args: &NoiseArgs, log: &LogRead, facts: LogFacts, options: &TermOptions) -> Result<NoiseReport> {
    let named = |e| args.log.named(e);
    let model = match log {
        LogRead::Whole(recording, time) => {
            let rate = recording.log.require(names::GYRO_Z)?;
            let temperature = recording.log.get(names::TEMPERATURE);
            noise_model(time, rate, temperature, options).map_err(named)?
        }
        LogRead::Streamed(recording) => noise_model_reduced(&recording.log, options).map_err(named)?,
    };
    Ok(NoiseReport { log: facts, model, datasheet: args.datasheet, level: args.level })
}

fn options(args: &NoiseArgs) -> Result<TermOptions> {
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
