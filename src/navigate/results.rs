//! The results of the filter over a log: the track row by row, and the run in numbers.

use super::consistency::Consistency;
use super::reading::{Innovation, Sensor};
use super::reference::ReferenceErrors;
use super::standstill::StandstillSummary;
use super::table::WheelSlip;
use crate::signal::Log;
use serde::Serialize;

/// A filter's pass over a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Results in numbers.
    pub summary: Summary,
    /// The estimate at each row, after its readings: pose, velocities, gyro error, their standard deviations, NIS.
    pub pose: Log,
    /// The same given all readings of the log, where the settings ask for it.
    pub smoothed: Option<Smoothed>,
    /// Each reading's time, s, its sensor and its innovation, in the order in which the filter took them in; empty where the
    /// settings do not ask for them.
    pub innovations: Vec<(f64, Sensor, Innovation)>,
}

/// Rows given all readings of the log: one path, where the filter's rows jump from one to the next as it learns.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothed {
    /// As [`Run::pose`]. NIS is the filter's.
    pub pose: Log,
    /// Errors against the reference pose, where the log has one.
    pub reference: Option<ReferenceErrors>,
}

/// A run in numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Rows of the log.
    pub rows: u64,
    /// From the first row to the last, s.
    pub span_s: f64,
    /// Time since power-on at the first row, s.
    pub since_power_on_s: f64,
    /// Whether the log lacks the time since power-on, so that it was taken from the settings.
    pub since_power_on_assumed: bool,
    /// Age of the gyro's warm-up at the last row, s: the time on since a cold power-on, or the time that would have
    /// warmed it as far at the configuration's time constant. What `[gyro.last_run]` takes for a later restart.
    pub warm_up_age_end_s: f64,
    /// Whether the filter let the wheels slip.
    pub slip_modelled: bool,
    /// Slip of the left and the right wheel, where it is modelled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<[WheelSlip; 2]>,
    /// Whether the log's torques drove the prediction; else accelerations were taken as unknown and white.
    pub torques_used: bool,
    /// Densities of unknown accelerations, (m/s²)²/Hz and (rad/s²)²/Hz, where rows had no torques.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceleration_densities: Option<[f64; 2]>,
    /// Reduction of the gyro error's uncertainty at standstill; `None` where no row counted as standstill.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standstill: Option<StandstillSummary>,
    /// NIS and whiteness of the innovations.
    pub consistency: Consistency,
    /// The pose at the last row.
    pub final_pose: FinalPose,
    /// Errors against the reference pose, where the log has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceErrors>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// An estimate with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub estimate: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// Pose and gyro error at the end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FinalPose {
    /// x, m.
    pub x_m: Estimate,
    /// y, m.
    pub y_m: Estimate,
    /// Heading, rad.
    pub heading_rad: Estimate,
    /// Gyro error, rad/s.
    pub gyro_error_rad_s: Estimate,
}
