//! Options of the commands that read a log at rest or a drive, and what they make of it.

use super::drive_args::{drive_query, known};
use super::log_values::{AxisList, LOG_OPTIONS, parse_axes, parse_rate_unit, parse_time_unit};
use super::mounting_args::MountingArgs;
use super::output::Working;
use super::topic_args::{EVERY_TOPIC, RawArgs, TopicArgs};
use clap::Args;
use gyroid::config::Config;
use gyroid::ingest::{
    self, Audit, DriveRecording, GyroQuery, GyroRecording, Mounting, Progress, Reading, StreamedRecording,
};
use gyroid::population::{AxisChoice, Topics};
use gyroid::report::LogFacts;
use gyroid::signal::{TimeAxis, names};
use gyroid::units::{RateUnit, TimeUnit, duration_text};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A log at rest and how to read it.
#[derive(Debug, Clone, Args)]
pub(crate) struct LogArgs {
    /// Log of a gyro at rest: CSV, JSON lines, Parquet, bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    log: PathBuf,
    #[command(flatten)]
    memory: MemoryArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Whether the work needs all samples at once.
    #[arg(skip)]
    whole: bool,
}

/// How much of a log is held.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = LOG_OPTIONS)]
pub(crate) struct MemoryArgs {
    /// Hold a log whose times and rates, with what is made of them, take up to this, MB; a larger one is read once, in about 200 MB. 0: read every log so
    #[arg(long, value_name = "MB", default_value_t = ingest::MEMORY_BYTES >> 20)]
    memory: usize,
}

/// Bytes that the work on a held log takes for each byte of its times and rates: residuals, derivatives, spectra (measured
/// at 1e7 samples, for `fit` and `noise`).
const WORK: usize = 7;

/// A log that was held, or one that was read once; its times count from power-on.
pub(crate) enum LogRead {
    Whole(Box<GyroRecording>, TimeAxis),
    Streamed(Box<StreamedRecording>),
}

/// How to read the columns of a log at rest.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = LOG_OPTIONS)]
pub(crate) struct ColumnArgs {
    #[command(flatten)]
    topics: TopicArgs,
    /// Axis of the gyro (with --mounting, of the robot): x, y, z, or -x, -y, -z for one that points the other way; fit, noise and
    /// validate also take several, such as x,y, or all, and read the log once for them
    #[arg(long, default_value = "z", allow_hyphen_values = true, value_parser = parse_axes)]
    axis: AxisList,
    #[command(flatten)]
    mounting: MountingArgs,
    /// Column that holds the rate, where the name does not say
    #[arg(long, value_name = "NAME", conflicts_with_all = ["mounting", "mounting_quaternion"])]
    column: Option<String>,
    /// Unit of the rate: rad/s, deg/s, mrad/s, mdeg/s, deg/h
    #[arg(long, value_parser = parse_rate_unit)]
    unit: Option<RateUnit>,
    /// Column that holds the time
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// Unit of the time: s, ms, us, ns
    #[arg(long, value_parser = parse_time_unit)]
    time_unit: Option<TimeUnit>,
    #[command(flatten)]
    raw: RawArgs,
    /// Sample rate in Hz, for a log without a time column
    #[arg(long, value_name = "HZ", conflicts_with = "time")]
    rate: Option<f64>,
    /// Sort rows whose time goes backwards instead of refusing them
    #[arg(long)]
    sort_time: bool,
    /// Leave out the seconds in which the sensor moved
    #[arg(long)]
    trim_motion: bool,
    /// The log's first sample is this long after power-on, s; where a command takes several drives also one for each, apart by
    /// commas, in their order
    #[arg(long, value_name = "S", value_delimiter = ',')]
    start_offset: Vec<f64>,
}

/// End of the note on a log that moves.
const TRIM: &str = "; --trim-motion leaves that out";

