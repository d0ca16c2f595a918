//! Options on the messages of a log, and on its numbers and rows.

use super::log_values::LOG_OPTIONS;
use clap::Args;
use gyroid::ingest::{Scale, Stamp};
use gyroid::{Error, ErrorKind, Result};

/// Which messages of a log count, and which of their times.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = LOG_OPTIONS)]
pub(crate) struct TopicArgs {
    /// Topic of a log that holds several, such as /imu/data, sensor_gyro/1, IMU/0; otherwise the only one with a gyro. May
    /// be given more than once for a drive, and for fit, which makes a row of each; `fit --topic all` takes every one with a gyro
    #[arg(long, value_name = "NAME")]
    pub(super) topic: Vec<String>,
    /// Which time of a message counts: that in it, or that of its receipt
    #[arg(long, value_enum, default_value_t = ClockName::Header)]
    clock: ClockName,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ClockName {
    Header,
    Receipt,
}

/// Value of `--topic` that stands for every topic with a gyro.
pub(super) const EVERY_TOPIC: &str = "all";

impl TopicArgs {
    /// The one topic of a log at rest.
    pub(super) fn one(&self) -> Result<Option<&str>> {
        match &self.topic[..] {
            [] => Ok(None),
            [all] if all == EVERY_TOPIC => {
                Err(Error::new(ErrorKind::Usage, "--topic all", "is more than one topic of a log at rest")
                    .hint("name one topic; gyroid fit takes all"))
            }
            [one] => Ok(Some(one)),
            several => Err(Error::new(ErrorKind::Usage, "--topic", format!("{} topics are named", several.len()))
                .hint("name one topic of a log at rest")),
        }
    }

    pub(super) fn stamp(&self) -> Stamp {
        match self.clock {
            ClockName::Header => Stamp::Header,
            ClockName::Receipt => Stamp::Receipt,
        }
    }
}

/// Numbers and rows that are not as they should be.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = LOG_OPTIONS)]
pub(crate) struct RawArgs {
    /// Multiply a column, or a channel, by a factor: gz_raw=1/131:deg/s, gyro_z_rad_s=1.02; may be given more than once
    #[arg(long, value_name = "NAME=FACTOR[:UNIT]")]
    scale: Vec<String>,
    /// Leave out rows of text that do not parse, count them and tell the first few, instead of refusing the file
    #[arg(long)]
    pub(super) skip_bad_rows: bool,
}

impl RawArgs {
    pub(super) fn scales(&self) -> Result<Vec<Scale>> {
        self.scale.iter().map(|text| Scale::parse(text)).collect()
    }
}
