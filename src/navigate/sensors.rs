//! Which sensors a log has for the filter, and how strongly the robot accelerates where nobody knows its torques.

use super::Settings;
use super::reading::Sensor;
use super::ticks::{self, MeanSpeed};
use crate::config::{Config, Gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, names};
use crate::vehicle::{Odometry, Rolling, one_wheel};

/// The readings that a filter takes in, row by row.
pub(super) struct Sensors<'a> {
    /// Each sensor that is read at its row, with its column.
    pub readings: Vec<(Sensor, &'a [f64])>,
    /// Speeds that are made of ticks, and sensors that are late: they are read between the rows, in the order of their times.
    pub means: Vec<MeanSpeed>,
    /// Columns of the wheels, however they are read, and of sensors that are late.
    wheels: Vec<(Sensor, &'a [f64])>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// The gyro's column, if any row has a reading.
pub(super) fn gyro(log: &Log) -> Option<&[f64]> {
    log.get(names::GYRO_Z).filter(|rates| rates.iter().any(|w| w.is_finite()))
}

/// A configuration for a log without a gyro: its gyro then has no error and is never read.
pub(super) fn without_gyro(config: &Config) -> Config {
    let unread = Gyro::without_error(1.0);
    let sample_time_s = config.sample_time_s.or(Some(1.0));
    Config { gyro: Some(unread), sample_time_s, validation: None, ..config.clone() }
}

/// The wheels of a log.
///
/// # Errors
/// [`ErrorKind::Column`] without wheel speeds, ticks and speed, [`ErrorKind::Value`] if they are all missing,
/// [`ErrorKind::Config`] where there are ticks alone and the ticks of a revolution are not stated.
pub(super) fn odometry<'a>(config: &Config, log: &'a Log) -> Result<Odometry<'a>> {
    let tick_rad = config.encoder.and_then(|e| e.tick_rad());
    Odometry::of(log, &Rolling::new(config.require_vehicle()?), tick_rad).ok_or_else(|| {
        if Odometry::counts(log).is_some() {
            let found = format!("the key is missing, and {} has ticks and no speeds", log.source);
            return Error::new(ErrorKind::Config, "configuration", found)
                .at("`encoder.ticks_per_revolution`")
                .hint("add the ticks of one turn of the wheel, gear included");
        }
        if let Some((found, hint)) = one_wheel(log) {
            return Error::new(ErrorKind::Column, &log.source, found).hint(hint);
        }
        let [left, right, speed] = [names::WHEEL_LEFT, names::WHEEL_RIGHT, names::ODO_SPEED];
        let empty = log.get(speed).is_some() || (log.get(left).is_some() && log.get(right).is_some());
        let kind = if empty { ErrorKind::Value } else { ErrorKind::Column };
        let found = format!(
            "no row tells the speed: there are no numbers in both wheel speeds ({left}, {right}), nor in {speed}; \
             the channels are {}",
            listed(log)
        );
        Error::new(kind, &log.source, found).hint(format!("name the column that does: --map {speed}=COLUMN[:UNIT]"))
    })
}

/// Error for a log without a source of the yaw rate.
pub(super) fn no_yaw_rate(log: &Log) -> Error {
    let (gyro, odometry) = (names::GYRO_Z, names::ODO_YAW_RATE);
    let found = format!(
        "no row tells the yaw rate: there are no numbers in {gyro}, and no wheel speeds of two sides; the channels are {}",
        listed(log)
    );
    Error::new(ErrorKind::Column, &log.source, found)
        .hint(format!("name the column that does: --map {gyro}=COLUMN[:UNIT], or {odometry} if it is by the wheels"))
}

fn listed(log: &Log) -> String {
    log.channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ")
}