impl ColumnArgs {
    /// Whether more than one topic is asked for.
    pub(super) fn several_topics(&self) -> bool {
        self.topics.topic.len() > 1 || self.topics.topic.iter().any(|t| t == EVERY_TOPIC)
    }

    /// The topics of each of several logs.
    pub(super) fn topics(&self) -> Topics {
        match &self.topics.topic[..] {
            [] => Topics::Only,
            some if some.iter().any(|t| t == EVERY_TOPIC) => Topics::All,
            some => {
                // a topic that is named twice is one row
                let first = |(i, topic): &(usize, &String)| !some[..*i].contains(*topic);
                Topics::Named(some.iter().enumerate().filter(first).map(|(_, topic)| topic.clone()).collect())
            }
        }
    }

    /// The options as a query to the reader.
    pub(super) fn query(&self) -> Result<GyroQuery> {
        self.query_of(self.axis()?)
    }

    /// The same for one of several axes.
    pub(super) fn query_of(&self, axis: AxisChoice) -> Result<GyroQuery> {
        Ok(GyroQuery { topic: self.topics.one()?.map(str::to_string), ..self.query_of_any_topic(axis)? })
    }

    /// The same, where the topic is to be chosen.
    pub(super) fn query_of_any_topic(&self, axis: AxisChoice) -> Result<GyroQuery> {
        if self.start_offset.iter().any(|s| !(s.is_finite() && *s >= 0.0)) {
            return Err(Error::new(ErrorKind::Usage, "--start-offset", "must be zero or a positive number of seconds"));
        }
        if self.start_offset.len() > 1 {
            let found = format!("{} are given, and only several drives may have one each", self.start_offset.len());
            return Err(Error::new(ErrorKind::Usage, "--start-offset", found).hint("give one"));
        }
        Ok(GyroQuery {
            column: self.column.clone(),
            axis: axis.axis,
            reversed: axis.reversed,
            mounting: self.mounting.given(),
            unit: self.unit,
            time: self.time.clone(),
            time_unit: self.time_unit,
            rate_hz: self.rate,
            sort_time: self.sort_time,
            topic: None,
            stamp: self.topics.stamp(),
            scales: self.raw.scales()?,
            skip_bad_rows: self.raw.skip_bad_rows,
        })
    }

    /// Reads the log, and leaves out motion where that was asked for.
    pub(super) fn read(&self, log: &Path) -> Result<GyroRecording> {
        let recording = ingest::read_gyro(log, &self.query()?)?;
        if self.trim_motion { recording.without_motion() } else { Ok(recording) }
    }

    /// The axis, and whether it points the other way.
    pub(super) fn axis(&self) -> Result<AxisChoice> {
        match self.axes() {
            [one] => Ok(*one),
            several => Err(Error::new(ErrorKind::Usage, "--axis", format!("{} axes are named", several.len()))
                .hint("name one: --axis z")),
        }
    }

    /// The axes that are named.
    pub(super) fn axes(&self) -> &[AxisChoice] {
        &self.axis.0
    }

    /// The same, where the axis has to be the vertical one: an accelerometer in the log is asked whether it is.
    pub(super) fn upright(mut self) -> Self {
        if self.column.is_none() && self.mounting.given().is_none() {
            self.mounting.mounting = Some(Mounting::ALIGNED);
        }
        self
    }

    /// Whether motion is left out.
    pub(super) fn trims_motion(&self) -> bool {
        self.trim_motion
    }

    /// Reads the files of a drive of the robot of `config`, whose columns `maps` names where their names do not.
    pub(super) fn read_drive(&self, maps: &[String], logs: &[PathBuf], config: &Config) -> Result<DriveRecording> {
        let (time, time_unit) = (self.time.as_ref(), self.time_unit);
        let query = drive_query(maps, time, time_unit, &self.topics, &self.mounting, &self.raw)?;
        Ok(known(ingest::read_drive(logs, &query)?, config))
    }

