//! `gyroid inspect`: a file at a glance.

use super::outcome::Outcome;
use super::output::{Common, Output};
use super::places;
use super::topic_args::TopicArgs;
use clap::Args;
use gyroid::files::Plan;
use gyroid::ingest::{self, AxisReport, Clock, ColumnReport, Inspection, Motion, Sampling, TimeReport, Topic};
use gyroid::units::{RAD_S_PER_DEG_S, RateUnit, duration_text};
use gyroid::{Error, ErrorKind, Result};
use std::fmt::Write;
use std::path::PathBuf;

/// Show what is in a log: topics, columns, rates, gaps, units, rest and motion
#[derive(Debug, Args)]
pub(crate) struct Inspect {
    /// CSV, TSV, JSON lines (also gzipped), Parquet, ROS bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    log: PathBuf,
    #[command(flatten)]
    topics: TopicArgs,
    /// Leave out rows of text that do not parse, count them and tell the first few, instead of refusing the file
    #[arg(long)]
    skip_bad_rows: bool,
    #[command(flatten)]
    common: Common,
}

impl Inspect {
    pub(super) fn run(&self) -> Result<Outcome> {
        places::check_logs([&self.log])?;
        let output = Output::open(&self.common, "inspect", Plan::new().reads([&self.log]))?;
        let working = output.working("reading the log");
        let report = ingest::inspect_topic(&self.log, self.topics.one()?, self.topics.stamp(), self.skip_bad_rows)?;
        drop(working);
        if output.talks() {
            output.say(table(&report).trim_end());
        }
        let mut value = serde_json::to_value(&report)
            .map_err(|e| Error::new(ErrorKind::Numeric, self.log.display(), format!("no JSON of the report: {e}")))?;
        value["fits"] = report.fits().into();
        output.finish(&value)?;
        Ok(Outcome::Done)
    }
}

/// A log that moves more than this is said to move once more in the last line.
const MOSTLY_AT_REST: f64 = 0.02;

/// The text; every line is a finding.
fn table(report: &Inspection) -> String {
    let mut out = String::new();
    let mut line = |text: String| {
        let _ = writeln!(out, "{text}");
    };
    if report.topics.is_empty() {
        line(format!("{}: {}, {} rows, {} columns", report.file, report.format, report.rows, report.columns.len()));
    } else {
        line(format!("{}: {}, {} topics", report.file, report.format, report.topics.len()));
        line(String::new());
        topics(&report.topics, &mut line);
    }
    line(String::new());
    if let Some(topic) = &report.topic {
        line(format!("{topic}: {} messages", report.rows));
    }
    if !report.columns.is_empty() {
        columns(report, &mut line);
        line(String::new());
    }
    if let Some(time) = &report.time {
        clock(time, &mut line);
    }
    for axis in &report.gyro {
        gyro(axis, &mut line);
    }
    for (title, items) in [("problem", &report.problems), ("note", &report.notes)] {
        for item in items {
            line(format!("{title:<9} {item}"));
        }
    }
    line(format!("{:<9} {}", "fit", verdict(report)));
    out
}

fn verdict(report: &Inspection) -> String {
    let (can, cannot): (Vec<_>, Vec<_>) = report.gyro.iter().partition(|a| a.audit.is_some());
    let names = |axes: &[&AxisReport]| axes.iter().map(|a| a.axis.to_string()).collect::<Vec<_>>().join(", ");
    let moving = can.iter().filter_map(|a| a.audit.as_ref()).map(|a| a.motion.samples as f64 / a.samples as f64);
    let most = moving.fold(0.0, f64::max);
    let rest = if most > MOSTLY_AT_REST {
        format!("; it moves for {:.0} % of its samples", 100.0 * most)
    } else {
        String::new()
    };
    match (can.is_empty(), cannot.is_empty()) {
        (true, _) if report.topic.is_none() && report.topics.iter().any(|t| t.gyro) => {
            "can use one of the topics with a gyro: name it with --topic".to_string()
        }
        (true, _) => "cannot use this file as it is".to_string(),
        (false, true) => format!("can use {}{rest}", names(&can)),
        (false, false) => format!("can use {}; not {}{rest}", names(&can), names(&cannot)),
    }
}

fn topics(topics: &[Topic], line: &mut dyn FnMut(String)) {
    let width =
        |of: &dyn Fn(&Topic) -> &str| topics.iter().map(|t| of(t).chars().count()).max().unwrap_or(0).clamp(5, 48);
    let (name, kind) = (width(&|t| &t.name), width(&|t| &t.type_name));
    line(format!("{:<name$}  {:<kind$}  {:>9}  {:>10}  gyro", "topic", "type", "messages", "rate"));
    for t in topics {
        let rate = t.rate_hz.map_or("-".to_string(), |hz| format!("{} Hz", compact(hz)));
        let gyro = if t.gyro { "yes" } else { "-" };
        line(format!("{:<name$}  {:<kind$}  {:>9}  {rate:>10}  {gyro}", t.name, t.type_name, t.messages));
    }
}