impl<'a> Sensors<'a> {
    /// The sensors of `log` at `times`: the gyro where there is one, the wheels or else the speed, and the pose if it is to
    /// be used.
    pub(crate) fn of(
        odometry: &'a Odometry<'a>,
        log: &'a Log,
        times: &[f64],
        config: &Config,
        settings: &Settings,
    ) -> Result<Self> {
        let mut notes = Vec::new();
        let mut readings = Vec::new();
        let gyro = gyro(log);
        readings.extend(gyro.map(|rates| (Sensor::Gyro, rates)));
        let wheels = match odometry {
            Odometry::Speed(_) if gyro.is_none() => return Err(no_yaw_rate(log)),
            Odometry::Speed(speed) => {
                notes.push("the log has one speed for both sides: heading is by the gyro alone".into());
                vec![(Sensor::Speed, *speed)]
            }
            Odometry::Wheels(_) | Odometry::Counted(_) => {
                if odometry.is_converted() {
                    notes.push("wheel speeds are made of the odometry's speed and yaw rate".into());
                }
                if gyro.is_none() {
                    notes.push("the log has no gyro: heading is by the wheels alone".into());
                }
                [Sensor::WheelLeft, Sensor::WheelRight]
                    .into_iter()
                    .zip(odometry.wheels().into_iter().flatten())
                    .collect()
            }
        };
        let counts = Odometry::counts(log);
        let means = if config.require_encoder()?.tick_rad().is_some() {
            let counts = counts.filter(|_| matches!(odometry, Odometry::Counted(_)));
            ticks::mean_speeds(&wheels, counts, times)
        } else {
            readings.extend(wheels.iter().copied());
            if counts.is_some() {
                notes.push("the log's ticks are not used: encoder.ticks_per_revolution is not stated".into());
            }
            Vec::new()
        };
        if settings.use_pose {
            if config.pose.is_none() {
                return Err(Error::new(ErrorKind::Config, "configuration", "the table [pose] is missing")
                    .hint("add it with the reference's standard deviations, or do not use the pose"));
            }
            for (sensor, name) in
                [(Sensor::PoseX, names::X), (Sensor::PoseY, names::Y), (Sensor::PoseHeading, names::HEADING)]
            {
                readings.push((sensor, log.require(name)?));
            }
        }
        Ok(Self { readings, means, wheels, notes })
    }

    /// Replaces the gyro's column by these values.
    pub(crate) fn replace_gyro(&mut self, values: &'a [f64]) {
        self.readings.iter_mut().filter(|r| r.0 == Sensor::Gyro).for_each(|r| r.1 = values);
    }

    /// Takes each reading of these sensors in `delay_s` before its time; what lies before the first row is left out, and so is
    /// what lies after the last one.
    pub(crate) fn delay(&mut self, late: &[Sensor], delay_s: f64, times: &[f64]) {
        if delay_s == 0.0 {
            return;
        }
        let before = |middle_s: f64| {
            let row = times.partition_point(|t| *t <= middle_s).checked_sub(1)?;
            (row + 1 < times.len()).then_some(row)
        };
        let (moved, mut means): (Vec<MeanSpeed>, Vec<MeanSpeed>) =
            std::mem::take(&mut self.means).into_iter().partition(|m| late.contains(&m.sensor));
        means.extend(moved.into_iter().filter_map(|m| {
            let middle_s = m.middle_s - delay_s;
            Some(MeanSpeed { row: before(middle_s)?, middle_s, ..m })
        }));
        let (moved, readings): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.readings).into_iter().partition(|r| late.contains(&r.0));
        self.readings = readings;
        for (sensor, values) in moved {
            self.wheels.push((sensor, values));
            means.extend(times.iter().zip(values).filter_map(|(t, &mean)| {
                let middle_s = t - delay_s;
                let row = before(middle_s).filter(|_| mean.is_finite())?;
                Some(MeanSpeed { row, middle_s, sensor, mean, interval_s: 0.0 })
            }));
        }
        means.sort_by(|a, b| a.middle_s.total_cmp(&b.middle_s));
        self.means = means;
    }

    fn column(&self, sensor: Sensor) -> Option<&'a [f64]> {
        self.readings.iter().chain(&self.wheels).find(|r| r.0 == sensor).map(|r| r.1)
    }

    /// Densities of white accelerations that would change the measured speed and yaw rate as much as they do (see
    /// [`super::run`]); the yaw rate is that of wheels or gyro, whichever is the less noisy: under the noise of wheels
    /// that stand close together slow turns cannot be told. `noise` is the variance of each sensor's readings that lie this
    /// far apart.
    pub(crate) fn acceleration_densities(
        &self,
        robot: &Rolling,
        log: &Log,
        times: &[f64],
        noise: &dyn Fn(Sensor, f64) -> f64,
    ) -> Result<[f64; 2]> {
        let samples = |values: &mut dyn Iterator<Item = f64>| {
            times.iter().copied().zip(values).filter(|s| s.1.is_finite()).collect::<Vec<_>>()
        };
        let own = |sensor| {
            let samples = samples(&mut self.column(sensor)?.iter().copied());
            Some((noise(sensor, median_step_s(&samples)), samples))
        };
        let by_wheels = |i: usize| {
            let wheels = self.column(Sensor::WheelLeft)?.iter().zip(self.column(Sensor::WheelRight)?);
            // half the sum and half the difference of two wheels: half the variance of one, times gains squared
            let gain = robot.speed_and_yaw_rate([0.0, 1.0])[i];
            let samples = samples(&mut wheels.map(|(left, right)| robot.speed_and_yaw_rate([*left, *right])[i]));
            Some((2.0 * gain * gain * noise(Sensor::WheelLeft, median_step_s(&samples)), samples))
        };
        let speed = by_wheels(0).or_else(|| own(Sensor::Speed)).and_then(|(variance, s)| density(&s, variance));
        let mut yaw_rates: Vec<_> = by_wheels(1).into_iter().chain(own(Sensor::Gyro)).collect();
        yaw_rates.sort_by(|a, b| a.0.total_cmp(&b.0));
        let yaw_rate = yaw_rates.into_iter().find_map(|(variance, s)| density(&s, variance));
        speed.zip(yaw_rate).map(|(v, w)| [v, w]).ok_or_else(|| {
            Error::new(ErrorKind::Value, &log.source, "neither torques nor pairs of wheel speeds to go by")
                .hint("give a log with torques or with both wheel speeds in the same rows")
        })
    }
}

