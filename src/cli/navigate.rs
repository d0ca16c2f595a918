//! `gyroid navigate`: the bundled filter over a recorded drive.

use super::Outcome;
use super::output::{Common, Output};
use clap::Args;
use gyroid::config::Config;
use gyroid::ingest::{LogWriter, read_log};
use gyroid::navigate::{ErrorModel, Reckoning, ReferenceErrors, Settings, Summary, dead_reckoning, run as filter};
use gyroid::units::{RAD_S_PER_DEG_S, duration_text};
use gyroid::{Error, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// Run the navigation filter over a drive, and compare it with the filter without error model and with encoders alone
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    gyroid navigate gyroid.toml drive.parquet -o pose.parquet\n  \
    gyroid navigate gyroid.toml drive.parquet --json -"
)]
pub(crate) struct NavigateArgs {
    /// Configuration (schema 1) with [gyro], [vehicle] and [encoder]
    config: PathBuf,
    /// Recorded drive
    log: PathBuf,
    /// Write the estimated pose to this log (.csv or .parquet)
    #[arg(short, long, value_name = "LOG")]
    out: Option<PathBuf>,
    /// Write the pose of the filter that takes the gyro for free of error
    #[arg(long)]
    no_error_model: bool,
    /// Use the log's reference pose as a measurement (else it is only compared with)
    #[arg(long)]
    use_pose: bool,
    /// Start at the reference's first pose instead of x = y = heading = 0
    #[arg(long)]
    start_at_reference: bool,
    /// Time since power-on at the first row, s, where the log does not say
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    start_offset: f64,
    /// Leave out readings beyond this quantile of chi-squared (such as 0.9999) [default: use all]
    #[arg(long, value_name = "P")]
    gate: Option<f64>,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(args: &NavigateArgs) -> Result<Outcome> {
    let output = Output::open(&args.common)?;
    let out = args.out.as_ref().map(LogWriter::claim).transpose()?;
    let name = args.config.display().to_string();
    let named = |error: Error| if error.input == "configuration" { error.named(&name) } else { error };
    let config = Config::read(&args.config)?;
    let log = read_log(&args.log)?;
    let settings = |error_model| Settings {
        error_model,
        use_pose: args.use_pose,
        start_at_reference: args.start_at_reference,
        gate_probability: args.gate,
        since_power_on_s: args.start_offset,
        acceleration_densities: None,
    };
    let with = filter(&config, &log, &settings(ErrorModel::WarmUp)).map_err(named)?;
    let without = filter(&config, &log, &settings(ErrorModel::Off)).map_err(named)?;
    let encoders = dead_reckoning(&config, &log, &settings(ErrorModel::Off)).map_err(named)?;
    if let Some(out) = out {
        out.write(if args.no_error_model { &without.pose } else { &with.pose })?;
    }
    if output.talks() {
        output.say(text(args, &config, &with.summary, &without.summary, &encoders));
    }
    output.finish(&serde_json::json!({
        "with_error_model": with.summary,
        "without_error_model": without.summary,
        "dead_reckoning": { "reference": encoders.reference },
    }))?;
    Ok(Outcome::Done)
}

fn text(args: &NavigateArgs, config: &Config, with: &Summary, without: &Summary, encoders: &Reckoning) -> String {
    let mut t = String::new();
    let from = if with.torques_used { "torques, gyro and encoders" } else { "gyro and encoders (no torques)" };
    let _ = writeln!(
        t,
        "{}: {} rows, {}, from {:.1} s after power-on; {from}\n",
        args.log.display(),
        with.rows,
        duration_text(with.span_s),
        with.since_power_on_s,
    );
    let _ = writeln!(
        t,
        "{:<22}{:>13}{:>13}{:>13}{:>13}   NIS (95 % bounds), innovations",
        "", "heading rms", "at the end", "position rms", "at the end"
    );
    for (name, reference, summary) in [
        ("with error model", &with.reference, Some(with)),
        ("without error model", &without.reference, Some(without)),
        ("encoders alone", &encoders.reference, None),
    ] {
        let _ = writeln!(t, "{name:<22}{}   {}", errors(reference.as_ref()), summary.map_or(String::new(), nis));
    }
    let pose = &with.final_pose;
    let deg = RAD_S_PER_DEG_S;
    let _ = write!(
        t,
        "\nat the end, with error model: x {:.3} ± {:.3} m, y {:.3} ± {:.3} m, heading {:.2} ± {:.2}°, gyro error \
         {:.5} ± {:.5} °/s",
        pose.x_m.estimate,
        pose.x_m.std,
        pose.y_m.estimate,
        pose.y_m.std,
        pose.heading_rad.estimate / deg,
        pose.heading_rad.std / deg,
        pose.gyro_error_rad_s.estimate / deg,
        pose.gyro_error_rad_s.std / deg,
    );
    if with.reference.is_none() {
        let _ = write!(t, "\nno reference pose in the log: errors are not known");
    }
    if !config.is_signed() {
        let _ = write!(t, "\nnote: {} is unsigned (written by hand)", args.config.display());
    }
    for note in &with.notes {
        let _ = write!(t, "\nnote: {note}");
    }
    t
}

fn errors(reference: Option<&ReferenceErrors>) -> String {
    let Some(r) = reference else { return format!("{:>13}{:>13}{:>13}{:>13}", "-", "-", "-", "-") };
    format!(
        "{:>11.2} °{:>11.2} °{:>11.3} m{:>11.3} m",
        r.heading_rms_rad / RAD_S_PER_DEG_S,
        r.heading_end_rad.abs() / RAD_S_PER_DEG_S,
        r.position_rms_m,
        r.position_end_m
    )
}

fn nis(summary: &Summary) -> String {
    let c = &summary.consistency;
    let [low, high] = c.nis_mean_bounds95;
    let failed: Vec<_> = [(c.nis_holds, "NIS outside"), (c.unbiased, "biased"), (c.white, "not white")]
        .iter()
        .filter(|(holds, _)| !holds)
        .map(|(_, word)| *word)
        .collect();
    let verdict = if failed.is_empty() { "consistent".into() } else { failed.join(", ") };
    format!("{:.3} ({low:.3} .. {high:.3}) {verdict}", c.nis_mean)
}
