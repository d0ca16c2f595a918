//! Options of the commands that read a log at rest or a drive, and what they make of it.

use clap::Args;
use gyroid::ingest::{self, Axis, ChannelMap, DriveQuery, DriveRecording, GyroQuery, GyroRecording, Stamp};
use gyroid::population::AxisChoice;
use gyroid::report::LogFacts;
use gyroid::signal::{TimeAxis, names};
use gyroid::units::{RateUnit, TimeUnit};
use gyroid::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// A log at rest and how to read it.
#[derive(Debug, Clone, Args)]
pub(crate) struct LogArgs {
    /// Log of a gyro at rest: CSV, Parquet, bag, MCAP, db3, ULog, DataFlash, MATLAB, HDF5 or NumPy
    log: PathBuf,
    #[command(flatten)]
    columns: ColumnArgs,
}

/// Which messages of a log count, and which of their times.
#[derive(Debug, Clone, Args)]
pub(crate) struct TopicArgs {
    /// Topic of a log that holds several, such as /imu/data, sensor_gyro/1, IMU/0; otherwise the only one with a gyro. Of a
    /// drive it may be given more than once
    #[arg(long, value_name = "NAME")]
    topic: Vec<String>,
    /// Which time of a message counts: that in it, or that of its receipt
    #[arg(long, value_enum, default_value_t = ClockName::Header)]
    clock: ClockName,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ClockName {
    Header,
    Receipt,
}

impl TopicArgs {
    /// The one topic of a log at rest.
    pub fn one(&self) -> Result<Option<&str>> {
        match &self.topic[..] {
            [] => Ok(None),
            [one] => Ok(Some(one)),
            several => Err(Error::new(ErrorKind::Usage, "--topic", format!("{} topics are named", several.len()))
                .mend("name one topic of a log at rest")),
        }
    }

    pub fn stamp(&self) -> Stamp {
        match self.clock {
            ClockName::Header => Stamp::Header,
            ClockName::Receipt => Stamp::Receipt,
        }
    }
}

/// How to read the columns of a log at rest.
#[derive(Debug, Clone, Args)]
pub(crate) struct ColumnArgs {
    #[command(flatten)]
    topics: TopicArgs,
    /// Axis of the gyro: x, y, z, or -x, -y, -z for one that points the other way
    #[arg(long, default_value = "z", allow_hyphen_values = true, value_parser = parse_axis)]
    axis: AxisChoice,
    /// Column that holds the rate, where the name does not say
    #[arg(long, value_name = "NAME")]
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
    /// Sample rate in Hz, for a log without a time column
    #[arg(long, value_name = "HZ", conflicts_with = "time")]
    rate: Option<f64>,
    /// Sort rows whose time goes backwards instead of refusing them
    #[arg(long)]
    sort_time: bool,
    /// Leave out the seconds in which the sensor moved
    #[arg(long)]
    trim_motion: bool,
    /// The log's first sample is this long after power-on, s
    #[arg(long, value_name = "S")]
    start_offset: Option<f64>,
}

/// How to read the columns of a drive.
#[derive(Debug, Clone, Args)]
pub(crate) struct DriveArgs {
    #[command(flatten)]
    topics: TopicArgs,
    /// Read a column as a channel, whatever it is called: gyro_z_rad_s=-wz:deg/s, x_m=east_m; may be given more than once
    #[arg(long, value_name = "CHANNEL=[-]COLUMN[:UNIT]")]
    map: Vec<String>,
    /// Column that holds the time
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// Unit of the time: s, ms, us, ns
    #[arg(long, value_name = "UNIT", value_parser = parse_time_unit)]
    time_unit: Option<TimeUnit>,
}

impl DriveArgs {
    /// Reads the files as one drive.
    pub fn read(&self, logs: &[PathBuf]) -> Result<DriveRecording> {
        let maps = self.map.iter().map(|text| ChannelMap::parse(text)).collect::<Result<_>>()?;
        ingest::read_drive(logs, &drive_query(maps, self.time.as_ref(), self.time_unit, &self.topics))
    }
}

fn drive_query(
    maps: Vec<ChannelMap>,
    time: Option<&String>,
    time_unit: Option<TimeUnit>,
    topics: &TopicArgs,
) -> DriveQuery {
    DriveQuery { maps, time: time.cloned(), time_unit, topics: topics.topic.clone(), stamp: topics.stamp() }
}

/// An axis, and whether it points the other way.
pub(crate) fn parse_axis(text: &str) -> std::result::Result<AxisChoice, String> {
    let (name, reversed) = match text.strip_prefix('-') {
        Some(name) => (name, true),
        None => (text.strip_prefix('+').unwrap_or(text), false),
    };
    let axis = Axis::parse(name).ok_or_else(|| "no axis; there are x, y, z, -x, -y, -z".to_string())?;
    Ok(AxisChoice { axis, reversed })
}

fn parse_rate_unit(text: &str) -> std::result::Result<RateUnit, String> {
    RateUnit::parse(text).ok_or_else(|| {
        let all: Vec<String> = RateUnit::ALL.iter().map(ToString::to_string).collect();
        format!("no unit of rate; there are {}", all.join(", "))
    })
}

fn parse_time_unit(text: &str) -> std::result::Result<TimeUnit, String> {
    TimeUnit::parse(text).ok_or_else(|| "no unit of time; there are s, ms, us, ns".to_string())
}

impl ColumnArgs {
    /// What the reader is asked for.
    pub fn query(&self) -> Result<GyroQuery> {
        if self.start_offset.is_some_and(|s| !(s.is_finite() && s >= 0.0)) {
            return Err(Error::new(ErrorKind::Usage, "--start-offset", "must be zero or a positive number of seconds"));
        }
        Ok(GyroQuery {
            column: self.column.clone(),
            axis: self.axis.axis,
            reversed: self.axis.reversed,
            unit: self.unit,
            time: self.time.clone(),
            time_unit: self.time_unit,
            rate_hz: self.rate,
            sort_time: self.sort_time,
            topic: self.topics.one()?.map(str::to_string),
            stamp: self.topics.stamp(),
        })
    }

