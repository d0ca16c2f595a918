//! wheel_left = (v - b ω)/r,  wheel_right = (v + b ω)/r: the wheels' speeds in a log, whatever form they have
//!
//! A robot's own odometry reports the speed v and the yaw rate ω that it made of its wheels; both go back into wheel
//! speeds without loss, so that a filter takes them as what they are: two readings of two wheels, and no gyro. Counted
//! ticks become the mean speeds since the last count ([`tick_speeds_rad_s`]).

use super::Rolling;
use crate::signal::{Log, names, tick_speeds_rad_s};
use std::borrow::Cow;

/// The wheels of a log; missing values are NaN.
#[derive(Debug, Clone, PartialEq)]
pub enum Odometry<'a> {
    /// Speeds of the left and the right wheel, rad/s.
    Wheels([Cow<'a, [f64]>; 2]),
    /// Speeds that were made of the log's ticks: means since the last count, rad/s.
    Counted([Vec<f64>; 2]),
    /// The speed of the whole alone, as of a car, m/s.
    Speed(&'a [f64]),
}

impl<'a> Odometry<'a> {
    /// The wheels' own speeds where the log has both, else those of its ticks of `tick_rad`, else those that the
    /// odometry's speed and yaw rate stand for, else the speed alone; `None` if no row has any.
    #[must_use]
    pub fn of(log: &'a Log, robot: &Rolling, tick_rad: Option<f64>) -> Option<Self> {
        if let Some(wheels) = pair(log, names::WHEEL_LEFT, names::WHEEL_RIGHT) {
            return Some(Self::Wheels(wheels.map(Cow::Borrowed)));
        }
        if let Some((counts, tick_rad)) = Self::counts(log).zip(tick_rad) {
            let times = log.time.to_vec();
            return Some(Self::Counted(counts.map(|n| tick_speeds_rad_s(&times, n, tick_rad))));
        }
        if let Some([speed, yaw_rate]) = pair(log, names::ODO_SPEED, names::ODO_YAW_RATE) {
            let rows = robot.wheel_by_motion();
            let wheel = |[by_speed, by_yaw]: [f64; 2]| {
                speed.iter().zip(yaw_rate).map(|(v, w)| by_speed * v + by_yaw * w).collect::<Vec<f64>>()
            };
            return Some(Self::Wheels(rows.map(|row| Cow::Owned(wheel(row)))));
        }
        log.get(names::ODO_SPEED).filter(|v| v.iter().any(|v| v.is_finite())).map(Self::Speed)
    }

    /// Ticks that both encoders have counted, if any row has both.
    #[must_use]
    pub fn counts(log: &'a Log) -> Option<[&'a [f64]; 2]> {
        pair(log, names::WHEEL_LEFT_TICKS, names::WHEEL_RIGHT_TICKS)
    }

    /// Speeds of the left and the right wheel, rad/s; `None` where the log has one speed for both.
    #[must_use]
    pub fn wheels(&self) -> Option<[&[f64]; 2]> {
        match self {
            Self::Wheels([left, right]) => Some([left, right]),
            Self::Counted([left, right]) => Some([left, right]),
            Self::Speed(_) => None,
        }
    }

    /// Whether the wheels' speeds were made of the odometry's speed and yaw rate.
    #[must_use]
    pub(crate) fn is_converted(&self) -> bool {
        matches!(self, Self::Wheels([Cow::Owned(_), _]))
    }
}

/// Both channels, if any row has both.
fn pair<'a>(log: &'a Log, a: &str, b: &str) -> Option<[&'a [f64]; 2]> {
    let both = [log.get(a)?, log.get(b)?];
    both[0].iter().zip(both[1]).any(|(a, b)| a.is_finite() && b.is_finite()).then_some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Vehicle;
    use crate::signal::TimeAxis;

    fn robot() -> Rolling {
        Rolling::new(&Vehicle {
            mass_kg: 10.0,
            yaw_inertia_kg_m2: 0.3,
            half_track_m: 0.2,
            steering: None,
            wheel_radius_m: 0.1,
            wheel_inertia_kg_m2: 0.0,
            viscous_friction_n_m_s: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        })
    }

    fn log(channels: &[(&str, [f64; 2])]) -> Log {
        let mut log = Log::new("test", TimeAxis::Explicit(vec![0.0, 1.0]));
        channels.iter().for_each(|(name, values)| log.push(*name, values.to_vec()).unwrap());
        log
    }

    #[test]
    fn speed_and_yaw_rate_become_the_wheels_that_made_them() {
        let log = log(&[(names::ODO_SPEED, [0.5, f64::NAN]), (names::ODO_YAW_RATE, [-0.4, 0.0])]);
        let found = Odometry::of(&log, &robot(), None).unwrap();
        assert!(found.is_converted());
        let Odometry::Wheels([left, right]) = found else { unreachable!() };
        let [v, w] = robot().speed_and_yaw_rate([left[0], right[0]]);
        assert!((v - 0.5).abs() < 1e-15 && (w + 0.4).abs() < 1e-15, "{v} {w}");
        assert!(left[1].is_nan() && right[1].is_nan());
    }

    #[test]
    fn the_wheels_own_speeds_come_first_and_empty_columns_do_not_count() {
        let nan = [f64::NAN; 2];
        let wheels = [(names::WHEEL_LEFT, [1.0, 2.0]), (names::WHEEL_RIGHT, [1.0, 2.0])];
        let odometry = [(names::ODO_SPEED, [9.0, 9.0]), (names::ODO_YAW_RATE, [9.0, 9.0])];
        let both = log(&[wheels, odometry].concat());
        let found = Odometry::of(&both, &robot(), None).unwrap();
        assert!(!found.is_converted() && matches!(found, Odometry::Wheels([left, _]) if left[0] == 1.0));
        let empty = log(&[(names::WHEEL_LEFT, nan), wheels[1], odometry[0]]);
        assert_eq!(Odometry::of(&empty, &robot(), None), Some(Odometry::Speed(&[9.0, 9.0])));
        assert_eq!(Odometry::of(&log(&[(names::ODO_SPEED, nan)]), &robot(), None), None);
    }
    #[test]
    fn ticks_count_after_the_wheels_speeds_and_before_an_odometry() {
        let ticks = [(names::WHEEL_LEFT_TICKS, [3.0, 5.0]), (names::WHEEL_RIGHT_TICKS, [0.0, -1.0])];
        let odometry = [(names::ODO_SPEED, [9.0, 9.0]), (names::ODO_YAW_RATE, [9.0, 9.0])];
        let counted = log(&[ticks, odometry].concat());
        let found = Odometry::of(&counted, &robot(), Some(0.5)).unwrap();
        let [left, right] = found.wheels().unwrap();
        assert!(matches!(found, Odometry::Counted(_)) && left[0].is_nan() && [left[1], right[1]] == [1.0, -0.5]);
        // ticks of unknown size tell nothing
        assert!(Odometry::of(&counted, &robot(), None).unwrap().is_converted());
        let both = log(&[ticks, [(names::WHEEL_LEFT, [1.0, 2.0]), (names::WHEEL_RIGHT, [1.0, 2.0])]].concat());
        assert!(matches!(Odometry::of(&both, &robot(), Some(0.5)), Some(Odometry::Wheels(_))));
        assert_eq!(Odometry::counts(&both), Some([&[3.0, 5.0][..], &[0.0, -1.0][..]]));
    }
}
