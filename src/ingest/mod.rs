//! Floor 2: logs from files and into files, and what is wrong with them.
//!
//! A file's format is found in its content: text tables, gzipped or not, Parquet, bags of ROS 1 and 2, flight logs of PX4 and
//! ArduPilot, MATLAB, HDF5 and NumPy. Where it holds messages of several [topics](Topic), the only one with a gyro is read,
//! or the one that is named; its columns are found by their names and unit suffixes. [`read_gyro`] reads one axis of a gyro at rest for the fit and audits it,
//! [`read_gyro_within`] also of a log too large to be held, in one pass, [`read_axes_within`] several axes in the same; [`read_drive`]
//! reads every channel of a drive, from one file or several; [`read_log`] one file without more ado; [`inspect()`] tells what is in a file; [`write_log`] writes a log.
//! Columns that a caller holds in memory are read where a path is asked for ([`hold`]), and a log is written there ([`held`]).
//!
//! A sensor that is turned against its robot is read in the robot's frame ([`Mounting`]); `gyro_topics` lists the gyros of a log.
//!
//! Nothing is dropped or guessed in silence: what was done about a finding stands in the [`Audit`], what was decided in the
//! recording's notes, and what cannot be decided is an error that says which option decides it.
//!
//! ```no_run
//! use gyroid::ingest::{GyroQuery, read_gyro};
//!
//! let recording = read_gyro("rest.csv.gz", &GyroQuery::default())?;
//! println!("{} samples at {} Hz", recording.audit.samples, recording.audit.sampling.rate_hz);
//! # Ok::<(), gyroid::Error>(())
//! ```

pub(crate) mod assemble;
pub(crate) mod clean;
pub(crate) mod columns;
mod formats;
mod write;

pub use self::assemble::query::GyroQuery;
pub use crate::ingest::assemble::drive::{DriveQuery, DriveRecording, read_drive, read_log};
pub use crate::ingest::assemble::inspect::{AxisReport, ColumnReport, Inspection, TimeReport, inspect, inspect_topic};
pub use crate::ingest::assemble::recording::GyroRecording;
pub use crate::ingest::assemble::stream::StreamedRecording;
pub use crate::ingest::clean::audit::{
    Audit, Duplicates, Gaps, Handling, Missing, OutOfOrder, Rest, Sampling, Saturation, Stuck,
};
pub use crate::ingest::clean::clock::Clock;
pub(crate) use crate::ingest::clean::clock::DATES_S;
pub use crate::ingest::clean::motion::{Interval, Motion};
pub use crate::ingest::columns::channel_map::ChannelMap;
pub use crate::ingest::columns::mounting::Mounting;
pub use crate::ingest::columns::names::Axis;
pub use crate::ingest::columns::scale::Scale;
pub use crate::ingest::formats::arrays::Loaded;
pub use crate::ingest::formats::memory::{Cells, CellsKind, HeldColumn, held, hold};
pub use crate::ingest::formats::topics::{Stamp, Topic};
pub use write::{LogWriter, write_log};

use crate::error::{Error, ErrorKind, Result};
use crate::signal::Limits;
use std::path::Path;

/// Limits of the summary of each axis where several are read in one pass.
const OF_SEVERAL: Limits = Limits { blocks: 1 << 18, stretch: 1 << 17, stretches: 8 };

/// Reads one axis of a gyro that was at rest.
///
/// # Errors
/// - [`ErrorKind::Io`], [`ErrorKind::Format`]: the file cannot be read, is truncated, or its rows differ in length.
/// - [`ErrorKind::Column`]: the topic, the rate or the time is not there, or several could be it.
/// - [`ErrorKind::Unit`]: the unit cannot be told, or the numbers contradict the name.
/// - [`ErrorKind::Time`]: time goes back (see [`GyroQuery::sort_time`]) or stands still.
/// - [`ErrorKind::Value`]: words in a column of numbers, infinity, rates beyond 100 rad/s, nothing but missing values, a constant.
/// - [`ErrorKind::TooShort`]: fewer than three samples.
pub fn read_gyro(path: impl AsRef<Path>, query: &GyroQuery) -> Result<GyroRecording> {
    let (source, plan) = opened(path.as_ref(), query)?;
    let wanted = plan.wanted(source.heads().len());
    crate::ingest::assemble::recording::assemble(crate::ingest::formats::table::collect(source, &wanted)?, &plan, query)
}

