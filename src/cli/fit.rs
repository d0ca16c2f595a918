//! `gyroid fit`: the warm-up model of a log at rest, or of many.

mod args;
mod many;

pub(super) use args::{AgainstName, FitArgs, WhitenessArgs};
pub(super) use many::{concluded, judged};

use super::axes::{self, Section};
use super::html;
use super::log_args::{LogArgs, LogRead};
use super::outcome::Outcome;
use super::output::Output;
use super::places;
use args::{LossName, columns, configuration_options, fit_options, plan, plots};
use gyroid::bias::EarthRate;
use gyroid::config::Config;
use gyroid::export::{ConfigurationOptions, configuration};
use gyroid::files::OutputFile;
use gyroid::identify::{self, Fit, FitOptions, Loss, TemperatureFit};
use gyroid::ingest::Axis;
use gyroid::report::html::{Origin, fit_page};
use gyroid::report::plot::{Format, Picture};
use gyroid::report::{FitReport, LogFacts, Verdict, fit_picture};
use gyroid::signal::{Course, TimeAxis, bridged, names};
use gyroid::validate::{Residuals, Validation};
use gyroid::{Error, ErrorKind, Result, validate};

pub(crate) fn run(args: &FitArgs) -> Result<Outcome> {
    places::check_logs(&args.logs)?;
    let earth = earth(args)?;
    let log = match &args.logs[..] {
        [one] if !one.is_dir() && !args.asks_for_many() && !args.columns.several_topics() => {
            LogArgs::new(one.clone(), args.memory, columns(args)).held(args.loss != LossName::Squares)
        }
        _ => return many::run(&args.of_a_part(), earth),
    };
    if log.axes().len() > 1 {
        return over_axes(args, &log);
    }
    // every output is claimed before the work begins
    let output = Output::open(&args.common, "fit", plan(args))?;
    let out = args.out.as_ref().map(OutputFile::claim).transpose()?;
    let plots = claim_plots(args)?;
    let page = args.page.claim()?;
    let origin = page.as_ref().map(|_| html::origin(args.logs.iter().chain(&args.base))).transpose()?;
    let options = fit_options(args)?;
    let whiteness = args.whiteness.options()?;
    let base = args.base.as_ref().map(Config::read_base).transpose()?;

    let working = output.working("reading the log");
    let read = log.read(&working)?;
    drop(working);
    let working = output.working("fitting, and testing the residuals");
    let show = Show { earth, picture: !plots.is_empty(), page: origin.as_ref() };
    let Fitted { report, picture, page: written } = fitted(&log, &read, &options, &whiteness, args.against, &show)?;
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
    if let Some((file, page)) = page.zip(written) {
        html::write(file, &page, &output)?;
    }
    output.finish(&report.json())?;
    Ok(if export { Outcome::Done } else { Outcome::Unfit })
}

/// A section an axis, the log read once for all of them.
fn over_axes(args: &FitArgs, log: &LogArgs) -> Result<Outcome> {
    axes::refuse(&[
        ("--out", args.out.is_some()),
        ("--plot", !args.plot.is_empty()),
        ("--base", args.base.is_some()),
        ("--html", args.page.wanted()),
    ])?;
    let output = Output::open(&args.common, "fit", plan(args))?;
    let (options, whiteness) = (fit_options(args)?, args.whiteness.options()?);
    axes::each(log, output, "fitting, and testing the residuals", |read| {
        let report = fitted(log, read, &options, &whiteness, args.against, &Show::default())?.report;
        let fit = report.verdict() == Verdict::FitForUse || args.accept;
        Ok(Section { text: report.text(), json: report.json(), fit })
    })
}

/// Outputs of a fit beside its report.
#[derive(Default)]
struct Show<'a> {
    earth: Option<EarthRate>,
    picture: bool,
    page: Option<&'a Origin>,
}

struct Fitted {
    report: FitReport,
    picture: Option<Picture>,
    page: Option<String>,
}

impl Fitted {
    fn new(report: FitReport, time: &TimeAxis, rate: &[f64], residuals: &[f64], show: &Show) -> Result<Self> {
        let picture = show.picture.then(|| fit_picture(&report, time, rate, residuals)).transpose()?;
        let page = show.page.map(|origin| fit_page(&report, time, rate, residuals, origin)).transpose()?;
        Ok(Self { report, picture, page })
    }
}

/// The fit with its validation, and what is to be shown of it.
fn fitted(
    log: &LogArgs,
    read: &LogRead,
    options: &FitOptions,
    whiteness: &validate::Options,
    against: AgainstName,
    show: &Show,
) -> Result<Fitted> {
    let named = |e| log.named(e);
    let finished = |facts: LogFacts, fit: Fit, temperature: Option<TemperatureFit>, validation: Validation| FitReport {
        temperature,
        against: against.into(),
        earth: show.earth,
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
            Fitted::new(report, time, rate, &residuals, show)
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
            let directions: Vec<&(dyn Fn(f64) -> f64 + Sync)> = directions.iter().map(|f| &**f).collect();
            let validation = validate::whiteness_reduced(&residuals, &directions, whiteness);
            let report = finished(facts, fit, by_temperature, validation);
            if !show.picture && show.page.is_none() {
                return Ok(Fitted { report, picture: None, page: None });
            }
            let (times, left) = residuals.coarse();
            let rate: Vec<f64> = times.iter().zip(&left).map(|(t, r)| r + error(*t)).collect();
            Fitted::new(report, &TimeAxis::Explicit(times), &rate, &left, show)
        }
    }
}

/// A function of time, s.
type Function<'a> = Box<dyn Fn(f64) -> f64 + Sync + 'a>;

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

/// The Earth's rotation at `--latitude`; `None` without it. An axis other than the vertical one is refused: its share
/// depends on the heading.
fn earth(args: &FitArgs) -> Result<Option<EarthRate>> {
    let Some(latitude_deg) = args.latitude else { return Ok(None) };
    if let Some(lying) = args.axes.or(args.columns.axes()).iter().find(|a| a.axis != Axis::Z) {
        let found = format!(
            "axis {lying} lies down in a robot on level ground: what it measures of the Earth depends on its heading"
        );
        return Err(Error::new(ErrorKind::Usage, "--latitude", found).hint(
            "fit the vertical axis; if the sensor is turned, say how with --mounting, and --axis z is the robot's",
        ));
    }
    EarthRate::at(latitude_deg).map(Some)
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
