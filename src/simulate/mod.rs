//! Floor 3: the nominal simulator: readings by the model of a configuration.
//!
//! - [`stationary`]: a gyro at rest; [`stationary_with`] and [`stationary_like`]: with effects of reality
//! - [`drive`]: a robot that follows a [`Course`]; [`drive_with`]: with effects
//! - [`replay`]: a robot that is given the torques of another log; [`replay_with`]: with effects
//!
//! gyro = true rate + e(t) + white noise, t from power-on; wheels roll without slip ([`crate::vehicle::Rolling`]), or slip
//! where the configuration has `[traction]` ([`crate::vehicle::Slipping`]). With effects of drives the robot is that of
//! [`crate::model::drive`].
//! Row k's torques act from its time to the next row's; row k's sensors are read at its time. Encoders read the wheels'
//! speeds or, with `ticks_per_revolution`, count whole ticks of their true angles, speeds being differences of counts.
//! A gyro that was switched on again before it was cold goes on where it had cooled to ([`crate::bias::Restart`]).
//!
//! Random numbers come from named streams of explicit [`Seeds`]: the same seeds give the same bytes, and the same motion
//! can be recorded again with other sensor noise.

mod changed;
mod coloured;
mod course;
mod drive;
mod effects;
mod gyro;
mod plant;
mod rest;

pub use course::Course;
pub(crate) use course::Profile;
pub use drive::{Drive, drive, drive_with, replay, replay_with, truth_names};
pub(crate) use rest::scene;
pub(crate) use rest::scene_of_drive;
pub use rest::{stationary, stationary_like, stationary_with};

use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;

/// Seeds of the random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Seeds {
    /// Seed of the course and the torque noise: how the robot moves.
    pub motion: u64,
    /// Seed of gyro, encoder and pose noise: how the motion is recorded. A speed control that reads the encoders passes
    /// a little of their noise on to the motion; replayed torques do not.
    pub sensors: u64,
    /// Seed of the differences from one power-on to the next.
    pub turn_on: u64,
}

impl From<u64> for Seeds {
    fn from(seed: u64) -> Self {
        Self { motion: seed, sensors: seed, turn_on: seed }
    }
}

/// Options of a simulation, besides configuration and motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Seeds of the random streams.
    pub seeds: Seeds,
    /// Time since power-on at the first row, s.
    pub since_power_on_s: f64,
    /// Draw C1, C2 and T anew inside their stated repeatability (`turn_on_bias_std_rad_s`, `warm_up_relative_std`):
    /// C2 + σ n, C1 (1 + ρ n), T exp(ρ n). Without it the parameters are the nominal ones.
    pub vary_turn_on: bool,
    /// A warm restart: how long the gyro was off since the run that `[gyro.last_run]` tells of, s; else it was cold at
    /// power-on. The drawn T holds for that run and, where no cooling time constant is stated, for the pause.
    pub off_time_s: Option<f64>,
}

impl From<u64> for Options {
    fn from(seed: u64) -> Self {
        Self { seeds: seed.into(), since_power_on_s: 0.0, vary_turn_on: false, off_time_s: None }
    }
}

/// One random stream for each purpose. The numbers are part of "same seed, same bytes": never reuse or change one.
#[derive(Debug, Clone, Copy)]
enum Purpose {
    GyroWhite = 101,
    GyroWalk = 102,
    TurnOn = 103,
    GyroBefore = 104,
    /// And 1000 more for each further band.
    GyroBand = 105,
    TorqueLeft = 111,
    TorqueRight = 112,
    EncoderLeft = 121,
    EncoderRight = 122,
    TickLeft = 123,
    TickRight = 124,
    PoseX = 131,
    PoseY = 132,
    PoseHeading = 133,
    Course = 141,
}

impl Purpose {
    fn stream(self, seed: u64) -> Stream {
        Stream::new(seed, self as u64)
    }
}

/// Name of simulated logs in messages.
const SOURCE: &str = "simulation";

/// More rows than this are taken for a mistake: 200 million, 55 h at 1 kHz. They would exhaust the memory.
const ROWS_LIMIT: f64 = 2e8;

/// Sample time of simulator and sensors, s.
fn sample_time(config: &Config) -> Result<f64> {
    config.sample_time_s.ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the key is missing")
            .at("`sample_time_s`")
            .hint("add it at the top of the file: white noise depends on it")
    })
}

fn start(options: &Options) -> Result<f64> {
    let start_s = options.since_power_on_s;
    if start_s.is_finite() && start_s >= 0.0 {
        return Ok(start_s);
    }
    Err(Error::new(ErrorKind::Value, "simulation", format!("{start_s} s is not a time after power-on"))
        .at("start offset")
        .hint("give zero or a positive number of seconds"))
}

/// Rows from 0 to `duration_s`, both included.
fn rows(duration_s: f64, step_s: f64) -> Result<usize> {
    // a duration of a whole number of steps must not lose its last row to rounding
    let steps = (duration_s / step_s * (1.0 + 1e-12)).floor();
    let error = |found: String, hint: &str| Err(Error::new(ErrorKind::Value, SOURCE, found).at("duration").hint(hint));
    if !(duration_s.is_finite() && steps >= 1.0) {
        return error(
            format!("{duration_s} s is less than one sample time of {step_s} s"),
            "give a longer duration, in seconds",
        );
    }
    if steps >= ROWS_LIMIT {
        return error(format!("{steps:.0} rows are more than {ROWS_LIMIT:.0}"), "shorten it, or sample more slowly");
    }
    Ok(steps as usize + 1)
}

#[cfg(test)]
mod tests;