    /// How long after power-on the log begins, s, if that was said.
    pub(super) fn start_offset_s(&self) -> Option<f64> {
        self.start_offset.first().copied()
    }

    /// The same of each of `drives`, zero where nothing was said.
    pub(super) fn starts_s(&self, drives: usize) -> Result<Vec<f64>> {
        match self.start_offset[..] {
            [] => Ok(vec![0.0; drives]),
            [all] => Ok(vec![all; drives]),
            ref each if each.len() == drives => Ok(each.to_vec()),
            ref some => {
                let found = format!("{} are given for {drives} drives", some.len());
                Err(Error::new(ErrorKind::Usage, "--start-offset", found)
                    .hint("give one for all, or one for each, first those of --fit, then those of --hold: 20,35,5"))
            }
        }
    }

    /// Notes on a log that is held.
    pub(super) fn notes_on(&self, recording: &GyroRecording) -> Vec<String> {
        self.notes(&recording.notes, &recording.audit, TRIM)
    }

    /// Notes on a log: decisions of the reader, then gaps, findings and motion. `hint` ends the note on motion.
    fn notes(&self, decided: &[String], audit: &Audit, hint: &str) -> Vec<String> {
        let mut notes = decided.to_vec();
        notes.extend(audit.gaps.text());
        notes.extend(audit.findings());
        if let (false, Some(motion)) = (self.trim_motion, audit.motion.text()) {
            notes.push(format!("the log moves, {motion}{hint}"));
        }
        notes
    }

    /// The time axis since power-on: the log's own, or begun `--start-offset` after it.
    pub(super) fn time_since_power_on(&self, recording: &GyroRecording) -> TimeAxis {
        let time = recording.log.time.clone();
        match self.start_offset_s() {
            Some(offset) if !time.is_empty() => {
                let first = time.at(0);
                time.shifted(offset - first)
            }
            _ => time,
        }
    }
}

impl LogArgs {
    /// One of several logs that are read alike.
    pub(super) fn new(log: PathBuf, memory: MemoryArgs, columns: ColumnArgs) -> Self {
        Self { log, memory, columns, whole: false }
    }

    /// The log's file.
    pub(super) fn path(&self) -> &Path {
        &self.log
    }

    /// The same for work that needs all samples at once, if `whole`: then `--memory` bounds the log alone.
    pub(super) fn held(self, whole: bool) -> Self {
        Self { whole, ..self }
    }

    /// Reads the log, and leaves out motion where that was asked for; a large log is read once and not held. `working` shows
    /// how far it has come.
    pub(super) fn read(&self, working: &Working) -> Result<LogRead> {
        self.columns.axis()?;
        let mut axes = self.read_axes(working)?;
        axes.pop().ok_or_else(|| Error::new(ErrorKind::Usage, "--axis", "no axis is named"))
    }

    /// The axes that are named.
    pub(super) fn axes(&self) -> &[AxisChoice] {
        self.columns.axes()
    }

    /// Reads all of the axes, the log once for all of them.
    pub(super) fn read_axes(&self, working: &Working) -> Result<Vec<LogRead>> {
        let queries = self.axes().iter().map(|axis| self.columns.query_of(*axis)).collect::<Result<Vec<_>>>()?;
        let mut show = show_progress(working);
        let most_bytes = self.memory.memory.saturating_mul(1 << 20);
        let mut read = |memory_bytes| ingest::read_axes_within(&self.log, &queries, memory_bytes, &mut show);
        let whole = self.whole || self.columns.trim_motion || self.columns.sort_time;
        // stamps of a clock that is coarser than the sampling are spread in a log that is held
        let again = |e: &Error| e.kind == ErrorKind::Time && !whole && self.is_held_within(most_bytes);
        let readings = match read(if whole { most_bytes } else { most_bytes / WORK }) {
            Err(e) if again(&e) => read(most_bytes)?,
            readings => readings?,
        };
        readings.into_iter().map(|reading| self.since_power_on(reading)).collect()
    }

