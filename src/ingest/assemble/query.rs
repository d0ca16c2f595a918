//! The user's choices in reading a gyro at rest.

use crate::ingest::columns::mounting::Mounting;
use crate::ingest::columns::names::Axis;
use crate::ingest::columns::scale::Scale;
use crate::ingest::formats::topics::Stamp;
use crate::units::{RateUnit, TimeUnit};

/// The user's choices in reading a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GyroQuery {
    /// Name of the rate column; otherwise it is found by its name and `axis`.
    pub column: Option<String>,
    /// Axis of the gyro; with a `mounting`, of the robot.
    pub axis: Axis,
    /// Whether that axis points down instead of up, so that its rates change their sign.
    pub reversed: bool,
    /// How the sensor is mounted in the robot, whose axis is then read: it takes the rates of the sensor's axes.
    pub mounting: Option<Mounting>,
    /// Unit of the rate column; it is then neither guessed nor doubted.
    pub unit: Option<RateUnit>,
    /// Name of the time column.
    pub time: Option<String>,
    /// Unit of the time column.
    pub time_unit: Option<TimeUnit>,
    /// Sample rate, Hz, of a file without times; the first row is then at power-on.
    pub rate_hz: Option<f64>,
    /// Whether rows that go back in time are sorted instead of refused.
    pub sort_time: bool,
    /// Topic of a log that holds several; otherwise the only one with a gyro.
    pub topic: Option<String>,
    /// Which of the two times of a message counts.
    pub stamp: Stamp,
    /// Factors on columns.
    pub scales: Vec<Scale>,
    /// Whether rows of text that do not parse are left out, and counted, instead of refused.
    pub skip_bad_rows: bool,
}
