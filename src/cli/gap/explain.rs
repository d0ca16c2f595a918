//! `gyroid gap explain`: just these effects, with an interval for each parameter.

use super::diagnose::{at_rest, name, read};
use crate::cli::Outcome;
use crate::cli::log_args::ColumnArgs;
use crate::cli::output::{Common, Output};
use clap::Args;
use gyroid::effects::Library;
use gyroid::gap::explain;
use gyroid::{Error, Result};
use std::path::PathBuf;

/// Fit just these effects to a recording at rest: parameters with 95 % intervals
///
/// Whether they are at work is not asked: `gyroid gap diagnose` does that.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  gyroid gap explain sim.toml --fit fit.csv --effect gyro.tone gyro.rate_random_walk"
)]
pub(crate) struct ExplainArgs {
    /// The nominal simulator: a configuration with [gyro]
    config: PathBuf,
    /// Recording at rest, in any format that `gyroid inspect` reads
    #[arg(long, value_name = "LOG")]
    fit: PathBuf,
    /// The effects, by id
    #[arg(long, value_name = "ID", num_args = 1.., required = true)]
    effect: Vec<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &ExplainArgs) -> Result<Outcome> {
    let output = Output::open(&args.common)?;
    let (config, by_time) = at_rest(&args.config)?.by_elapsed_time();
    let working = output.working("reading");
    let log = read(&args.columns, &args.fit)?;
    working.show("fitting");
    let ids: Vec<&str> = args.effect.iter().map(String::as_str).collect();
    let named = |e: Error| match e.input.as_str() {
        "configuration" => e.named(args.config.display()),
        "effects" => e.named("--effect"),
        _ => e,
    };
    let found = explain(&config, &log, &Library::new(), &ids, 0.0).map_err(named)?;
    drop(working);
    let mut text = format!("{}: {} fitted together\n", name(&args.fit), ids.join(", "));
    for effect in &found.effects {
        text += &format!("\n{} (gains {:.1} nats)\n", effect.id, effect.gain_nats);
        for (name, e) in &effect.parameters {
            let [low, high] = e.ci95;
            text += &format!("  {name:<32} {:>13.6e} ± {:.1e}   95 %: {low:.6e} to {high:.6e}\n", e.estimate, e.std);
        }
        if let Some([from, to]) = effect.time_s {
            text += &format!("  from {from:.1} to {to:.1} s\n");
        }
    }
    for note in found.notes.iter().chain(&by_time) {
        text += &format!("\n{note}");
    }
    output.say(text.trim_end());
    output.finish(&serde_json::json!(found))?;
    Ok(Outcome::Done)
}