/// Lag over which speeds are compared, s.
pub(super) const LAG_S: f64 = 0.2;

/// Pairs that lie further apart than this many lags have a gap between them.
const MOST_LAGS: f64 = 2.0;

/// Densities under which unknown accelerations are never taken: 1 mm/s², 1 mrad/s² in 1 Hz.
const DENSITY_FLOOR: f64 = 1e-6;

/// q = (D - 2 σ²)/δ of one measured velocity, whose samples have the variance σ²; `None` without a pair of samples.
fn density(samples: &[(f64, f64)], variance: f64) -> Option<f64> {
    let step_s = median_step_s(samples);
    let lag = ((LAG_S / step_s).round() as usize).clamp(1, samples.len().saturating_sub(1).max(1));
    let most_s = MOST_LAGS * lag as f64 * step_s;
    let pairs = samples.iter().zip(samples.get(lag..)?).map(|(a, b)| (b.0 - a.0, b.1 - a.1));
    let near = pairs.filter(|(dt, _)| *dt <= most_s);
    let (sum, span, count) = near.fold((0.0, 0.0, 0.0), |(s, t, n), (dt, d)| (s + d * d, t + dt, n + 1.0));
    (count > 0.0).then(|| ((sum - 2.0 * variance * count) / span).max(DENSITY_FLOOR))
}

/// Median interval between samples, s; NaN with fewer than two.
fn median_step_s(samples: &[(f64, f64)]) -> f64 {
    let mut steps: Vec<f64> = samples.windows(2).map(|w| w[1].0 - w[0].0).collect();
    crate::math::robust::median(&mut steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn the_density_of_a_random_walk_under_noise_is_found() {
        // over one lag of 0.2 s the mean square change is q δ + 2 σ²; sums over overlapping lags of m samples have a
        // relative standard deviation of about √(4 m/3 · 2/n)
        let (q, std, step, n) = (0.3f64, 0.05, 0.02, 40_000);
        let mut draw = Stream::new(5, 0);
        let mut v = 0.0;
        let mut samples = Vec::new();
        for k in 0..n {
            v += (q * step).sqrt() * draw.normal();
            if k % 7 != 3 {
                samples.push((f64::from(k) * step, v + std * draw.normal()));
            }
        }
        let found = density(&samples, std * std).unwrap();
        let spread = (4.0 * 10.0 / 3.0 * 2.0 / f64::from(n)).sqrt();
        assert!((found / q - 1.0).abs() < 5.0 * spread, "{found}");
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        assert_eq!(density(&[], 1.0), None);
        assert_eq!(density(&[(0.0, 1.0)], 1.0), None);
        assert_eq!(density(&[(0.0, 1.0), (1.0, 1.0)], 1.0), Some(DENSITY_FLOOR));
    }
}
