//! reading - z, z the mean reading of the first seconds at rest: the gyro zeroed at the start, as most robots have it
//!
//! The rival of an error model: it costs nothing, and holds as long as the bias does. The robot is at rest until a wheel's speed
//! is first beyond its noise: four standard deviations of the encoder, and one and a half ticks where they are counted.

use super::sensors::{gyro, odometry};
use crate::config::Config;
use crate::error::Result;
use crate::signal::{Log, increasing_times, names};
use crate::vehicle::Odometry;

/// Standard deviations of a speed within which a wheel is taken for still.
const WITHIN: f64 = 4.0;
/// Ticks within which a counted one is.
const TICKS: f64 = 1.5;
/// A speed below this share of the largest is zero but for rounding.
const ROUNDING: f64 = 1e-9;
/// A shorter rest zeroes no gyro, s.
const SHORTEST_S: f64 = 0.9;

/// A log whose gyro was zeroed.
#[derive(Debug, Clone, PartialEq)]
pub struct Zeroed {
    /// The log with its gyro less `zero_rad_s`.
    pub log: Log,
    /// Mean reading at rest, rad/s.
    pub zero_rad_s: f64,
    /// How long the robot was at rest, s.
    pub rest_s: f64,
}

/// `log` with its gyro zeroed at the start; `None` without a gyro, and where the log does not begin with a second at rest.
///
/// # Errors
/// [`crate::ErrorKind::Config`] without `[vehicle]`; [`crate::ErrorKind::Column`] without speeds of wheels;
/// [`crate::ErrorKind::Time`] if time does not run forward.
pub fn zeroed_at_start(config: &Config, log: &Log) -> Result<Option<Zeroed>> {
    let Some(rates) = gyro(log) else { return Ok(None) };
    let times = increasing_times(log)?;
    let odometry = odometry(config, log)?;
    let encoder = *config.require_encoder()?;
    let (speeds, gain) = match (&odometry, odometry.wheels()) {
        (Odometry::Speed(speed), _) => (vec![*speed], config.require_vehicle()?.wheel_radius_m),
        (_, wheels) => (wheels.into_iter().flatten().collect::<Vec<_>>(), 1.0),
    };
    let step_s = log.time.median_step_s();
    let tick = encoder.tick_rad().map_or(0.0, |tick| TICKS * tick / step_s);
    let moves = |speed: &&[f64]| {
        let largest = speed.iter().filter(|v| v.is_finite()).fold(0.0f64, |most, v| most.max(v.abs()));
        let still = (gain * (WITHIN * encoder.speed_noise_std_rad_s + tick)).max(ROUNDING * largest);
        speed.iter().position(|v| v.abs() > still).unwrap_or(speed.len())
    };
    let rows = speeds.iter().map(moves).min().unwrap_or(0).min(times.len());
    let rest_s = if rows == 0 { 0.0 } else { times[rows - 1] - times[0] + step_s };
    let read: Vec<f64> = rates[..rows.min(rates.len())].iter().copied().filter(|w| w.is_finite()).collect();
    if rest_s < SHORTEST_S || read.is_empty() {
        return Ok(None);
    }
    let zero_rad_s = read.iter().sum::<f64>() / read.len() as f64;
    let mut log = log.clone();
    for channel in log.channels.iter_mut().filter(|c| c.name == names::GYRO_Z) {
        channel.values.iter_mut().for_each(|w| *w -= zero_rad_s);
    }
    Ok(Some(Zeroed { log, zero_rad_s, rest_s }))
}
