//! Options of the commands that read a drive.

use super::log_values::{LOG_OPTIONS, parse_time_unit};
use super::mounting_args::MountingArgs;
use super::topic_args::{RawArgs, TopicArgs};
use clap::Args;
use gyroid::Result;
use gyroid::config::Config;
use gyroid::ingest::{self, ChannelMap, DriveQuery, DriveRecording};
use gyroid::units::TimeUnit;
use gyroid::vehicle::{known_by, wrong_signs};
use std::borrow::Cow;
use std::path::PathBuf;

/// How to read the columns of a drive.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = LOG_OPTIONS)]
pub(crate) struct DriveArgs {
    #[command(flatten)]
    topics: TopicArgs,
    /// Read a column as a channel, whatever it is called: gyro_z_rad_s=-wz:deg/s, x_m=east_m; may be given more than once
    #[arg(long, value_name = "CHANNEL=[-]COLUMN[:UNIT]")]
    map: Vec<String>,
    #[command(flatten)]
    mounting: MountingArgs,
    /// Column that holds the time
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
    /// Unit of the time: s, ms, us, ns
    #[arg(long, value_name = "UNIT", value_parser = parse_time_unit)]
    time_unit: Option<TimeUnit>,
    #[command(flatten)]
    raw: RawArgs,
}

impl DriveArgs {
    /// The options --map, as they were given.
    pub(super) fn maps(&self) -> String {
        self.map.iter().map(|map| format!(" --map {map}")).collect()
    }

    /// Reads the files as one drive of the robot of `config`.
    pub(super) fn read(&self, logs: &[PathBuf], config: &Config) -> Result<DriveRecording> {
        Ok(known(self.read_alone(logs)?, config))
    }

    /// Reads the files as one drive of whatever robot.
    pub(super) fn read_alone(&self, logs: &[PathBuf]) -> Result<DriveRecording> {
        let (time, time_unit) = (self.time.as_ref(), self.time_unit);
        let query = drive_query(&self.map, time, time_unit, &self.topics, &self.mounting, &self.raw)?;
        ingest::read_drive(logs, &query)
    }
}

/// A drive with the channels that follow from its own by the robot's dimensions (see [`known_by`]).
pub(super) fn known(mut recording: DriveRecording, config: &Config) -> DriveRecording {
    if let Some(vehicle) = &config.vehicle {
        let (log, notes) = known_by(vehicle, &recording.log);
        if let Cow::Owned(log) = log {
            recording.log = log;
        }
        recording.notes.extend(notes);
        recording.notes.extend(wrong_signs(vehicle, &recording.log));
    }
    recording
}

/// Query of a drive's columns.
///
/// # Errors
/// Those of maps and scales that cannot be read.
pub(super) fn drive_query(
    maps: &[String],
    time: Option<&String>,
    time_unit: Option<TimeUnit>,
    topics: &TopicArgs,
    mounting: &MountingArgs,
    raw: &RawArgs,
) -> Result<DriveQuery> {
    Ok(DriveQuery {
        maps: maps.iter().map(|text| ChannelMap::parse(text)).collect::<Result<_>>()?,
        time: time.cloned(),
        time_unit,
        topics: topics.topic.clone(),
        stamp: topics.stamp(),
        mounting: mounting.given(),
        scales: raw.scales()?,
        skip_bad_rows: raw.skip_bad_rows,
    })
}
