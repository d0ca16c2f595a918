//! `gyroid fit` of many logs.

use super::args::{AgainstName, FitArgs, columns, configuration_options, fit_options, plan};
use crate::cli::many::{Table, refuse_failed, rows_of, settings};
use crate::cli::outcome::Outcome;
use crate::cli::output::Output;
use gyroid::bias::EarthRate;
use gyroid::config::Config;
use gyroid::export::{ConfigurationOptions, population_configuration};
use gyroid::files::OutputFile;
use gyroid::population::{self, Population, WarmUp, analyse_all};
use gyroid::report::PopulationReport;
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

pub(super) fn run(args: &FitArgs, earth: Option<EarthRate>) -> Result<Outcome> {
    let many = &args.many;
    refuse_what_is_for_one(args)?;
    let output = Output::open(&args.common, "fit", plan(args))?;
    let config = args.population.config.as_ref().map(OutputFile::claim).transpose()?;
    let columns = columns(args);
    let settings = settings(&columns, args.axes.or(columns.axes()))?;
    let warm_up = WarmUp { earth, fit: fit_options(args)?, whiteness: args.whiteness.options()? };
    let base = args.base.as_ref().map(Config::read_base).transpose()?;
    let beside: Vec<PathBuf> = many.results.iter().chain(&args.common.json).cloned().collect();
    let logs = many.logs(&args.logs, &beside)?;
    let working = output.working("fitting the logs");
    let mut table = Table::begin(many, &working, rows_of(&settings, logs.len()), "fitted")?;
    let done = {
        let (known, mut each) = table.parts();
        analyse_all(&logs, &settings, &warm_up, many.jobs(), known, &mut each)?
    };
    let wrote = table.end(&done.rows)?;
    drop(working);

    let populations = Population::by_axis(&done.rows, &judged(args.population.keep_outlying, args.accept));
    let report = PopulationReport { rows: done.rows, populations, fitted: done.fitted, resumed: done.resumed };
    output.say(report.text().trim_end());
    if let Some(wrote) = wrote {
        output.say(wrote);
    }
    let outcome =
        concluded(&report, report.json(), output, config.map(|file| (file, base, configuration_options(args))))?;
    refuse_failed(&report.rows, many.shard, "fitted")?;
    Ok(outcome)
}

pub(in crate::cli) fn judged(keep_outlying: bool, accept_not_white: bool) -> population::Options {
    population::Options { keep_outlying, accept_not_white, ..population::Options::default() }
}

/// Writes the configuration of the population, where one was asked for, and `json`.
pub(in crate::cli) fn concluded(
    report: &PopulationReport,
    mut json: serde_json::Value,
    output: Output,
    config: Option<(OutputFile, Option<Config>, ConfigurationOptions)>,
) -> Result<Outcome> {
    let mut fit = report.failed() == 0;
    json["configuration"] = serde_json::Value::Null;
    if let Some((file, base, options)) = config {
        let name = file.target().display().to_string();
        match write_configuration(file, report, base.as_ref(), &options) {
            Ok(said) => {
                output.say(format!("wrote {name}: {said}"));
                json["configuration"] = name.into();
            }
            Err(e) if e.kind == ErrorKind::TooShort => {
                output.say(format!("{name} not written: {}; {}", e.found, e.hint.unwrap_or_default()));
                fit = false;
            }
            Err(e) => return Err(e),
        }
    }
    output.finish(&json)?;
    Ok(if fit { Outcome::Done } else { Outcome::Unfit })
}

fn refuse_what_is_for_one(args: &FitArgs) -> Result<()> {
    let usage = |option: &str, hint: &str| {
        Err(Error::new(ErrorKind::Usage, option, "is for one log, and this is a table of many").hint(hint))
    };
    if args.out.is_some() {
        return usage(
            "--out",
            "write the configuration of the population with --config FILE, or fit one log of one topic",
        );
    }
    if !args.plot.is_empty() {
        return usage("--plot", "fit the log that is to be drawn alone");
    }
    if args.page.wanted() {
        return usage("--html", "fit the log that is to be shown alone");
    }
    if args.against == AgainstName::Temperature {
        return usage("--against", "fit one log against temperature at a time");
    }
    if args.population.config.is_some() && args.columns.several_topics() {
        return Err(Error::new(ErrorKind::Usage, "--config", "is of one gyro, and several topics are named")
            .hint("name one with --topic"));
    }
    let axes = args.axes.or(args.columns.axes());
    if args.population.config.is_some() && axes.len() > 1 {
        let found = format!("is of one axis, and {} are named", axes.len());
        return Err(Error::new(ErrorKind::Usage, "--config", found).hint("name one with --axis"));
    }
    Ok(())
}

fn write_configuration(
    mut file: OutputFile,
    report: &PopulationReport,
    base: Option<&Config>,
    options: &ConfigurationOptions,
) -> Result<String> {
    let [population] = &report.populations[..] else {
        return Err(Error::new(ErrorKind::Usage, "--config", "is of one axis").hint("name one with --axis"));
    };
    let config = population_configuration(population, &report.rows, base, options)?;
    let name = file.target().display().to_string();
    file.write_all(config.to_toml().map_err(|e| e.named(name))?.as_bytes())?;
    file.commit()?;
    let gyro = config.require_gyro()?;
    let said = |key: &str, value: Option<f64>| match value {
        Some(v) => format!("{key} = {v:.3e}"),
        None => format!("no {key}, the logs' own errors explain the differences"),
    };
    Ok([
        format!("the mean of {} logs", population.counted.len()),
        said("turn_on_bias_std_rad_s", gyro.turn_on_bias_std_rad_s),
        said("warm_up_relative_std", gyro.warm_up_relative_std),
    ]
    .join(", "))
}