fn columns(report: &Inspection, line: &mut dyn FnMut(String)) {
    let role = |c: &ColumnReport| if c.role == "-" { c.type_name.clone() } else { c.role.clone() };
    let of = |of: &dyn Fn(&ColumnReport) -> usize| report.columns.iter().map(of).max().unwrap_or(0);
    let width = of(&|c| c.name.chars().count()).clamp(6, 40);
    let roles = of(&|c| role(c).chars().count()).clamp(12, 40);
    line(format!(
        "{:<width$}  {:<roles$}  {:<8}  {:>7}  {:>12}  {:>12}  {:>12}",
        "column", "role or type", "unit", "missing", "min", "median", "max"
    ));
    let number = |x: Option<f64>| x.map_or("-".to_string(), compact);
    for c in &report.columns {
        let unit = c.unit.as_deref().map_or_else(|| "-".to_string(), spelled);
        line(format!(
            "{:<width$}  {:<roles$}  {unit:<8}  {:>7}  {:>12}  {:>12}  {:>12}",
            c.name,
            role(c),
            c.missing,
            number(c.min),
            number(c.median),
            number(c.max)
        ));
        if let Some(bad) = &c.not_a_number {
            line(format!("{:<width$}  not a number: {bad}", ""));
        }
    }
}

/// A unit as people write it.
fn spelled(unit: &str) -> String {
    match RateUnit::parse(unit) {
        Some(rate) => rate.to_string(),
        None if unit == "c" => "°C".to_string(),
        None => unit.to_string(),
    }
}

fn clock(time: &TimeReport, line: &mut dyn FnMut(String)) {
    let from = match time.clock {
        Clock::PowerOn { first_s, stated } => {
            let how = if stated { "since power-on" } else { "taken as since power-on" };
            format!("{how}, from {first_s} s")
        }
        Clock::FirstSample { .. } => "counted from the first sample".to_string(),
    };
    line(format!("{:<9} {:?} {from}, {} long", "time", time.column, duration_text(time.span_s)));
    if let (Some(sampling), Some(gaps)) = (&time.sampling, &time.gaps) {
        line(format!("{:<9} {}", "rate", rate(sampling)));
        line(format!("{:<9} {}", "gaps", gaps.text().unwrap_or_else(|| "none".to_string())));
    }
    if time.not_increasing > 0 {
        line(format!("{:<9} {} rows do not lie after the one before", "order", time.not_increasing));
    }
}

fn rate(s: &Sampling) -> String {
    let even = if s.uniform { "even" } else { "uneven" };
    format!(
        "{} Hz, {even}: steps {} ± {} (1 % to 99 %: {} to {})",
        compact(s.rate_hz),
        duration_text(s.median_step_s),
        duration_text(s.step_std_s),
        duration_text(s.step_p01_s),
        duration_text(s.step_p99_s)
    )
}

fn gyro(axis: &AxisReport, line: &mut dyn FnMut(String)) {
    let title = format!("gyro {}", axis.axis);
    let column = axis.column.as_deref().unwrap_or("-");
    let Some(audit) = &axis.audit else {
        let problem = axis.problem.as_deref().unwrap_or("cannot be used");
        line(format!("{title:<9} {problem}"));
        return;
    };
    let unit = axis.unit.as_deref().unwrap_or("-");
    let guessed = if axis.unit_guessed { " (guessed)" } else { "" };
    line(format!("{title:<9} {column:?} in {unit}{guessed}, {} of {} rows usable", audit.samples, audit.rows));
    let rest = &audit.rest;
    let lattice = rest.lattice_step_rad_s.map_or(String::new(), |q| format!(", quantization step {}", both(q)));
    line(format!(
        "{:<9} median {}, noise {}, drift {}{lattice}",
        "  rest",
        both(rest.median_rad_s),
        both(rest.noise_std_rad_s),
        both(rest.drift_rad_s)
    ));
    line(format!("{:<9} {}", "  motion", motion_text(&audit.motion)));
    for what in audit.findings() {
        line(format!("{:<9} {what}", "  found"));
    }
}

fn motion_text(motion: &Motion) -> String {
    let none = if motion.assessed { "none found" } else { "not assessed" };
    motion.text().unwrap_or_else(|| none.to_string())
}

/// A rate in SI and in the unit of datasheets.
fn both(rate_rad_s: f64) -> String {
    format!("{rate_rad_s:.3e} rad/s ({} deg/s)", compact(rate_rad_s / RAD_S_PER_DEG_S))
}

/// A number with six digits at most.
fn compact(x: f64) -> String {
    if x == 0.0 {
        return "0".to_string();
    }
    let size = x.abs();
    if !(1e-4..1e7).contains(&size) {
        return format!("{x:.4e}");
    }
    let decimals = (5 - size.log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}
