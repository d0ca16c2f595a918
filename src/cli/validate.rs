//! `gyroid validate`: does a fitted model explain another log?

use super::Outcome;
use super::fit::WhitenessArgs;
use super::log_args::{LogArgs, LogRead};
use super::output::{Common, Output};
use clap::Args;
use gyroid::Result;
use gyroid::config::Config;
use gyroid::report::ModelCheck;
use gyroid::signal::names;
use gyroid::validate::{self, Residuals};
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
    #[command(flatten)]
    whiteness: WhitenessArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &ValidateArgs) -> Result<Outcome> {
    let output = Output::open(&args.common)?;
    let options = args.whiteness.options()?;
    let config = Config::read(&args.config)?;
    let gyro = config.require_gyro()?;
    let working = output.working("reading the log");
    let log = args.log.read(&working)?;
    working.show("testing the residuals");
    let model = gyro.warm_up();
    // nothing was fitted to this log; its mean is the turn-on bias, which is judged by itself
    let check = match &log {
        LogRead::Whole(recording, time) => {
            let rate = recording.log.require(names::GYRO_Z)?;
            let residuals: Vec<f64> = rate.iter().enumerate().map(|(i, y)| y - model.error_rad_s(time.at(i))).collect();
            let validation = validate::whiteness(time, &residuals, &[vec![1.0; residuals.len()]], &options);
            ModelCheck::new(args.log.facts(recording), &config, time, &residuals, validation)?
        }
        LogRead::Streamed(recording) => {
            let residuals = Residuals::new(&recording.log, &model);
            let validation = validate::whiteness_reduced(&residuals, &[&|_: f64| 1.0], &options);
            let facts = args.log.facts_streamed(recording);
            ModelCheck::of_reduced(facts, &config, &recording.log, &residuals, validation)?
        }
    };
    drop(working);
    output.say(check.text());
    let passed = check.passed();
    output.finish(&check.json())?;
    Ok(if passed { Outcome::Done } else { Outcome::Unfit })
}
