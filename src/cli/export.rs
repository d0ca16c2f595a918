//! `gyroid export`: a configuration as the file of another program.

use super::outcome::Outcome;
use super::output::{Common, Output, command_line};
use clap::Args;
use clap::builder::PossibleValuesParser;
use gyroid::config::Config;
use gyroid::export::{self, Export, Options, Origin, Source, Target};
use gyroid::files::{OutputFile, Plan};
use gyroid::ingest::Axis;
use gyroid::{Error, ErrorKind, Result};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes the file of another program: Kalibr, OpenVINS, ORB-SLAM3, PX4, Gazebo, MATLAB and others (see --list).
///
/// Each number stands with its unit, meaning and interval; what the configuration does not support is left out, and the file
/// says why. Exit code 3: the model failed its validation; nothing is then written unless --accept says so.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// Configuration to export
    #[arg(required_unless_present = "list")]
    config: Option<PathBuf>,
    /// Program to export to
    #[arg(
        long,
        value_name = "TARGET",
        ignore_case = true,
        value_parser = PossibleValuesParser::new(export::registry().iter().map(|t| t.about().id)),
        required_unless_present = "list"
    )]
    to: Option<String>,
    /// Explain the targets (or that of --to): program, file, keys and their units, what each needs
    #[arg(long)]
    list: bool,
    /// Write the file here [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Export also a model that failed its validation
    #[arg(long)]
    accept: bool,
    /// Axis of the target's IMU that was fitted [default: what the column's name says, else z]
    #[arg(long, value_name = "AXIS", value_parser = axis)]
    axis: Option<Axis>,
    /// Rate at which the target reads the gyro, in Hz [default: the configuration's]
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Step of the target's filter in s [default: PX4's 0.01, ArduPilot's 0.012]
    #[arg(long, value_name = "S")]
    step: Option<f64>,
    /// Topic of the IMU [default: /imu/data]
    #[arg(long, value_name = "NAME")]
    topic: Option<String>,
    /// PX4's device id of the gyro, for its thermal compensation
    #[arg(long, value_name = "ID")]
    device_id: Option<u32>,
    /// Temperature at power-on in °C, where thermal polynomials begin [default: the log's lowest]
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    power_on_temperature: Option<f64>,
    #[command(flatten)]
    common: Common,
}

fn axis(text: &str) -> std::result::Result<Axis, String> {
    Axis::parse(text).ok_or_else(|| format!("{text:?} is no axis; there are x, y, z"))
}

pub(crate) fn run(args: &ExportArgs) -> Result<Outcome> {
    let target = args.to.as_deref().and_then(|id| export::by_id(&id.to_lowercase()));
    let plan = Plan::new().reads(&args.config).writes("--out", &args.out);
    let output = Output::open(&args.common, "export", plan)?;
    if args.list {
        return list(target, output);
    }
    let (Some(path), Some(target)) = (&args.config, target) else {
        return Err(Error::new(ErrorKind::Usage, "gyroid export", "a configuration and --to are needed"));
    };
    let out = args.out.as_ref().map(OutputFile::claim).transpose()?;
    let (config, by_time) = Config::read(path)?.by_elapsed_time();
    let origin = Origin {
        file: path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned()),
        sha256: gyroid::files::sha256(path)?,
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
    };
    let options = options(args);
    let source = Source::new(&config, &origin, &options).map_err(|e| named(e, path))?;
    let configuration = json!({ "file": origin.file, "sha256": origin.sha256, "signed": config.is_signed() });
    if let Some(why) = source.failed().filter(|_| !args.accept) {
        output.say(format!("not fit for use: {why}\nnothing exported; --accept exports it all the same"));
        let about = target.about().id;
        output.finish(&json!({ "target": about, "configuration": configuration, "written": false, "why": why }))?;
        return Ok(Outcome::Unfit);
    }
    let done = export::export(target, &source).map_err(|e| named(e, path))?;
    let mut json = done.json();
    json["configuration"] = configuration;
    json["written"] = Value::Bool(true);
    match out {
        Some(mut file) => {
            let name = file.target().display().to_string();
            file.write_all(done.text.as_bytes())?;
            file.commit()?;
            output.say(summary(&done, target, &name));
            by_time.into_iter().for_each(|note| output.say(format!("note: {note}")));
        }
        // the file is the product: it gives way to JSON alone
        None if args.common.json.as_ref().is_some_and(|j| j.as_os_str() == "-") => {}
        None => {
            let _ = std::io::stdout().lock().write_all(done.text.as_bytes());
        }
    }
    output.finish(&json)?;
    Ok(Outcome::Done)
}

fn list(target: Option<&'static dyn Target>, output: Output) -> Result<Outcome> {
    let all: Vec<&'static dyn Target> = target.map_or_else(|| export::registry().to_vec(), |t| vec![t]);
    let texts: Vec<String> = all.iter().map(|t| t.about().text()).collect();
    output.say(texts.join("\n").trim_end());
    output.finish(&json!({ "targets": all.iter().map(|t| t.about().json()).collect::<Vec<_>>() }))?;
    Ok(Outcome::Done)
}

fn options(args: &ExportArgs) -> Options {
    Options {
        axis: args.axis,
        rate_hz: args.rate,
        step_s: args.step,
        topic: args.topic.clone(),
        device_id: args.device_id,
        power_on_temperature_c: args.power_on_temperature,
        accept: args.accept,
    }
}

/// Errors of the library name the configuration; those of an option name the option.
fn named(error: Error, path: &Path) -> Error {
    if error.kind == ErrorKind::Usage { error } else { error.named(path.display()) }
}

fn summary(done: &Export, target: &dyn Target, name: &str) -> String {
    let mut out = format!("wrote {name} for {}", target.about().program);
    for w in &done.written {
        let digits: Vec<String> = w.values.iter().map(|v| export::digits(*v)).collect();
        let unit = if w.unit.is_empty() { String::new() } else { format!(" [{}]", w.unit) };
        out += &format!("\n  {} = {}{unit}: {}", w.key, digits.join(", "), w.meaning);
    }
    for l in &done.left_out {
        out += &format!("\n  {} left out: {}\n    hint: {}", l.key, l.why, l.hint);
    }
    out
}
