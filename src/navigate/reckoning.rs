//! dθ = ω dt,  dx = v cos θ dt,  dy = v sin θ dt, with v = r (right + left)/2 and ω = r (right - left)/(2 b)
//!
//! Encoders alone, without gyro and without a filter: the baseline. Speeds are linear between the rows.

use super::Settings;
use super::reference::{ErrorSums, Reference, ReferenceErrors};
use crate::config::Config;
use crate::error::Result;
use crate::signal::{Log, increasing_times, names};
use crate::vehicle::{Forcing, Motion, Rolling, advance};

/// Dead reckoning over a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Reckoning {
    /// Motion at each row.
    pub motion: Vec<Motion>,
    /// Errors against the reference pose, where the log has one.
    pub reference: Option<ReferenceErrors>,
}

/// Integrates the encoders of `log` from x = y = θ = 0, or from the reference's first pose
/// (`settings.start_at_reference`). Where a wheel speed is missing, the speeds of the last whole row go on.
///
/// # Errors
/// [`crate::ErrorKind::Config`] without `[vehicle]`; [`crate::ErrorKind::Column`] without wheel speeds;
/// [`crate::ErrorKind::Time`] if time does not run forward.
pub fn dead_reckoning(config: &Config, log: &Log, settings: &Settings) -> Result<Reckoning> {
    let robot = Rolling::new(config.require_vehicle()?);
    let [left, right] = [log.require(names::WHEEL_LEFT)?, log.require(names::WHEEL_RIGHT)?];
    let times = increasing_times(log)?;
    let reference = Reference::new(log, config.pose.as_ref());
    let mut m = Motion::default();
    if let (true, Some((_, pose))) = (settings.start_at_reference, reference.as_ref().and_then(Reference::first)) {
        [m.x_m, m.y_m, m.heading_rad] = pose;
    }
    let mut errors = ErrorSums::default();
    let mut motion = Vec::with_capacity(times.len());
    for (k, t) in times.iter().enumerate() {
        let [speed, yaw_rate] = match [left[k], right[k]] {
            wheels if wheels.iter().all(|w| w.is_finite()) => robot.speed_and_yaw_rate(wheels),
            _ => [m.speed_m_s, m.yaw_rate_rad_s],
        };
        if k == 0 {
            [m.speed_m_s, m.yaw_rate_rad_s] = [speed, yaw_rate];
        } else {
            let dt = t - times[k - 1];
            let forcing = Forcing {
                acceleration_m_s2: (speed - m.speed_m_s) / dt,
                yaw_acceleration_rad_s2: (yaw_rate - m.yaw_rate_rad_s) / dt,
                ..Forcing::default()
            };
            m = advance(&m, &forcing, dt);
        }
        if let Some(reference) = &reference {
            errors.add(reference, k, [m.x_m, m.y_m, m.heading_rad], None);
        }
        motion.push(m);
    }
    Ok(Reckoning { motion, reference: errors.finish() })
}
