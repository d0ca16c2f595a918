//! `gyroid noise`: Allan deviation and the joint noise model of a log at rest, or the models of many.

pub(crate) use super::noise_args::NoiseArgs;

use super::axes::{self, Section};
use super::html;
use super::log_args::{LogArgs, LogRead};
use super::noise_args::{options, plan};
use super::noise_many;
use super::outcome::Outcome;
use super::output::Output;
use super::places;
use gyroid::Result;
use gyroid::files::OutputFile;
use gyroid::identify::terms::{TermOptions, noise_model, noise_model_reduced};
use gyroid::report::html::noise_page;
use gyroid::report::mcap::{NoiseRecording, Shown};
use gyroid::report::plot::Format;
use gyroid::report::{LogFacts, NoiseReport};
use gyroid::signal::names;

pub(crate) fn run(args: &NoiseArgs) -> Result<Outcome> {
    places::check_logs(&args.logs)?;
    let log = match &args.logs[..] {
        [one]
            if !one.is_dir()
                && !args.many.asked_for()
                && args.axes.axes.is_empty()
                && !args.columns.several_topics() =>
        {
            LogArgs::new(one.clone(), args.memory, args.columns.clone())
        }
        _ => return noise_many::run(args),
    };
    args.write.check()?;
    if log.axes().len() > 1 {
        axes::refuse(&[
            ("--write", args.write.write.is_some()),
            ("--plot", !args.plot.is_empty()),
            ("--html", args.page.wanted()),
            ("--mcap", args.recording.wanted()),
        ])?;
        let output = Output::open(&args.common, "noise", plan(args))?;
        let options = options(args)?;
        return axes::each(&log, output, "estimating the noise terms", |read| {
            let report = estimated(args, &log, read, facts(&log, read), &options)?;
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
    let read = log.read(&working)?;
    drop(working);
    let working = output.working("estimating the noise terms");
    let facts = facts(&log, &read);
    pending.iter().try_for_each(|p| p.check(&facts))?;
    let report = estimated(args, &log, &read, facts, &options)?;
    drop(working);
    output.say(report.text());
    if !plots.is_empty() {
        let picture = report.picture()?;
        let names: Vec<String> = plots.iter().map(|p| p.target().display().to_string()).collect();
        plots.into_iter().try_for_each(|file| picture.write(file))?;
        output.say(format!("drew {}", names.join(", ")));
    }
    if let Some(file) = page {
        let origin = html::origin(args.logs.iter().chain(&args.config))?;
        html::write(file, &noise_page(&report, &origin)?, &output)?;
    }
    if let Some(mcap) = mcap {
        let readings = match &read {
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

fn facts(log: &LogArgs, read: &LogRead) -> LogFacts {
    match read {
        LogRead::Whole(recording, _) => log.facts(recording),
        LogRead::Streamed(recording) => log.facts_streamed(recording),
    }
}

fn estimated(
    args: &NoiseArgs,
    log: &LogArgs,
    read: &LogRead,
    facts: LogFacts,
    options: &TermOptions,
) -> Result<NoiseReport> {
    let named = |e| log.named(e);
    let model = match read {
        LogRead::Whole(recording, time) => {
            let rate = recording.log.require(names::GYRO_Z)?;
            let temperature = recording.log.get(names::TEMPERATURE);
            noise_model(time, rate, temperature, options).map_err(named)?
        }
        LogRead::Streamed(recording) => noise_model_reduced(&recording.log, options).map_err(named)?,
    };
    Ok(NoiseReport { log: facts, model, datasheet: args.datasheet, level: args.level })
}