/// The topics of `path` that hold the rates of a gyro, in the order of their names; none of a file that is one table.
///
/// # Errors
/// As [`read_gyro`] if the file cannot be opened; [`ErrorKind::Column`] if it has topics, and none with a gyro.
pub(crate) fn gyro_topics(path: impl AsRef<Path>) -> Result<Option<Vec<Topic>>> {
    formats::gyro_topics(path.as_ref())
}

/// The table of `path` with the gyro, and its columns.
fn opened(
    path: &Path,
    query: &GyroQuery,
) -> Result<(Box<dyn crate::ingest::formats::source::Source>, crate::ingest::assemble::plan::Plan)> {
    if let Some(rate_hz) = query.rate_hz
        && !(rate_hz.is_finite() && rate_hz > 0.0)
    {
        let found = format!("a sample rate of {rate_hz} Hz");
        return Err(Error::new(ErrorKind::Usage, "--rate", found).hint("state a positive rate in Hz"));
    }
    let choice = formats::Choice {
        topic: query.topic.as_deref(),
        stamp: query.stamp,
        unhashed: false,
        skip_bad_rows: query.skip_bad_rows,
    };
    let formats::Chosen { source, note } = formats::open(path, choice)?;
    let name = path.display().to_string();
    let mut used = vec![false; query.scales.len()];
    let source = crate::ingest::columns::scale::Scaled::of(source, &query.scales, &mut used);
    if let Some((scale, _)) = query.scales.iter().zip(&used).find(|(_, used)| !**used) {
        return Err(scale.missing(&name, source.heads()));
    }
    let (source, turned): (Box<dyn crate::ingest::formats::source::Source>, _) = match &query.mounting {
        Some(mounting) => {
            let (mounted, told) = crate::ingest::columns::mounted::Mounted::new(&name, source, mounting, query)?;
            (Box::new(mounted), told)
        }
        None => (source, None),
    };
    let mut plan = crate::ingest::assemble::plan::Plan::of(&name, source.heads(), query)?;
    plan.notes.extend(note.into_iter().chain(turned));
    Ok((source, plan))
}

/// Numbers of a log at rest that are held at once where nobody says otherwise, bytes: 3.3e7 samples with their times.
pub const MEMORY_BYTES: usize = 512 << 20;

/// A log that was held, or one that was read once because it is too large for that.
#[derive(Debug, Clone)]
pub enum Reading {
    /// All samples.
    Whole(Box<GyroRecording>),
    /// The summary that one pass kept of them.
    Streamed(Box<StreamedRecording>),
}

/// How far the reading has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Rows read.
    pub rows: u64,
    /// About how many there are; none where that is not known.
    pub of: Option<u64>,
}

/// Reads one axis of a gyro that was at rest, as [`read_gyro`]; a log whose columns take more than `memory_bytes` (8 for each
/// number) is read in one pass, of which about 60 MB are kept. The size is known from the file's index or the length of its
/// lines; where neither tells, it is found while reading. `progress` is told how far it has come.
///
/// # Errors
/// As [`read_gyro`]. Of a log that is not held: [`ErrorKind::Usage`] for [`GyroQuery::sort_time`], [`ErrorKind::Time`] where the
/// clock is coarser than the sampling, for its stamps cannot be spread.
pub fn read_gyro_within(
    path: impl AsRef<Path>,
    query: &GyroQuery,
    memory_bytes: usize,
    progress: &mut dyn FnMut(Progress),
) -> Result<Reading> {
    let mut readings = read_axes_within(path, std::slice::from_ref(query), memory_bytes, progress)?;
    readings.pop().ok_or_else(|| Error::new(ErrorKind::Usage, "axes", "none is named"))
}

