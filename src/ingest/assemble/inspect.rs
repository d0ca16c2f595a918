//! Content of a file, also when no fit can use it.

use super::plan::Plan;
use super::query::GyroQuery;
use super::recording;
use crate::error::Result;
use crate::ingest::clean::audit;
use crate::ingest::clean::audit::{Audit, Gaps, Sampling};
use crate::ingest::clean::clock;
use crate::ingest::clean::clock::{Clock, TimeColumn, Times};
use crate::ingest::columns::channels;
use crate::ingest::columns::channels::Found;
use crate::ingest::columns::gyro::find_gyro;
use crate::ingest::columns::names::{Axis, Role, TimeKind};
use crate::ingest::formats;
use crate::ingest::formats::format::Opened;
use crate::ingest::formats::head::Kind;
use crate::ingest::formats::table;
use crate::ingest::formats::table::Table;
use crate::ingest::formats::topics;
use crate::ingest::formats::topics::{Listing, Stamp, Topic};
use crate::math::robust::median;
use crate::signal::TimeAxis;
use serde::Serialize;
use std::path::Path;

/// One column of the file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnReport {
    /// Name as in the file.
    pub name: String,
    /// The format's word for the type.
    pub type_name: String,
    /// Recognised role: `time`, `host time`, `gyro x`, `temperature`, ...; `-` where nothing needs it.
    pub role: String,
    /// Unit in the name or the units row, as written.
    pub unit: Option<String>,
    /// Empty cells, and cells that are no number.
    pub missing: usize,
    /// First cell that is no number, with its place.
    pub not_a_number: Option<String>,
    /// Smallest value, in the file's unit.
    pub min: Option<f64>,
    /// Median, in the file's unit.
    pub median: Option<f64>,
    /// Largest value, in the file's unit.
    pub max: Option<f64>,
}

/// The file's clock.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TimeReport {
    /// Name of the column.
    pub column: String,
    /// Zero of the times.
    pub clock: Clock,
    /// First time, s.
    pub start_s: f64,
    /// Time from first to last row, s.
    pub span_s: f64,
    /// Rows that do not lie after the one before.
    pub not_increasing: usize,
    /// Sample rate and jitter of the rows that increase.
    pub sampling: Option<Sampling>,
    /// Gaps between the rows that increase.
    pub gaps: Option<Gaps>,
}

/// One axis of the gyro, as the fit would see it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AxisReport {
    /// The axis.
    pub axis: Axis,
    /// Name of the column; none if the file has no such axis, or several columns could be it.
    pub column: Option<String>,
    /// Unit of the column.
    pub unit: Option<String>,
    /// Whether the unit was guessed.
    pub unit_guessed: bool,
    /// Findings; none if the fit cannot use the axis.
    pub audit: Option<Audit>,
    /// Why the fit cannot use the axis, with the hint.
    pub problem: Option<String>,
}

/// Content of a file.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Inspection {
    /// Path.
    pub file: String,
    /// Format, as found in the content.
    pub format: String,
    /// SHA-256 of the file's bytes, hexadecimal.
    pub sha256: String,
    /// Topics, in a log that holds messages.
    pub topics: Vec<Topic>,
    /// The topic whose rows and columns follow; none in a file that is one table, or where none was chosen.
    pub topic: Option<String>,
    /// Rows.
    pub rows: usize,
    /// Columns in the file's order.
    pub columns: Vec<ColumnReport>,
    /// Clock; none if there is no time to be read.
    pub time: Option<TimeReport>,
    /// Axes of the gyro that are there.
    pub gyro: Vec<AxisReport>,
    /// Obstacles to a fit, with the remedies.
    pub problems: Vec<String>,
    /// Decisions that the reader took.
    pub notes: Vec<String>,
}

impl Inspection {
    /// Whether the fit can use one axis at least.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.gyro.iter().any(|g| g.audit.is_some())
    }
}

/// Looks at a file. Whatever keeps a fit from using it is told in the result.
///
/// # Errors
/// Only if the file cannot be read at all: [`crate::ErrorKind::Io`], [`crate::ErrorKind::Format`], [`crate::ErrorKind::TooShort`] without rows.
pub fn inspect(path: impl AsRef<Path>) -> Result<Inspection> {
    inspect_topic(path, None, Stamp::Header, false)
}

/// Looks at a file, and of its topics at `topic`, or at the only one with a gyro; `stamp` says which time of its messages
/// counts, `skip_bad_rows` whether rows of text that do not parse are left out.
///
/// # Errors
/// As [`inspect()`]; [`crate::ErrorKind::Column`] for a topic that is not there, with those that are.
pub fn inspect_topic(
    path: impl AsRef<Path>,
    topic: Option<&str>,
    stamp: Stamp,
    skip_bad_rows: bool,
) -> Result<Inspection> {
    let path = path.as_ref();
    let mut report = Inspection::default();
    let choice = formats::Choice { topic, stamp, skip_bad_rows, ..formats::Choice::default() };
    let source = match formats::opened(path, choice)? {
        // tells that there are no topics
        Opened::Table(_) if topic.is_some() => formats::open(path, choice)?.source,
        Opened::Table(source) => source,
        Opened::Topics(container) => {
            let Listing { about, topics: listed } = container.listing();
            report.file.clone_from(&about.source);
            report.format = about.format.to_string();
            report.sha256.clone_from(&about.sha256);
            report.topics.clone_from(listed);
            match topics::choose(&about.source, listed, topic) {
                Ok((index, note)) => {
                    report.topic = Some(report.topics[index].name.clone());
                    report.notes.extend(note);
                    container.open(index, stamp)?
                }
                Err(error) if topic.is_some() => return Err(error),
                Err(error) => {
                    report.problems.push(told(&error));
                    report.notes.extend_from_slice(&about.notes);
                    return Ok(report);
                }
            }
        }
    };
    let wanted: Vec<bool> = source.heads().iter().map(|h| h.kind != Kind::Other).collect();
    let table = table::collect(source, &wanted)?;
    report.file.clone_from(&table.source);
    if report.topics.is_empty() {
        report.format.clone_from(&table.format);
    }
    report.sha256.clone_from(&table.sha256);
    report.rows = table.rows;
    let channels = channels::recognise(&table.heads, &|_| false, &mut Vec::new());
    report.columns = (0..table.heads.len()).map(|i| column(&table, i, &channels)).collect();
    report.notes.extend_from_slice(&table.notes);
    match clock::choose(&table.source, &table.heads, None, false).and_then(|c| Ok((c, clock::read(&table, c, None)?))) {
        Ok((column, times)) => {
            report.time = Some(time(&table, column, &times));
            report.notes.extend(times.unit_note);
        }
        Err(error) => report.problems.push(told(&error)),
    }
    for axis in Axis::ALL {
        gyro(&table, axis, &mut report);
    }
    if report.gyro.is_empty() {
        let reason = find_gyro(&table.source, &table.heads, Axis::Z).err();
        report.problems.extend(reason.as_ref().map(told));
    }
    Ok(report)
}

