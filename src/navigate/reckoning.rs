//! dθ = ω dt,  dx = v cos θ dt,  dy = v sin θ dt, with v = r (right + left)/2 and ω = r (right - left)/(2 b), or the gyro's ω
//!
//! The baselines, without a filter: encoders alone, and the gyro as it is, its error and all, with the encoders' speed.
//! Speeds are linear between their samples, also where they are missing in rows between. Where ticks are counted, each
//! row's way is that of its own ticks, so that no rounding adds up; a count that is missing lies between its neighbours.

use super::Settings;
use super::compare::{Track, aligned_errors};
use super::reference::{self, ErrorSums, Reference, ReferenceErrors};
use super::sensors::{gyro, no_yaw_rate, odometry};
use crate::config::Config;
use crate::error::Result;
use crate::signal::{Log, increasing_times, tick_speeds_rad_s};
use crate::vehicle::{Forcing, Motion, Odometry, Rolling, advance};

/// Dead reckoning over a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Reckoning {
    /// Motion at each row.
    pub motion: Vec<Motion>,
    /// Errors against the reference, where the log has one.
    pub reference: Option<ReferenceErrors>,
}

/// Speed or yaw rate of each row.
struct Rate {
    values: Vec<f64>,
    /// Whether they are means since the row before; else they are linear between the rows.
    means: bool,
}

/// Integrates the encoders of `log` from x = y = θ = 0, or from the reference's first pose
/// (`settings.start_at_reference`).
///
/// # Errors
/// [`crate::ErrorKind::Config`] without `[vehicle]`; [`crate::ErrorKind::Column`] without the speeds of both wheels, and
/// without the reference that is to be started at; [`crate::ErrorKind::Time`] if time does not run forward.
pub fn dead_reckoning(config: &Config, log: &Log, settings: &Settings) -> Result<Reckoning> {
    let times = increasing_times(log)?;
    let [speed, yaw_rate] = by_wheels(config, log, &times)?.ok_or_else(|| no_yaw_rate(log))?;
    integrate(config, log, settings, &times, &speed, &yaw_rate)
}

/// As [`dead_reckoning`], with the yaw rate of the gyro as it reads, uncorrected.
///
/// # Errors
/// As [`dead_reckoning`], but for the encoders the speed is enough; [`crate::ErrorKind::Column`] without a gyro.
pub fn gyro_reckoning(config: &Config, log: &Log, settings: &Settings) -> Result<Reckoning> {
    let rates = gyro(log).ok_or_else(|| no_yaw_rate(log))?;
    let times = increasing_times(log)?;
    let speed = match (by_wheels(config, log, &times)?, odometry(config, log)?) {
        (None, Odometry::Speed(speed)) => Rate { values: bridged(&times, speed), means: false },
        (None, _) => return Err(no_yaw_rate(log)),
        (Some([speed, _]), _) => speed,
    };
    let yaw_rate = Rate { values: bridged(&times, rates), means: false };
    integrate(config, log, settings, &times, &speed, &yaw_rate)
}

/// Speed and yaw rate of two wheels, by their ticks where they are counted; `None` where the log has one speed for both.
fn by_wheels(config: &Config, log: &Log, times: &[f64]) -> Result<Option<[Rate; 2]>> {
    let robot = Rolling::new(config.require_vehicle()?);
    let counted = Odometry::counts(log).zip(config.encoder.and_then(|e| e.tick_rad()));
    let odometry = odometry(config, log)?;
    let (wheels, means) = match (counted, odometry.wheels()) {
        (Some((counts, tick_rad)), _) => (counts.map(|n| tick_speeds_rad_s(times, &bridged(times, n), tick_rad)), true),
        (None, Some(wheels)) => (wheels.map(|w| bridged(times, w)), false),
        (None, None) => return Ok(None),
    };
    let of = |i: usize| {
        let rate = |(left, right): (&f64, &f64)| robot.speed_and_yaw_rate([*left, *right])[i];
        let mut values: Vec<f64> = wheels[0].iter().zip(&wheels[1]).map(rate).collect();
        // nothing was counted before the first row
        if let (true, [first, second, ..]) = (means, values.as_mut_slice()) {
            *first = *second;
        }
        Rate { values, means }
    };
    Ok(Some([of(0), of(1)]))
}

/// Integrates speed and yaw rate of each row.
fn integrate(
    config: &Config,
    log: &Log,
    settings: &Settings,
    times: &[f64],
    speed: &Rate,
    yaw_rate: &Rate,
) -> Result<Reckoning> {
    let reference = Reference::new(log, config.pose.as_ref());
    let mut m = Motion::default();
    if let Some(pose) = reference::start(log, reference.as_ref(), settings)? {
        [m.x_m, m.y_m, m.heading_rad] = pose;
    }
    let mut errors = ErrorSums::default();
    let mut motion = Vec::with_capacity(times.len());
    for (k, t) in times.iter().enumerate() {
        let to = [speed.values[k], yaw_rate.values[k]];
        if k == 0 || speed.means {
            m.speed_m_s = to[0];
        }
        if k == 0 || yaw_rate.means {
            m.yaw_rate_rad_s = to[1];
        }
        if k > 0 {
            let dt = t - times[k - 1];
            m = advance(&m, &Forcing::between(m.velocity(), to, dt), dt);
        }
        if let Some(reference) = &reference {
            errors.add(reference, k, [m.x_m, m.y_m, m.heading_rad], None);
        }
        motion.push(m);
    }
    let errors = match reference.as_ref().and_then(|r| Some((r, r.share(settings)?))) {
        None => errors.finish(),
        Some((reference, share)) => {
            let column = |of: fn(&Motion) -> f64| motion.iter().map(of).collect::<Vec<f64>>();
            let [x_m, y_m, heading_rad] = [column(|m| m.x_m), column(|m| m.y_m), column(|m| m.heading_rad)];
            let track = Track { x_m: &x_m, y_m: &y_m, heading_rad: &heading_rad };
            aligned_errors(reference, times, &track, share)
        }
    };
    Ok(Reckoning { motion, reference: errors })
}

/// Values with the missing ones on the line between their neighbours; before the first and after the last they are held.
fn bridged(times: &[f64], values: &[f64]) -> Vec<f64> {
    let there: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    let (Some(&first), Some(&last)) = (there.first(), there.last()) else { return vec![0.0; values.len()] };
    let mut out = values.to_vec();
    out[..first].fill(values[first]);
    out[last..].fill(values[last]);
    for ends in there.windows(2) {
        let (a, b) = (ends[0], ends[1]);
        for k in a + 1..b {
            let share = (times[k] - times[a]) / (times[b] - times[a]);
            out[k] = values[a] + share * (values[b] - values[a]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_values_lie_between_their_neighbours() {
        let times = [0.0, 1.0, 2.0, 4.0, 5.0, 6.0];
        let nan = f64::NAN;
        assert_eq!(bridged(&times, &[nan, 1.0, nan, 4.0, nan, nan]), [1.0, 1.0, 2.0, 4.0, 4.0, 4.0]);
        assert_eq!(bridged(&times[..2], &[nan, nan]), [0.0; 2]);
    }
}