/// Reads several axes of a gyro that was at rest, as [`read_gyro_within`] reads one, and the file once for all of them; one
/// reading a query, in their order. The queries differ in the axis and its sign alone. Of a log that is not held less is kept
/// of each axis than of one: a quarter of the block means and of the stretches' samples, 20 MB each with its temperature.
///
/// # Errors
/// As [`read_gyro_within`]; [`ErrorKind::Usage`] where a column is named for several axes, [`ErrorKind::Column`] where two axes
/// are one column.
pub fn read_axes_within(
    path: impl AsRef<Path>,
    queries: &[GyroQuery],
    memory_bytes: usize,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<Reading>> {
    let path = path.as_ref();
    let name = path.display().to_string();
    let Some(first) = queries.first() else { return Ok(Vec::new()) };
    let (mut source, plan) = opened(path, first)?;
    let plans = plans(&name, source.heads(), plan, queries)?;
    let mut wanted = vec![false; source.heads().len()];
    for plan in &plans {
        wanted.iter_mut().zip(plan.wanted(source.heads().len())).for_each(|(all, one)| *all |= one);
    }
    let row_bytes = wanted.iter().filter(|w| **w).count() * size_of::<f64>();
    let of = source.rows();
    // lengths of lines are guessed: only what is clearly too large is not held to begin with
    let large = of.is_some_and(|rows| rows.saturating_mul(row_bytes as u64) > memory_bytes as u64);
    if !large {
        source.hold();
    }
    let most_rows = memory_bytes / row_bytes.max(1);
    let limits = if plans.len() > 1 { OF_SEVERAL } else { Limits::default() };
    let mut gathering = Some(crate::ingest::formats::table::Gathering::new(source.as_ref(), most_rows));
    let mut passes: Vec<crate::ingest::assemble::stream::Pass> = Vec::new();
    let facts = source.read(&wanted, &mut |batch| {
        if !passes.is_empty() {
            passes.iter_mut().try_for_each(|pass| pass.add(&batch))?;
            progress(Progress { rows: passes[0].rows() as u64, of });
        } else if let Some(mut held) = gathering.take() {
            held.add(batch);
            progress(Progress { rows: held.rows() as u64, of });
            if held.rows() > 0 && (large || held.bytes() > memory_bytes) {
                let beginning = held.beginning(&name);
                let head = beginning.first(crate::ingest::assemble::stream::HEAD_ROWS);
                let begun = |(plan, query)| crate::ingest::assemble::stream::Pass::new(&head, plan, query, limits);
                passes = plans.iter().zip(queries).map(begun).collect::<Result<_>>()?;
                let batch = beginning.into_batch();
                passes.iter_mut().try_for_each(|pass| pass.add(&batch))?;
            } else {
                gathering = Some(held);
            }
        }
        Ok(())
    })?;
    if let Some(held) = gathering {
        let table = held.finish(facts);
        let whole = |table, k: usize| -> Result<Reading> {
            Ok(Reading::Whole(Box::new(crate::ingest::assemble::recording::assemble(table, &plans[k], &queries[k])?)))
        };
        let last = plans.len() - 1;
        let copied = |k: usize| whole(table.only(&plans[k].wanted(wanted.len())), k);
        let mut readings = (0..last).map(copied).collect::<Result<Vec<_>>>()?;
        readings.push(whole(table, last)?);
        return Ok(readings);
    }
    if passes.is_empty() {
        return Err(Error::new(ErrorKind::TooShort, &name, "no rows").hint("record the log again"));
    }
    passes.into_iter().map(|pass| Ok(Reading::Streamed(Box::new(pass.finish(facts.clone())?)))).collect()
}

/// The columns of each query, of which `first` are those of the first.
fn plans(
    name: &str,
    heads: &[crate::ingest::formats::head::Head],
    first: crate::ingest::assemble::plan::Plan,
    queries: &[GyroQuery],
) -> Result<Vec<crate::ingest::assemble::plan::Plan>> {
    if queries.len() > 1 && queries.iter().any(|q| q.column.is_some()) {
        return Err(Error::new(ErrorKind::Usage, "--column", "names one column, and several axes are asked for")
            .hint("name one axis, or leave the columns to their names"));
    }
    // what was noted when the file was opened stands in the first
    let mut plans = vec![first];
    for query in &queries[1..] {
        let mut plan = crate::ingest::assemble::plan::Plan::of(name, heads, query)?;
        let more = plans[0].notes.iter().filter(|n| !plan.notes.contains(n)).cloned().collect::<Vec<_>>();
        plan.notes.extend(more);
        if plans.iter().any(|p| p.gyro == plan.gyro) {
            let found = format!(
                "column {:?} is all there is of the gyro, and several axes are asked for",
                heads[plan.gyro].name
            );
            return Err(Error::new(ErrorKind::Column, name, found).hint("name one axis: --axis z"));
        }
        plans.push(plan);
    }
    Ok(plans)
}
