//! Floor 3: the navigation filter that consumes the configuration, and whether it is consistent.
//!
//! - [`RollingFilter`], [`SlipFilter`]: extended Kalman filters, step by step, of wheels that roll or slip
//! - [`run`]: the filter over a log, with NIS, whiteness of the innovations, and errors against a reference
//! - [`run_with`]: the same with the configuration's effects in the filter's model
//! - [`dead_reckoning`], [`gyro_reckoning`]: encoders alone, and with the gyro as it is: the baselines
//! - [`zeroed_at_start`]: the log with its gyro zeroed while it is at rest: the rival of an error model
//! - [`compare`]: a track beside the reference, row by row
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
//! Where the configuration has `[gyro.temperature]` and the drive a temperature, [`run`] goes by that instead of the warm-up.
//!
//! The filter knows at each row what was read up to it; where a path is wanted that does not jump as it learns more, each row's
//! estimate given the whole log is [`Run::smoothed`].
//!
//! While the robot stands, the filter learns the gyro's error from v = 0 and ω = 0 ([`Standstill`]); by default only where
//! both wheels read zero but for rounding, because a robot whose motors are commanded to rest may still creep.

mod align;
mod augmented;
mod changed_model;
mod compare;
mod consistency;
mod filter;
mod gyro_changes;
mod gyro_error;
mod model;
mod reading;
mod reckoning;
mod reference;
mod results;
mod rolling_model;
mod run;
mod sensors;
mod slip_model;
mod smoother;
mod standstill;
mod table;
mod temperature;
mod ticks;
mod ud;
mod unscented;
mod zeroed;

pub use align::Alignment;
pub use augmented::run_with;
pub use compare::{Comparison, Track, compare};
pub use consistency::{Consistency, SensorConsistency};
pub use filter::{Filter, RollingFilter, SlipFilter};
pub(crate) use gyro_error::{Decay, LN_TIME_CONSTANT_REACH, Prior};
pub use model::{Expected, Input, MotionModel, Transition, state};
pub use reading::{Innovation, Sensor};
pub use reckoning::{Reckoning, dead_reckoning, gyro_reckoning};
pub use reference::ReferenceErrors;
pub use results::{Estimate, FinalPose, Run, Smoothed, Summary};
pub use rolling_model::RollingModel;
pub use run::run;
pub use slip_model::SlipModel;
pub(crate) use standstill::TURN_RAD_S;
pub use standstill::{Standstill, StandstillSummary};
pub use table::{WheelSlip, names};
pub use ud::UdCovariance;
pub(crate) use unscented::UnscentedFilter;
pub use zeroed::{Zeroed, zeroed_at_start};

/// Model of the gyro's error in the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ErrorModel {
    /// The configuration's warm-up model, estimated along with the pose.
    #[default]
    WarmUp,
    /// No error: the filter of a user without the model, for comparison.
    Off,
}

/// Motion of the wheels in the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WheelModel {
    /// With slip where the configuration has `[traction]` and the log has torques, else without.
    #[default]
    Auto,
    /// Without slip.
    Rolling,
    /// With slip, by the configuration's `[traction]`.
    Slip,
}

/// How the filter is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Whether the gyro's error is modelled.
    pub error_model: ErrorModel,
    /// Whether wheels slip.
    pub wheels: WheelModel,
    /// Whether the reference pose is taken in as a measurement; else it is only compared with.
    pub use_pose: bool,
    /// Whether to start at the reference's first pose instead of x = y = θ = 0.
    pub start_at_reference: bool,
    /// Share of the reference's path, from its beginning, over which the track is aligned with the reference before
    /// they are compared ([`Alignment`]); 0: not at all. `None`: `Alignment::DEFAULT_SHARE` where the reference has
    /// no heading, else 0.
    pub align_share: Option<f64>,
    /// Leave out readings whose NIS is beyond this quantile of chi-squared. Off by default: a gate hides from NIS what
    /// is wrong with a model, and a filter that begins wrong can shut out the readings that would correct it.
    pub gate_probability: Option<f64>,
    /// Time since power-on at the first row, s, for logs that do not say.
    pub since_power_on_s: f64,
    /// Densities of unknown accelerations, (m/s²)²/Hz and (rad/s²)²/Hz, for rows without torques; without them they
    /// are measured on the log's own motion (see [`run`]).
    pub acceleration_densities: Option<[f64; 2]>,
    /// A warm restart: how long the gyro was off since the run that `[gyro.last_run]` tells of, s. Without it, or
    /// after a long pause, the gyro was cold at power-on.
    pub off_time_s: Option<f64>,
    /// Rule for standstill; `None`: no row counts as standstill.
    pub standstill: Option<Standstill>,
    /// Whether to smooth: each row's estimate given all readings of the log ([`Run::smoothed`]), beside that given the readings up
    /// to it.
    pub smooth: bool,
    /// Whether to keep each reading's innovation ([`Run::innovations`]).
    pub innovations: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            error_model: ErrorModel::default(),
            wheels: WheelModel::default(),
            use_pose: false,
            start_at_reference: false,
            align_share: None,
            gate_probability: None,
            since_power_on_s: 0.0,
            acceleration_densities: None,
            off_time_s: None,
            standstill: Some(Standstill::EXACT),
            smooth: false,
            innovations: false,
        }
    }
}

/// The angle in (-π, π].
#[must_use]
pub(crate) fn wrap_angle(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let wrapped = angle_rad.rem_euclid(TAU);
    if wrapped > PI { wrapped - TAU } else { wrapped }
}