    /// Whether the log is a file (no pipe, which is read once) that may be held in so many bytes.
    fn is_held_within(&self, bytes: usize) -> bool {
        std::fs::metadata(&self.log).is_ok_and(|file| file.is_file() && file.len() <= bytes as u64)
    }

    /// A reading without motion where that was asked for, on a clock that counts from power-on.
    fn since_power_on(&self, reading: Reading) -> Result<LogRead> {
        match reading {
            Reading::Whole(recording) => {
                let recording = if self.columns.trim_motion { recording.without_motion()? } else { *recording };
                let time = self.columns.time_since_power_on(&recording);
                Ok(LogRead::Whole(Box::new(recording), time))
            }
            Reading::Streamed(_) if self.columns.trim_motion => {
                Err(Error::new(ErrorKind::Usage, "--trim-motion", "needs all samples of the log at once")
                    .hint("raise --memory so that the log is held, or cut the motion off"))
            }
            Reading::Streamed(recording) => {
                let mut recording = *recording;
                if let Some(offset) = self.columns.start_offset_s() {
                    let first = recording.log.moments.first_s;
                    recording.log = recording.log.shifted(offset - first);
                }
                Ok(LogRead::Streamed(Box::new(recording)))
            }
        }
    }

    /// The error of a model by temperature on a log without one.
    pub(super) fn no_temperature(&self, hint: &str) -> Error {
        Error::new(ErrorKind::Column, self.log.display(), "no temperature of the sensor stands beside the rate")
            .at(format!("channel {:?}", names::TEMPERATURE))
            .hint(format!("log it in a column such as temperature_c, or {hint}"))
    }

    /// Facts about the log for the report.
    pub(super) fn facts(&self, recording: &GyroRecording) -> LogFacts {
        let range = |values: &[f64]| {
            let there = values.iter().copied().filter(|v| v.is_finite());
            let (low, high) = there.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            (low <= high).then_some([low, high])
        };
        LogFacts {
            name: self.name(),
            column: recording.column.clone(),
            unit: recording.unit,
            sha256: recording.sha256.clone(),
            temperature_c: recording.log.get(names::TEMPERATURE).and_then(range),
            notes: self.columns.notes_on(recording),
            audit: serde_json::json!(recording.audit),
        }
    }

    /// The same of a log that was read once.
    pub(super) fn facts_streamed(&self, recording: &StreamedRecording) -> LogFacts {
        LogFacts {
            name: self.name(),
            column: recording.column.clone(),
            unit: recording.unit,
            sha256: recording.sha256.clone(),
            temperature_c: recording.temperature_c,
            notes: self.columns.notes(&recording.notes, &recording.audit, "; cut that off"),
            audit: serde_json::json!(recording.audit),
        }
    }

    fn name(&self) -> String {
        self.log.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
    }

    /// Names the file in an error of a layer that saw only numbers.
    pub(super) fn named(&self, error: Error) -> Error {
        if error.input == "log" { error.named(self.log.display()) } else { error }
    }
}

/// Shows rows, how many a second, and the time that is left.
fn show_progress(working: &Working) -> impl FnMut(Progress) {
    const MILLION: f64 = 1e6;
    let began = Instant::now();
    move |progress: Progress| {
        let rows = progress.rows as f64;
        let rate = rows / began.elapsed().as_secs_f64().max(1e-3);
        let (of, left) = match progress.of {
            Some(of) if of > progress.rows => (
                format!(" of {:.1}", of as f64 / MILLION),
                format!(", {} left", duration_text((of as f64 - rows) / rate)),
            ),
            _ => (String::new(), String::new()),
        };
        working.show(format!(
            "reading the log: {:.1}{of} million rows, {:.2} million a second{left}",
            rows / MILLION,
            rate / MILLION
        ));
    }
}