    /// Reads the log, and leaves out motion where that was asked for.
    pub fn read(&self, log: &Path) -> Result<GyroRecording> {
        let recording = ingest::read_gyro(log, &self.query()?)?;
        if self.trim_motion { recording.without_motion() } else { Ok(recording) }
    }

    /// The axis, and whether it points the other way.
    pub fn axis(&self) -> AxisChoice {
        self.axis
    }

    /// Whether motion is left out.
    pub fn trims_motion(&self) -> bool {
        self.trim_motion
    }

    /// Reads a drive whose columns `maps` names where their names do not.
    pub fn read_drive(&self, maps: &[String], log: &Path) -> Result<DriveRecording> {
        let maps = maps.iter().map(|text| ChannelMap::parse(text)).collect::<Result<_>>()?;
        ingest::read_drive(&[log], &drive_query(maps, self.time.as_ref(), self.time_unit, &self.topics))
    }

    /// How long after power-on the log begins, s, if that was said.
    pub fn start_offset_s(&self) -> Option<f64> {
        self.start_offset
    }

    /// The time axis since power-on: the log's own, or begun `--start-offset` after it.
    pub fn time_since_power_on(&self, recording: &GyroRecording) -> TimeAxis {
        let time = recording.log.time.clone();
        match self.start_offset {
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
    pub fn new(log: PathBuf, columns: ColumnArgs) -> Self {
        Self { log, columns }
    }

    /// Reads the log, and leaves out motion where that was asked for.
    pub fn read(&self) -> Result<GyroRecording> {
        self.columns.read(&self.log)
    }

    /// The time axis since power-on: the log's own, or begun `--start-offset` after it.
    pub fn time_since_power_on(&self, recording: &GyroRecording) -> TimeAxis {
        self.columns.time_since_power_on(recording)
    }

    /// What the report says of the log.
    pub fn facts(&self, recording: &GyroRecording) -> LogFacts {
        let range = |values: &[f64]| {
            let there = values.iter().copied().filter(|v| v.is_finite());
            let (low, high) = there.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
            (low <= high).then_some([low, high])
        };
        LogFacts {
            name: self.log.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            column: recording.column.clone(),
            unit: recording.unit,
            sha256: recording.sha256.clone(),
            temperature_c: recording.log.get(names::TEMPERATURE).and_then(range),
            notes: self.notes(recording),
            audit: serde_json::json!(recording.audit),
        }
    }

    /// What was decided about the log, and what is wrong with it.
    fn notes(&self, recording: &GyroRecording) -> Vec<String> {
        let audit = &recording.audit;
        let mut notes = recording.notes.clone();
        notes.extend(audit.gaps.text());
        notes.extend(audit.findings());
        if let (false, Some(motion)) = (self.columns.trim_motion, audit.motion.text()) {
            notes.push(format!("the log moves, {motion}; --trim-motion leaves that out"));
        }
        notes
    }

    /// Names the file in an error of a layer that saw only numbers.
    pub fn named(&self, error: Error) -> Error {
        if error.input == "log" { error.named(self.log.display()) } else { error }
    }
}
