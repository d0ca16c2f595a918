//! `gyroid fit`: the warm-up model of a log at rest, or of many.

mod many;

use super::Outcome;
use super::axes::{self, Section};
use super::log_args::{ColumnArgs, LogArgs, LogRead, MemoryArgs};
use super::output::{Common, Output, command_line};
use super::places;
use clap::Args;
use gyroid::bias::{Against, EarthRate, Scheme};
use gyroid::config::Config;
use gyroid::export::{ConfigurationOptions, configuration};
use gyroid::files::{OutputFile, Plan};
use gyroid::identify::{self, Fit, FitOptions, Fixed, Loss, TemperatureFit, Weighting};
use gyroid::ingest::Axis;
use gyroid::report::plot::{Format, Picture};
use gyroid::report::{FitReport, LogFacts, Verdict, fit_picture};
use gyroid::signal::{Course, TimeAxis, bridged, names};
use gyroid::validate::{Residuals, Validation};
use gyroid::{Error, ErrorKind, Result, validate};
use std::path::{Path, PathBuf};

/// Fits e(t) = C1 (1 - exp(-t/T)) + C2 to a log at rest, validates it, and writes the configuration.
///
/// Where the log has a temperature, the same error is fitted against that too, and the report says which of both explains it, or
/// that the log cannot tell; --against temperature makes that model the one that is judged and written.
///
/// Exit code 3: the fit is done, and not fit for use (no warm-up or effect of temperature, T not identifiable, or residuals not
/// white); nothing is then exported unless --accept says so.
///
/// Of several logs, a folder, or several gyros of a log, it makes a table with one row a log, gyro and axis, and says how much
/// they differ. Exit code 3: there
/// are logs that could not be fitted, or too few for the configuration of the population.
#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// Logs of a gyro at rest, or folders of them: CSV, Parquet, bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    many: many::ManyArgs,
    /// Keep a parameter at a value: c1=, c2= (rad/s) or t= (s); may be given more than once
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_fixed)]
    fix: Vec<(Parameter, f64)>,
    /// Latitude of the place in degrees, negative in the south: states which part of C2 is the Earth's rotation. Of the vertical
    /// axis alone, pointing up
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Loss function; huber is robust to outliers
    #[arg(long, value_enum, default_value_t = LossName::Squares)]
    loss: LossName,
    /// How samples are weighed; uniform is ordinary least squares, walk finds a warm-up that a random walk of the bias hides
    #[arg(long, value_enum, default_value_t = WeightingName::Uniform)]
    weighting: WeightingName,
    /// Independent variable of the model; temperature is written as [gyro.temperature], which validate and navigate
    /// then use
    #[arg(long, value_enum, default_value_t = AgainstName::Time)]
    against: AgainstName,
    /// Configuration to copy: brings [vehicle], [encoder], the filter's sample time
    #[arg(long, value_name = "FILE")]
    base: Option<PathBuf>,
    /// Write the configuration here
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Export also what is not fit for use
    #[arg(long)]
    accept: bool,
    /// How the model is carried from sample to sample (backward-euler is the paper's equation 5j)
    #[arg(long, value_enum, default_value_t = SchemeName::Exact)]
    scheme: SchemeName,
    /// The filter's sample time in s [default: the base's, else the log's]
    #[arg(long, value_name = "S")]
    sample_time: Option<f64>,
    /// Draw log, fit and residuals here (.png or .svg) [default: beside the configuration, as both]
    #[arg(long, value_name = "FILE", conflicts_with = "no_plot")]
    plot: Vec<PathBuf>,
    /// Draw nothing
    #[arg(long)]
    no_plot: bool,
    #[command(flatten)]
    whiteness: WhitenessArgs,
    #[command(flatten)]
    common: Common,
}

