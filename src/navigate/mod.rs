//! Floor 3: the navigation filter that consumes the configuration, and whether it is consistent.
//!
//! - [`RollingFilter`]: extended Kalman filter, step by step
//! - [`run`]: the filter over a log, with NIS, whiteness of the innovations, and errors against a reference
//! - [`dead_reckoning`]: encoders alone, the baseline
//!
//! ```
//! use gyroid::config::Config;
//! use gyroid::navigate::{ErrorModel, Settings, run};
//! use gyroid::simulate::{Course, Options, drive};
//!
//! let config = Config::parse(
//!     "schema = 1\nkind = \"driving\"\nsample_time_s = 0.01\n\
//!      [gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\nangle_random_walk_rad_sqrt_s = 1.5e-4\n\
//!      turn_on_bias_std_rad_s = 2e-4\n\
//!      [vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
//!      wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
//!      [encoder]\nspeed_noise_std_rad_s = 0.02\n\
//!      [pose]\nrate_hz = 5.0\nposition_std_m = 0.002\nheading_std_rad = 0.002\n",
//!     "robot.toml",
//! )?;
//! let recorded = drive(&config, Course::Square, 60.0, &Options::from(1))?.log;
//! let with = run(&config, &recorded, &Settings::default())?.summary;
//! let without = run(&config, &recorded, &Settings { error_model: ErrorModel::Off, ..Settings::default() })?.summary;
//! assert!(with.consistency.nis_mean < 0.5 * without.consistency.nis_mean);
//! # Ok::<(), gyroid::Error>(())
//! ```
//!
//! There is no zero-rate update at standstill: the model's torque noise moves a robot whose motors are commanded to
//! rest, so that still wheels say no more than the encoders' noise allows, and that the filter knows already.

mod consistency;
mod filter;
mod gyro_error;
mod reckoning;
mod reference;
mod run;
mod ud;

pub use consistency::{Consistency, SensorConsistency};
pub use filter::{Innovation, Input, RollingFilter, STATES, Sensor, state};
pub use gyro_error::LN_TIME_CONSTANT_STD_LIMIT;
pub use reckoning::{Reckoning, dead_reckoning};
pub use reference::ReferenceErrors;
pub use run::{Estimate, FinalPose, Run, Summary, names, run};
pub use ud::UdCovariance;

/// What the filter holds the gyro's error to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ErrorModel {
    /// The configuration's warm-up model, estimated along with the pose.
    #[default]
    WarmUp,
    /// No error: what a user without the model has, for comparison.
    Off,
}

/// How the filter is run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// Whether the gyro's error is modelled.
    pub error_model: ErrorModel,
    /// Whether the reference pose is taken in as a measurement; else it is only compared with.
    pub use_pose: bool,
    /// Whether to start at the reference's first pose instead of x = y = θ = 0.
    pub start_at_reference: bool,
    /// Leave out readings whose NIS is beyond this quantile of chi-squared. Off by default: a gate hides from NIS what
    /// is wrong with a model, and a filter that begins wrong can shut out the readings that would mend it.
    pub gate_probability: Option<f64>,
    /// Time since power-on at the first row, s, for logs that do not say.
    pub since_power_on_s: f64,
    /// Densities of unknown accelerations, (m/s²)²/Hz and (rad/s²)²/Hz, for rows without torques; without them they
    /// are measured on the log's own encoders (see [`run`]).
    pub acceleration_densities: Option<[f64; 2]>,
}

/// The angle in (-π, π].
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}
