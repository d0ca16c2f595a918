//! `gyroid fit` of many logs.

use super::args::{AgainstName, FitArgs, columns, configuration_options, fit_options, plan};
use crate::cli::outcome::Outcome;
use crate::cli::output::{Output, Working};
use gyroid::bias::EarthRate;
use gyroid::config::Config;
use gyroid::export::{ConfigurationOptions, population_configuration};
use gyroid::files::OutputFile;
use gyroid::population::{self, Origin, Population, Row, Settings, Topics, results};
use gyroid::report::PopulationReport;
use gyroid::units::duration_text;
use gyroid::{Error, ErrorKind, Result};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How often results are saved while the work goes on.
const SAVE_EVERY: Duration = Duration::from_secs(5);

pub(super) fn run(args: &FitArgs, earth: Option<EarthRate>) -> Result<Outcome> {
    let many = &args.many;
    refuse_what_is_for_one(args)?;
    let output = Output::open(&args.common, "fit", plan(args))?;
    let config = many.config.as_ref().map(OutputFile::claim).transpose()?;
    let settings = settings(args, earth)?;
    let base = args.base.as_ref().map(Config::read_base).transpose()?;
    let mut results = many.results.clone().map(|path| Saved::claim(path, many.resume)).transpose()?;
    let beside: Vec<PathBuf> = many.results.iter().chain(&args.common.json).cloned().collect();
    let mut logs = population::find(&args.logs, &beside)?;
    if let Some(shard) = many.shard {
        logs = shard.of(logs, &args.logs);
    }

    let jobs = many.jobs.or_else(|| std::thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let working = output.working("fitting the logs");
    let gyros = match &settings.topics {
        Topics::Only => Some(1),
        Topics::Named(names) => Some(names.len()),
        Topics::All => None,
    };
    let mut progress = Progress::new(&working, gyros.map(|n| n * logs.len() * settings.axes.len()));
    let known = results.as_mut().map(|r| std::mem::take(&mut r.known)).unwrap_or_default();
    let mut each = |row: &Row, origin: Origin| {
        progress.step(row, origin);
        results.as_mut().map_or(Ok(()), |r| r.add(row))
    };
    let done = population::fit_all(&logs, &settings, jobs, &known, &mut each)?;
    drop(working);

    if let Some(saved) = &results {
        results::write(&saved.path, &done.rows)?;
    }
    let populations = Population::by_axis(&done.rows, &judged(many.keep_outlying, args.accept));
    let report = PopulationReport { rows: done.rows, populations, fitted: done.fitted, resumed: done.resumed };
    output.say(report.text().trim_end());
    if let Some(saved) = &results {
        let stays =
            |k: &&Row| report.rows.iter().any(|r| r.sha256 == k.sha256 && r.topic == k.topic && r.axis == k.axis);
        let gone = known.len() - known.iter().filter(stays).count();
        let gone = if gone > 0 { format!("; {gone} of logs that are not named now are gone") } else { String::new() };
        output.say(format!("wrote {}: {} rows{gone}", saved.path.display(), report.rows.len()));
    }
    let outcome =
        concluded(&report, report.json(), output, config.map(|file| (file, base, configuration_options(args))))?;
    // of logs that all fail the first error says what is wrong; those of a part are but some of the logs
    let failed = report.failed();
    if failed > 0 && failed == report.rows.len() && many.shard.is_none() {
        let first = report.rows.iter().find_map(|r| r.error.clone()).unwrap_or_default();
        return Err(Error::new(ErrorKind::Format, format!("{failed} logs"), format!("none could be fitted: {first}")));
    }
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
    if args.many.config.is_some() && args.columns.several_topics() {
        return Err(Error::new(ErrorKind::Usage, "--config", "is of one gyro, and several topics are named")
            .hint("name one with --topic"));
    }
    let axes = args.many.axes_or(args.columns.axes());
    if args.many.config.is_some() && axes.len() > 1 {
        let found = format!("is of one axis, and {} are named", axes.len());
        return Err(Error::new(ErrorKind::Usage, "--config", found).hint("name one with --axis"));
    }
    Ok(())
}

fn settings(args: &FitArgs, earth: Option<EarthRate>) -> Result<Settings> {
    let columns = columns(args);
    let axes = args.many.axes_or(columns.axes());
    Ok(Settings {
        query: columns.query_of_any_topic(axes[0])?,
        topics: columns.topics(),
        axes,
        trim_motion: columns.trims_motion(),
        start_offset_s: columns.start_offset_s(),
        earth,
        fit: fit_options(args)?,
        whiteness: args.whiteness.options()?,
    })
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

/// A file of results, saved now and then, so that little is lost when the work is broken off.
struct Saved {
    path: PathBuf,
    /// Rows of an earlier run.
    known: Vec<Row>,
    rows: Vec<Row>,
    saved: Instant,
}

impl Saved {
    /// Checks that the file can be written, and reads the rows that it holds if the work is to be resumed.
    fn claim(path: PathBuf, resume: bool) -> Result<Self> {
        results::Format::of(&path)?;
        drop(OutputFile::claim(&path)?);
        let known = if resume && path.exists() { results::read(&path)? } else { Vec::new() };
        Ok(Self { path, rows: known.clone(), known, saved: Instant::now() })
    }

    /// Adds a row, in place of an earlier one of the same log, topic and axis.
    fn add(&mut self, row: &Row) -> Result<()> {
        match self.rows.iter_mut().find(|r| r.path == row.path && r.topic == row.topic && r.axis == row.axis) {
            Some(old) => old.clone_from(row),
            None => self.rows.push(row.clone()),
        }
        if self.saved.elapsed() < SAVE_EVERY {
            return Ok(());
        }
        results::write(&self.path, &self.rows)?;
        self.saved = Instant::now();
        Ok(())
    }
}

/// How far the work is, and how long the rest will take.
struct Progress<'a> {
    working: &'a Working,
    /// Rows in all, where that is known before the logs are opened.
    total: Option<usize>,
    done: usize,
    fitted: usize,
    failed: usize,
    start: Instant,
}

impl<'a> Progress<'a> {
    fn new(working: &'a Working, total: Option<usize>) -> Self {
        Self { working, total, done: 0, fitted: 0, failed: 0, start: Instant::now() }
    }

    fn step(&mut self, row: &Row, origin: Origin) {
        self.done += 1;
        self.fitted += usize::from(origin == Origin::Fitted);
        self.failed += usize::from(row.error.is_some());
        let left = self.total.map_or(0, |total| total.saturating_sub(self.done));
        let of = self.total.map_or(String::new(), |total| format!(" of {total}"));
        // what was known took no time
        let each = self.start.elapsed().as_secs_f64() / self.fitted.max(1) as f64;
        let rest = if left > 0 { format!(", {} left", duration_text(each * left as f64)) } else { String::new() };
        self.working.show(format!("fitted {}{of}, {} failed{rest}", self.done, self.failed));
    }
}
