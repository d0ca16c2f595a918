//! `gyroid validate`: does a fitted model explain another log?

use super::axes::{self, Section};
use super::fit::{AgainstName, WhitenessArgs};
use super::html::{self, HtmlArgs};
use super::log_args::{LogArgs, LogRead};
use super::outcome::Outcome;
use super::output::{Common, Output};
use super::places;
use clap::Args;
use gyroid::bias::Against;
use gyroid::config::{Config, Gyro, Noise};
use gyroid::files::Plan;
use gyroid::report::ModelCheck;
use gyroid::report::html::{Origin, validate_page};
use gyroid::signal::{Course, TimeAxis, bridged, names};
use gyroid::validate::{self, Residuals};
use gyroid::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// Tests the residuals of another log at rest under a fitted model: its offset, and whether they are white.
///
/// Exit code 3: the model does not explain the log.
#[derive(Debug, Args)]
pub(crate) struct ValidateArgs {
    /// Configuration with the model
    config: PathBuf,
    #[command(flatten)]
    log: LogArgs,
    /// Which model of the configuration is tested [default: that by temperature where there is a table [gyro.temperature]]
    #[arg(long, value_enum)]
    against: Option<AgainstName>,
    #[command(flatten)]
    whiteness: WhitenessArgs,
    #[command(flatten)]
    page: HtmlArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &ValidateArgs) -> Result<Outcome> {
    places::check("validate", &args.config, "", [args.log.path()])?;
    let plan = args.page.planned(Plan::new().reads([args.config.as_path(), args.log.path()]));
    let output = Output::open(&args.common, "validate", plan)?;
    let page = args.page.claim()?;
    let options = args.whiteness.options()?;
    let config = Config::read(&args.config)?;
    let against = against(args, &config)?;
    let origin = page.as_ref().map(|_| html::origin([args.config.as_path(), args.log.path()])).transpose()?;
    let check = |read: &LogRead| held(args, &config, against, read, &options, origin.as_ref());
    if args.log.axes().len() > 1 {
        axes::refuse(&[("--html", args.page.wanted())])?;
        return axes::each(&args.log, output, "testing the residuals", |read| {
            let (check, _) = check(read)?;
            Ok(Section { text: check.text(), json: check.json(), fit: check.passed() })
        });
    }
    let working = output.working("reading the log");
    let log = args.log.read(&working)?;
    working.show("testing the residuals");
    let (check, written) = check(&log)?;
    drop(working);
    output.say(check.text());
    if let Some((file, written)) = page.zip(written) {
        html::write(file, &written, &output)?;
    }
    let passed = check.passed();
    output.finish(&check.json())?;
    Ok(if passed { Outcome::Done } else { Outcome::Unfit })
}

/// The model of the configuration that is tested: the one that was asked for, else that by temperature where there is
/// one.
fn against(args: &ValidateArgs, config: &Config) -> Result<Against> {
    let there = config.require_gyro()?.temperature.is_some();
    match args.against {
        Some(AgainstName::Temperature) if !there => {
            Err(Error::new(ErrorKind::Config, args.config.display(), "the table [gyro.temperature] is missing")
                .hint("write it with gyroid fit --against temperature, or leave out --against temperature"))
        }
        Some(name) => Ok(name.into()),
        None if there => Ok(Against::Temperature),
        None => Ok(Against::Time),
    }
}

/// Residuals without the low-pass and the bands that the configuration states.
fn without_colour(gyro: &Gyro, time: &TimeAxis, residuals: &[f64]) -> Vec<f64> {
    let mut left = residuals.to_vec();
    if let Some(colour) = gyro.noise.as_ref().map(Noise::colour).filter(|colour| !colour.is_white()) {
        let step_s = time.median_step_s();
        colour.take_out(gyro.angle_random_walk_rad_sqrt_s / step_s.sqrt(), step_s, &mut left);
    }
    left
}

/// Tests the configuration's model against a log. Nothing was fitted to this log. Its mean residual is the turn-on
/// bias, which is judged separately. With `origin` also as a page.
fn held(
    args: &ValidateArgs,
    config: &Config,
    against: Against,
    log: &LogRead,
    options: &validate::Options,
    origin: Option<&Origin>,
) -> Result<(ModelCheck, Option<String>)> {
    let gyro = config.require_gyro()?;
    let model = gyro.warm_up();
    let thermal = gyro.temperature.filter(|_| against == Against::Temperature).map(|t| t.thermal());
    let missing = || args.log.no_temperature("test the warm-up by elapsed time of the same file with --against time");
    let named = |e| args.log.named(e);
    let shown = |check: ModelCheck, time: &TimeAxis, rate: &[f64], residuals: &[f64]| {
        let page = origin.map(|origin| validate_page(&check, time, rate, residuals, origin)).transpose()?;
        Ok((check, page))
    };
    match log {
        LogRead::Whole(recording, time) => {
            let rate = recording.log.require(names::GYRO_Z)?;
            let facts = args.log.facts(recording);
            let test = |residuals: &[f64]| {
                let constant = vec![1.0; residuals.len()];
                validate::whiteness(time, &without_colour(gyro, time, residuals), &[constant], options)
            };
            let Some(thermal) = thermal else {
                let residuals: Vec<f64> =
                    rate.iter().enumerate().map(|(i, y)| y - model.error_rad_s(time.at(i))).collect();
                let check = ModelCheck::new(facts, config, time, &residuals, test(&residuals))?;
                return shown(check, time, rate, &residuals);
            };
            let temperature = recording.log.get(names::TEMPERATURE).ok_or_else(missing)?;
            let temperature = bridged(names::TEMPERATURE, time, temperature).map_err(named)?;
            let residuals: Vec<f64> = rate.iter().zip(&temperature).map(|(y, t)| y - thermal.error_rad_s(*t)).collect();
            let check = ModelCheck::by_temperature(facts, config, time, &temperature, &residuals, test(&residuals))?;
            shown(check, time, rate, &residuals)
        }
        LogRead::Streamed(recording) => {
            let facts = args.log.facts_streamed(recording);
            let coarse = |check: ModelCheck, residuals: &Residuals, error: &dyn Fn(f64) -> f64| {
                let (times, left) = residuals.coarse();
                let rate: Vec<f64> = times.iter().zip(&left).map(|(t, r)| r + error(*t)).collect();
                shown(check, &TimeAxis::Explicit(times), &rate, &left)
            };
            let test = |residuals: &Residuals| validate::whiteness_reduced(residuals, &[&|_: f64| 1.0], options);
            let Some(thermal) = thermal else {
                let residuals = Residuals::new(&recording.log, &model);
                let validation = test(&residuals);
                let check = ModelCheck::of_reduced(facts, config, &recording.log, &residuals, validation)?;
                return coarse(check, &residuals, &|t_s| model.error_rad_s(t_s));
            };
            let course = Course::of_temperature(&recording.log).map_err(named)?.ok_or_else(missing)?;
            let error = |t_s: f64| thermal.error_rad_s(course.at(t_s));
            let residuals = Residuals::of(&recording.log, &error);
            let validation = test(&residuals);
            let log = &recording.log;
            let check = ModelCheck::of_reduced_by_temperature(facts, config, log, &course, &residuals, validation)?;
            coarse(check, &residuals, &error)
        }
    }
}
