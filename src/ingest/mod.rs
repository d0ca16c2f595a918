//! Floor 2: logs from files and into files, and what is wrong with them.
//!
//! A file's format is found in its content: text tables, gzipped or not, Parquet, bags of ROS 1 and 2, flight logs of PX4 and
//! ArduPilot, MATLAB, HDF5 and NumPy. Where it holds messages of several [topics](Topic), the only one with a gyro is read,
//! or the one that is named; its columns are found by their names and unit suffixes. [`read_gyro`] reads one axis of a gyro at rest for the fit and audits it; [`read_drive`]
//! reads every channel of a drive, from one file or several; [`read_log`] one file without more ado; [`inspect()`] tells what is in a file; [`write_log`] writes a log.
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

mod arrays;
mod audit;
mod bag;
mod bytes;
mod cell;
mod channel_map;
mod channels;
mod clock;
mod dataflash;
#[cfg(feature = "db3")]
mod db3;
mod dialect;
mod drive;
mod fill;
mod findings;
mod format;
mod formats;
#[cfg(feature = "hdf5")]
mod hdf5;
mod input;
mod inspect;
mod lattice;
mod matlab;
mod mcap;
mod merge;
mod motion;
mod names;
mod numpy;
mod numpy_header;
mod parquet;
mod px4;
mod quantity;
mod rate_unit;
mod recording;
mod ros;
mod scalar;
mod table;
mod text;
mod topics;
mod ulog;
mod write;

pub use audit::{Audit, Duplicates, Gaps, Handling, Missing, OutOfOrder, Rest, Sampling, Saturation, Stuck};
pub use channel_map::ChannelMap;
pub use clock::Clock;
pub use drive::{DriveQuery, DriveRecording, read_drive, read_log};
pub use inspect::{AxisReport, ColumnReport, Inspection, TimeReport, inspect, inspect_topic};
pub use motion::{Interval, Motion};
pub use names::Axis;
pub use recording::{GyroQuery, GyroRecording};
pub use topics::{Stamp, Topic};
pub use write::{LogWriter, write_log};

use crate::error::{Error, ErrorKind, Result};
use std::path::Path;

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
    let path = path.as_ref();
    if let Some(rate_hz) = query.rate_hz
        && !(rate_hz.is_finite() && rate_hz > 0.0)
    {
        let found = format!("a sample rate of {rate_hz} Hz");
        return Err(Error::new(ErrorKind::Usage, "--rate", found).mend("state a positive rate in Hz"));
    }
    let choice = formats::Choice { topic: query.topic.as_deref(), stamp: query.stamp };
    let formats::Chosen { source, note } = formats::open(path, choice)?;
    let mut plan = recording::Plan::of(&path.display().to_string(), source.heads(), query)?;
    plan.notes.extend(note);
    let wanted = plan.wanted(source.heads().len());
    recording::assemble(&table::collect(source, &wanted)?, &plan, query)
}