/// An error without the file's name, which stands above.
fn told(error: &crate::Error) -> String {
    let place = error.place.as_ref().map(|p| format!("{p}: ")).unwrap_or_default();
    let hint = error.hint.as_ref().map(|m| format!(" ({m})")).unwrap_or_default();
    format!("{place}{}{hint}", error.found)
}

fn column(table: &Table, i: usize, channels: &[Found]) -> ColumnReport {
    let (head, cells) = (&table.heads[i], &table.cells[i]);
    let named = head.named();
    let role = match named.role {
        _ if head.kind == Kind::Other => "-".to_string(),
        Role::Gyro(Some(axis)) => format!("gyro {axis}"),
        Role::Gyro(None) => "gyro".to_string(),
        Role::Time(TimeKind::Host) | Role::TimePart { kind: TimeKind::Host, .. } => "host time".to_string(),
        Role::Time(_) | Role::TimePart { .. } => "time".to_string(),
        Role::Temperature => "temperature".to_string(),
        Role::Supply => "supply".to_string(),
        // what a drive calls it
        Role::Other => channels.iter().find(|f| f.column == i).map_or("-", |f| f.channel).to_string(),
    };
    let mut there: Vec<f64> = cells.values.iter().filter(|v| !v.is_nan()).map(|v| v + cells.origin as f64).collect();
    let (min, max) = there.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)));
    let some = !there.is_empty();
    ColumnReport {
        name: head.name.clone(),
        type_name: head.type_name.clone(),
        role,
        unit: head.unit.clone().or(named.unit),
        missing: cells.missing().0,
        not_a_number: cells
            .bad
            .as_ref()
            .map(|(b, n)| format!("{:?} at {} ({n} in all)", b.text, table.place(b.row, &head.name))),
        min: some.then_some(min),
        median: some.then(|| median(&mut there)),
        max: some.then_some(max),
    }
}

fn time(table: &Table, column: TimeColumn, times: &Times) -> TimeReport {
    let all: Vec<f64> = times.seconds.iter().copied().filter(|t| !t.is_nan()).collect();
    let mut rising: Vec<f64> = Vec::with_capacity(all.len());
    for &t in &all {
        if rising.last().is_none_or(|&last| t > last) {
            rising.push(t);
        }
    }
    let steps = (rising.len() >= 2).then(|| {
        let step_s = median(&mut audit::intervals(&rising));
        let tolerance = (times.resolution_s / step_s).clamp(1e-6, 0.5);
        audit::steps(&rising, TimeAxis::even(&rising, tolerance).is_some())
    });
    let (sampling, gaps) = steps.unzip();
    TimeReport {
        column: column.index().map_or("rows".to_string(), |i| table.heads[i].name.clone()),
        clock: times.clock,
        start_s: rising.first().copied().unwrap_or(f64::NAN),
        span_s: rising.last().zip(rising.first()).map_or(0.0, |(b, a)| b - a),
        not_increasing: all.len() - rising.len(),
        sampling,
        gaps,
    }
}

fn gyro(table: &Table, axis: Axis, report: &mut Inspection) {
    let there = table.heads.iter().any(|h| match h.named().role {
        Role::Gyro(Some(a)) => a == axis,
        // a gyro of one axis is shown once
        Role::Gyro(None) => axis == Axis::Z && find_gyro("", &table.heads, axis).is_ok(),
        _ => false,
    });
    if !there {
        return;
    }
    let query = GyroQuery { axis, ..GyroQuery::default() };
    let found = find_gyro(&table.source, &table.heads, axis).ok();
    let column = found.map(|i| table.heads[i].name.clone());
    let read = Plan::of(&table.source, &table.heads, &query)
        .and_then(|p| recording::assemble(table.only(&p.wanted(table.heads.len())), &p, &query));
    report.gyro.push(match read {
        Ok(r) => {
            for note in r.notes {
                if !report.notes.contains(&note) {
                    report.notes.push(note);
                }
            }
            AxisReport {
                axis,
                column,
                unit: Some(r.unit.to_string()),
                unit_guessed: r.unit_guessed,
                audit: Some(r.audit),
                problem: None,
            }
        }
        Err(error) => {
            AxisReport { axis, column, unit: None, unit_guessed: false, audit: None, problem: Some(told(&error)) }
        }
    });
}