/// Options of the whiteness test.
#[derive(Debug, Clone, Args)]
pub(crate) struct WhitenessArgs {
    /// Probability at which white residuals fail
    #[arg(long, value_name = "P", default_value_t = 0.05)]
    level: f64,
    /// Permutations that calibrate the whiteness tests
    #[arg(long, value_name = "N", default_value_t = 999)]
    draws: usize,
    /// Seed of the permutations
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl WhitenessArgs {
    /// The library's options; a level or a count that decides nothing is a usage error.
    pub fn options(&self) -> Result<validate::Options> {
        if !(self.level > 0.0 && self.level < 1.0) || (self.draws as f64) < 1.0 / self.level - 1.0 {
            let found = format!("level {} with {} draws cannot be decided", self.level, self.draws);
            return Err(Error::new(ErrorKind::Usage, "--level, --draws", found)
                .hint("give a level between 0 and 1, and at least 1/level draws"));
        }
        Ok(validate::Options { level: self.level, draws: self.draws, seed: self.seed })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Parameter {
    C1,
    C2,
    TimeConstant,
}

/// Independent variable of a model, as named on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum AgainstName {
    /// Elapsed time since power-on
    Time,
    /// Temperature of the sensor
    Temperature,
}

impl From<AgainstName> for Against {
    fn from(name: AgainstName) -> Self {
        match name {
            AgainstName::Time => Self::Time,
            AgainstName::Temperature => Self::Temperature,
        }
    }
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum WeightingName {
    Uniform,
    #[value(alias = "random-walk")]
    Walk,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum LossName {
    Squares,
    Huber,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum SchemeName {
    Exact,
    #[value(alias = "backward_euler", alias = "5j")]
    BackwardEuler,
    #[value(alias = "forward_euler")]
    ForwardEuler,
}

fn parse_fixed(text: &str) -> std::result::Result<(Parameter, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, such as c2=0")?;
    let parameter = match name.trim().to_lowercase().as_str() {
        "c1" | "c1_rad_s" => Parameter::C1,
        "c2" | "c2_rad_s" => Parameter::C2,
        "t" | "time_constant" | "time_constant_s" => Parameter::TimeConstant,
        other => return Err(format!("no parameter {other:?}; there are c1, c2, t")),
    };
    let value: f64 = value.trim().parse().map_err(|_| format!("{value:?} is not a number"))?;
    Ok((parameter, value))
}

pub(crate) fn run(args: &FitArgs) -> Result<Outcome> {
    places::check_logs(&args.logs)?;
    let earth = earth(args)?;
    let log = match &args.logs[..] {
        [one] if !one.is_dir() && !args.many.asked_for() && !args.columns.several_topics() => {
            LogArgs::new(one.clone(), args.memory, columns(args))
        }
        _ => return many::run(args, earth),
    };
    if log.axes().len() > 1 {
        return over_axes(args, &log);
    }
    // every output is claimed before the work begins
    let output = Output::open(&args.common, "fit", plan(args))?;
    let out = args.out.as_ref().map(OutputFile::claim).transpose()?;
    let plots = claim_plots(args)?;
    let options = fit_options(args)?;
    let whiteness = args.whiteness.options()?;
    let base = args.base.as_ref().map(Config::read_base).transpose()?;

    let working = output.working("reading the log");
    let read = log.read(&working)?;
    drop(working);
    let working = output.working("fitting, and testing the residuals");
    let (mut report, picture) = fitted(&log, &read, &options, &whiteness, args.against, !plots.is_empty())?;
    report.earth = earth;
    drop(working);

    output.say(report.text());
    let fit_for_use = report.verdict() == Verdict::FitForUse;
    let export = fit_for_use || args.accept;
    if let Some(file) = out {
        if export {
            write_configuration(file, &report, base.as_ref(), &configuration_options(args), &output)?;
        } else {
            output.say(format!("{} not written; --accept writes it all the same", file.target().display()));
        }
    }
    if let Some(picture) = picture {
        let names: Vec<String> = plots.iter().map(|p| p.target().display().to_string()).collect();
        plots.into_iter().try_for_each(|file| picture.write(file))?;
        output.say(format!("drew {}", names.join(", ")));
    }
    output.finish(&report.json())?;
    Ok(if export { Outcome::Done } else { Outcome::Unfit })
}

/// A section an axis, the log read once for all of them.
fn over_axes(args: &FitArgs, log: &LogArgs) -> Result<Outcome> {
    axes::refuse(&[("--out", args.out.is_some()), ("--plot", !args.plot.is_empty()), ("--base", args.base.is_some())])?;
    let output = Output::open(&args.common, "fit", plan(args))?;
    let (options, whiteness) = (fit_options(args)?, args.whiteness.options()?);
    axes::each(log, output, "fitting, and testing the residuals", |read| {
        let (report, _) = fitted(log, read, &options, &whiteness, args.against, false)?;
        let fit = report.verdict() == Verdict::FitForUse || args.accept;
        Ok(Section { text: report.text(), json: report.json(), fit })
    })
}

/// The fit with its validation, and its picture where it is `drawn`.
fn fitted(
    log: &LogArgs,
    read: &LogRead,
    options: &FitOptions,
    whiteness: &validate::Options,
    against: AgainstName,
    drawn: bool,
) -> Result<(FitReport, Option<Picture>)> {
    let named = |e| log.named(e);
    let finished = |facts: LogFacts, fit: Fit, temperature: Option<TemperatureFit>, validation: Validation| FitReport {
        temperature,
        against: against.into(),
        ..FitReport::new(facts, fit, validation)
    };
    match read {
        LogRead::Whole(recording, time) => {
            let rate = recording.log.require(names::GYRO_Z)?;
            let fit = identify::fit(time, rate, options).map_err(named)?;
            let mut facts = log.facts(recording);
            let beside = recording.log.get(names::TEMPERATURE);
            let by_temperature = beside.map(|t| identify::fit_temperature(time, rate, t));
            let by_temperature = held_against(log, &mut facts, &fit, by_temperature, against)?;
            let thermal = by_temperature.as_ref().filter(|_| against == AgainstName::Temperature);
            let (residuals, directions) = match thermal.zip(beside) {
                Some((thermal, temperature)) => {
                    let temperature = bridged(names::TEMPERATURE, time, temperature).map_err(named)?;
                    let model = thermal.model();
                    let left = rate.iter().zip(&temperature).map(|(y, t)| y - model.error_rad_s(*t)).collect();
                    let directions = thermal.directions();
                    (left, directions.iter().map(|f| temperature.iter().map(|t| f(*t)).collect()).collect())
                }
                None => (fit.residuals(time, rate), fit.jacobian(time)),
            };
            let validation = validate::whiteness(time, &fit.without_colour(residuals.clone()), &directions, whiteness);
            let report = finished(facts, fit, by_temperature, validation);
            let picture = drawn.then(|| fit_picture(&report, time, rate, &residuals)).transpose()?;
            Ok((report, picture))
        }
        LogRead::Streamed(recording) => {
            let reduced = &recording.log;
            let fit = identify::fit_reduced(reduced, options).map_err(named)?;
            let mut facts = log.facts_streamed(recording);
            let beside = reduced.coarse.temperature_c.as_ref();
            let by_temperature = beside.map(|_| identify::fit_temperature_reduced(reduced));
            let by_temperature = held_against(log, &mut facts, &fit, by_temperature, against)?;
            let thermal = by_temperature.as_ref().filter(|_| against == AgainstName::Temperature);
            let course = match thermal {
                Some(_) => Course::of_temperature(reduced).map_err(named)?,
                None => None,
            };
            let (error, directions): (Function, Vec<Function>) = match thermal.zip(course.as_ref()) {
                Some((thermal, course)) => {
                    let model = thermal.model();
                    let fitted = thermal.directions().len();
                    let along = |j| Box::new(move |t_s| model.gradient(course.at(t_s))[j]) as Function;
                    (Box::new(move |t_s| model.error_rad_s(course.at(t_s))), (0..fitted).map(along).collect())
                }
                None => {
                    let model = fit.model();
                    let directions = fit.directions().into_iter().map(|f| Box::new(f) as Function);
                    (Box::new(move |t_s| model.error_rad_s(t_s)), directions.collect())
                }
            };
            let residuals = Residuals::of(reduced, &*error);
            let directions: Vec<&dyn Fn(f64) -> f64> = directions.iter().map(|f| &**f).collect();
            let validation = validate::whiteness_reduced(&residuals, &directions, whiteness);
            let report = finished(facts, fit, by_temperature, validation);
            let draw = || {
                let (times, left) = residuals.coarse();
                let rate: Vec<f64> = times.iter().zip(&left).map(|(t, r)| r + error(*t)).collect();
                fit_picture(&report, &TimeAxis::Explicit(times), &rate, &left)
            };
            let picture = drawn.then(draw).transpose()?;
            Ok((report, picture))
        }
    }
}

/// A function of time, s.
type Function<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

/// The fit against temperature. One that fails is told in the notes, unless the model is to be of it.
fn held_against(
    log: &LogArgs,
    facts: &mut LogFacts,
    fit: &Fit,
    by_temperature: Option<Result<TemperatureFit>>,
    against: AgainstName,
) -> Result<Option<TemperatureFit>> {
    let wanted = against == AgainstName::Temperature;
    if wanted && fit.loss != Loss::Squares {
        return Err(Error::new(ErrorKind::Usage, "--loss", "the fit against temperature knows squares alone")
            .hint("leave out --loss, or --against temperature"));
    }
    match by_temperature {
        None if wanted => Err(log.no_temperature("fit with --against time")),
        Some(Err(e)) if wanted => Err(log.named(e)),
        Some(Err(e)) => {
            let place = e.place.map(|p| format!("{p}: ")).unwrap_or_default();
            facts.notes.push(format!("not held against temperature: {place}{}", e.found));
            Ok(None)
        }
        other => other.transpose(),
    }
}

fn configuration_options(args: &FitArgs) -> ConfigurationOptions {
    ConfigurationOptions {
        scheme: match args.scheme {
            SchemeName::Exact => Scheme::Exact,
            SchemeName::BackwardEuler => Scheme::BackwardEuler,
            SchemeName::ForwardEuler => Scheme::ForwardEuler,
        },
        sample_time_s: args.sample_time,
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
    }
}

/// The Earth's rotation at `--latitude`; `None` without it. An axis other than the vertical one is refused: its share
/// depends on the heading.
fn earth(args: &FitArgs) -> Result<Option<EarthRate>> {
    let Some(latitude_deg) = args.latitude else { return Ok(None) };
    if let Some(lying) = args.many.axes_or(args.columns.axes()).iter().find(|a| a.axis != Axis::Z) {
        let found = format!(
            "axis {lying} lies down in a robot on level ground: what it measures of the Earth depends on its heading"
        );
        return Err(Error::new(ErrorKind::Usage, "--latitude", found).hint(
            "fit the vertical axis; if the sensor is turned, say how with --mounting, and --axis z is the robot's",
        ));
    }
    EarthRate::at(latitude_deg).map(Some)
}

/// How the columns are read; a vertical axis is held against gravity.
fn columns(args: &FitArgs) -> ColumnArgs {
    let columns = args.columns.clone();
    if args.latitude.is_some() { columns.upright() } else { columns }
}

fn fit_options(args: &FitArgs) -> Result<FitOptions> {
    let mut fixed = Fixed::default();
    for (parameter, value) in &args.fix {
        let slot = match parameter {
            Parameter::C1 => &mut fixed.c1_rad_s,
            Parameter::C2 => &mut fixed.c2_rad_s,
            Parameter::TimeConstant => &mut fixed.time_constant_s,
        };
        if slot.replace(*value).is_some() {
            return Err(Error::new(ErrorKind::Usage, "--fix", format!("{parameter:?} is given twice")));
        }
    }
    let loss = match args.loss {
        LossName::Squares => Loss::Squares,
        LossName::Huber => Loss::Huber,
    };
    let weighting = match args.weighting {
        WeightingName::Uniform => Weighting::Uniform,
        WeightingName::Walk => Weighting::Walk,
    };
    Ok(FitOptions { fixed, loss, weighting })
}

/// Files that the command reads and writes.
fn plan(args: &FitArgs) -> Plan {
    let plan = Plan::new().reads(&args.logs).reads(&args.base).writes("--out", &args.out);
    args.many.planned(plan.writes("--plot", plots(args)))
}

/// The plots that were asked for, or both kinds beside the configuration.
fn plots(args: &FitArgs) -> Vec<PathBuf> {
    let beside = |out: &Path| ["png", "svg"].map(|e| out.with_extension(e)).to_vec();
    match (&args.out, args.no_plot, args.plot.is_empty()) {
        (_, true, _) => Vec::new(),
        (_, _, false) => args.plot.clone(),
        (Some(out), _, _) => beside(out),
        _ => Vec::new(),
    }
}

fn claim_plots(args: &FitArgs) -> Result<Vec<OutputFile>> {
    plots(args).iter().map(|path| Format::of(path).and_then(|_| OutputFile::claim(path))).collect()
}

fn write_configuration(
    mut file: OutputFile,
    report: &FitReport,
    base: Option<&Config>,
    options: &ConfigurationOptions,
    output: &Output,
) -> Result<()> {
    let target = file.target().display().to_string();
    let config = configuration(report, base, options)?;
    file.write_all(config.to_toml().map_err(|e| e.named(&target))?.as_bytes())?;
    file.commit()?;
    let accepted = if report.verdict() == Verdict::FitForUse { "" } else { " although it is not fit for use" };
    output.say(format!(
        "wrote {target}{accepted}: {} discretisation at {} s",
        options.scheme,
        config.sample_time_s.unwrap_or(f64::NAN)
    ));
    Ok(())
}
