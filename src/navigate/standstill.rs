//! v = 0 ± σv and ω = 0 ± σω, while the robot stands still
//!
//! Then the gyro reads its error alone. This is sound only if the robot really stands: wheels that read zero within
//! their noise may creep, and a filter that takes a creeping robot for a still one learns the creep as the gyro's error.
//!
//! # When it stands
//!
//! By default: both wheels have read zero for a hold time, their counts unchanged or, in a log without counts, their speeds
//! zero (or those that an odometry's speed and yaw rate stand for) but for rounding: an odometry that averages the speeds
//! of the last rows by adding and taking away is left with 1e-15 m/s. A noisy encoder never does that.
//! Where one speed is all that the log has, it is that speed, with two conditions more. The gyro must not read a turn, as a
//! robot may turn on the spot. And the speed must stay at zero for another hold time, which only a log can tell: a car's
//! odometry still reads zero when the car has begun to move.
//!
//! On request ([`Standstill::within_noise`]) also: the mean of each wheel's readings over the hold time is within three
//! standard deviations of zero, and so is the mean of the commanded torques, where they are known, against the torque
//! noise. That is the user's word that the robot stands when it seems to: a brake, or friction that holds it.
//!
//! # How still it is
//!
//! σv and σω are of the mean over one hold time, independent from one to the next; a row of dt gets σ² hold/dt, so that
//! the sum does not depend on the sample rate. Within one tick a wheel can still move: its angle at two instants of the
//! same count differs by two uniform errors of tick²/12, so that after a standstill of S the mean speed of a wheel is
//! known to c²/S², c² = tick²/6. This is information S²/c², of which a row adds 2 S dt/c²: a variance of c²/(2 S dt).
//! From wheels to v and ω the variance goes by twice the square of r/2 and r/(2 b).

use super::sensors;
use crate::config::{Config, Encoder};
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Log, names};
use crate::vehicle::{Odometry, Rolling};
use serde::Serialize;
use std::ops::RangeInclusive;

/// Rule for standstill, and how still the robot is then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// Wheels must have read zero for so long, s. 0.5: longer than a wheel takes through the zero of a reversal.
    pub hold_s: f64,
    /// Standard deviation of the mean speed over a hold time, m/s. 1e-4: a body that rocks on its wheels by 0.05 mm in
    /// half a second.
    pub speed_std_m_s: f64,
    /// Standard deviation of the mean yaw rate over a hold time, rad/s. 1e-4: the same by 0.05 mrad. White gyro noise
    /// of 1.5e-4 rad/√s averages to 2e-4 rad/s over half a second, so that little is lost.
    pub yaw_rate_std_rad_s: f64,
    /// Whether wheels that read zero within their noise count as still. Only where something holds the robot.
    pub within_noise: bool,
}

impl Standstill {
    /// The rule of exact zeros.
    pub const EXACT: Self = Self { hold_s: 0.5, speed_std_m_s: 1e-4, yaw_rate_std_rad_s: 1e-4, within_noise: false };
}

impl Default for Standstill {
    fn default() -> Self {
        Self::EXACT
    }
}

/// Knowledge of the gyro error before and after standstill.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StandstillSummary {
    /// Rows at standstill.
    pub rows: u64,
    /// Standard deviation of the gyro error at the first of them, before it was taken for one, rad/s.
    pub gyro_error_std_before_rad_s: f64,
    /// Standard deviation of the gyro error after the last of them, rad/s.
    pub gyro_error_std_after_rad_s: f64,
}

impl StandstillSummary {
    /// Adds a row.
    pub(super) fn add(so_far: Option<Self>, before_rad_s: f64, after_rad_s: f64) -> Self {
        let first =
            Self { rows: 0, gyro_error_std_before_rad_s: before_rad_s, gyro_error_std_after_rad_s: after_rad_s };
        let sum = so_far.unwrap_or(first);
        Self { rows: sum.rows + 1, gyro_error_std_after_rad_s: after_rad_s, ..sum }
    }
}

/// A speed below this share of the largest in its column is zero but for rounding: ten thousand times the roundings of one sum,
/// and a millionth of what any encoder resolves.
const ROUNDING: f64 = 1e-12;

/// Standard deviations within which a mean is taken for zero.
const WITHIN: f64 = 3.0;

/// A gyro whose mean over the hold time is beyond this reads a turn and not its error, rad/s: 6 °/s, several times what a
/// cheap one errs by.
pub(crate) const TURN_RAD_S: f64 = 0.1;

/// Watches the rows of a log.
pub(super) struct Detector<'a> {
    rule: Standstill,
    times: &'a [f64],
    /// Left and right, or the one speed.
    wheels: Vec<Wheel<'a>>,
    speeds: Vec<&'a [f64]>,
    /// The gyro, where nothing else tells a turn on the spot.
    turns: Option<&'a [f64]>,
    torques: Option<[&'a [f64]; 2]>,
    encoder: Encoder,
    /// Variance of a speed of `speeds` by that of a wheel's.
    gain: f64,
    torque_noise_n_m_sqrt_s: f64,
    /// Variance of the mean v and ω of a second in one tick: c² of each.
    creep: [f64; 2],
    /// First row of the window that ends at the last row seen.
    window: usize,
}

impl<'a> Detector<'a> {
    /// `log` with this odometry, at `times`.
    pub(crate) fn new(
        rule: Standstill,
        config: &Config,
        log: &'a Log,
        odometry: &'a Odometry<'a>,
        times: &'a [f64],
    ) -> Result<Self> {
        for (place, value) in [
            ("hold time", rule.hold_s),
            ("speed_std_m_s", rule.speed_std_m_s),
            ("yaw_rate_std_rad_s", rule.yaw_rate_std_rad_s),
        ] {
            if !(value.is_finite() && value > 0.0) {
                let found = format!("{value} is not a positive number");
                return Err(Error::new(ErrorKind::Value, "standstill", found)
                    .at(place)
                    .hint("leave it at its default"));
            }
        }
        let (vehicle, encoder) = (config.require_vehicle()?, *config.require_encoder()?);
        let speeds = match (odometry, odometry.wheels()) {
            (Odometry::Speed(speed), _) => vec![*speed],
            (_, wheels) => wheels.into_iter().flatten().collect(),
        };
        let counts = Odometry::counts(log);
        let wheels = match counts {
            Some(counts) => counts.map(|values| Wheel::new(values, true)).to_vec(),
            None => speeds.iter().map(|values| Wheel::new(values, false)).collect(),
        };
        let alone = speeds.len() == 1;
        // the mean of two wheels
        let gain = if alone { 0.5 * vehicle.wheel_radius_m * vehicle.wheel_radius_m } else { 1.0 };
        let tick = encoder.tick_rad().unwrap_or(0.0);
        let by_wheel = Rolling::new(vehicle).speed_and_yaw_rate([0.0, 1.0]);
        Ok(Self {
            rule,
            times,
            wheels,
            speeds,
            turns: if alone && counts.is_none() { sensors::gyro(log) } else { None },
            torques: log.get(names::TORQUE_LEFT).zip(log.get(names::TORQUE_RIGHT)).map(|(l, r)| [l, r]),
            encoder,
            gain,
            torque_noise_n_m_sqrt_s: vehicle.torque_noise_n_m_sqrt_s,
            creep: by_wheel.map(|gain| 2.0 * gain * gain * tick * tick / 6.0),
            window: 0,
        })
    }

    /// Variances of v (m²/s²) and ω (rad²/s²) as zero in row `k`, if the robot stands. To be asked row by row.
    pub(crate) fn variances(&mut self, k: usize) -> Option<[f64; 2]> {
        let t = self.times[k];
        let hold_s = self.rule.hold_s;
        self.wheels.iter_mut().for_each(|w| w.look(k, t, hold_s));
        let stood_s = self.wheels.iter().map(|w| w.still_s(t, hold_s)).fold(f64::INFINITY, f64::min);
        let exact = stood_s >= hold_s;
        let still = (exact && !self.turns(k) && self.stays(k)) || (self.rule.within_noise && self.within_noise(k));
        if !still {
            return None;
        }
        let dt = (t - self.times[k.checked_sub(1)?]).min(hold_s);
        let rocks = [self.rule.speed_std_m_s, self.rule.yaw_rate_std_rad_s];
        let hidden = |creep: f64| if exact { creep / (2.0 * stood_s * dt) } else { 0.0 };
        Some(std::array::from_fn(|i| rocks[i] * rocks[i] * hold_s / dt + hidden(self.creep[i])))
    }

    /// The rows of the hold time before row `k`, if the log reaches back so far.
    fn window(&mut self, k: usize) -> Option<RangeInclusive<usize>> {
        let from = self.times[k] - self.rule.hold_s;
        // the last row at or before the window's beginning
        while self.times.get(self.window + 1).is_some_and(|t| *t <= from) {
            self.window += 1;
        }
        (self.times[self.window] <= from).then_some(self.window + 1..=k)
    }

    /// Whether the gyro may read a turn that the one speed does not show.
    fn turns(&mut self, k: usize) -> bool {
        let Some(rates) = self.turns else { return false };
        let Some(rows) = self.window(k) else { return true };
        mean(&rates[rows]).is_none_or(|(_, mean)| mean.abs() > TURN_RAD_S)
    }

    /// Whether one speed goes on to read zero for a hold time after row `k`.
    fn stays(&self, k: usize) -> bool {
        if self.turns.is_none() {
            return true;
        }
        let rest = || self.times[k..].iter().zip(&self.speeds[0][k..]);
        let held = rest().take_while(|(_, v)| !v.is_finite() || v.abs() <= self.wheels[0].zero);
        held.last().is_some_and(|(t, _)| t - self.times[k] >= self.rule.hold_s)
    }

    /// Whether the means over the hold time before row `k` are zero within their noise.
    fn within_noise(&mut self, k: usize) -> bool {
        let Some(rows) = self.window(k) else { return false };
        let hold_s = self.rule.hold_s;
        let wheels_rest = self.speeds.iter().all(|speeds| {
            mean(&speeds[rows.clone()]).is_some_and(|(n, mean)| {
                // ticks telescope: the mean over the window has the error of its two ends
                let white = self.encoder.speed_noise_std_rad_s * self.encoder.speed_noise_std_rad_s / n;
                let tick = self.encoder.tick_rad().unwrap_or(0.0) / hold_s;
                mean.abs() <= WITHIN * (self.gain * (white + tick * tick / 6.0)).sqrt()
            })
        });
        let torque_std = self.torque_noise_n_m_sqrt_s / hold_s.sqrt();
        wheels_rest
            && !self.turns(k)
            && self.torques.is_none_or(|torques| {
                let rests = |side: &[f64]| mean(side).is_none_or(|(_, mean)| mean.abs() <= WITHIN * torque_std);
                torques.iter().all(|side| rests(&side[rows.clone()]))
            })
    }
}

/// Number and mean of the values that are there.
fn mean(values: &[f64]) -> Option<(f64, f64)> {
    let there = values.iter().filter(|v| v.is_finite());
    let (n, sum) = there.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
    (n > 0.0).then(|| (n, sum / n))
}

/// One wheel's exact zeros.
#[derive(Clone)]
struct Wheel<'a> {
    values: &'a [f64],
    /// Magnitude up to which a value counts as zero, in the unit of `values`.
    zero: f64,
    /// Whether they are counts, which stand still where they do not change.
    counted: bool,
    last_count: f64,
    last_read_s: f64,
    since_s: Option<f64>,
}

impl<'a> Wheel<'a> {
    fn new(values: &'a [f64], counted: bool) -> Self {
        let zero = ROUNDING * values.iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
        Self { values, zero, counted, last_count: f64::NAN, last_read_s: f64::NEG_INFINITY, since_s: None }
    }

    fn look(&mut self, k: usize, t: f64, hold_s: f64) {
        let value = self.values[k];
        if !value.is_finite() {
            return;
        }
        // nothing is known of a pause in the readings
        let seen = t - self.last_read_s <= hold_s;
        let still = if self.counted { value == self.last_count } else { value.abs() <= self.zero };
        self.since_s = match (still, self.counted) {
            (true, _) if seen => self.since_s.or(Some(t)),
            (true, _) | (false, true) => Some(t),
            (false, false) => None,
        };
        (self.last_count, self.last_read_s) = (value, t);
    }

    /// For how long it has read zero, s.
    fn still_s(&self, t: f64, hold_s: f64) -> f64 {
        match self.since_s {
            Some(since) if t - self.last_read_s <= hold_s => t - since,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TimeAxis;

    const TEXT: &str = "schema = 1\n[vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\n\
        wheel_radius_m = 0.05\nwheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\n\
        torque_noise_n_m_sqrt_s = 0.0004\n[encoder]\nspeed_noise_std_rad_s = 0.02\n";

    /// Rows of `log` that are taken for standstill.
    fn rows(rule: Standstill, ticks: Option<f64>, log: &Log) -> Vec<usize> {
        let mut config = Config::parse(TEXT, "x").unwrap();
        config.encoder.as_mut().unwrap().ticks_per_revolution = ticks;
        let (times, odometry) = (log.time.to_vec(), sensors::odometry(&config, log).unwrap());
        let mut detector = Detector::new(rule, &config, log, &odometry, &times).unwrap();
        (0..log.len()).filter(|k| detector.variances(*k).is_some()).collect()
    }

    /// A log at 10 Hz with the left wheel's speeds on both sides.
    fn log(speeds: &[f64]) -> Log {
        let mut log = Log::new("x", TimeAxis::Uniform { start_s: 0.0, step_s: 0.1, len: speeds.len() });
        log.push(names::WHEEL_LEFT, speeds.to_vec()).unwrap();
        log.push(names::WHEEL_RIGHT, speeds.to_vec()).unwrap();
        log
    }

    /// Zero from row 4 on but for rows 15 and 26.
    fn stops() -> Vec<f64> {
        (0..30).map(|k| if k < 4 || k == 15 || k == 26 { 0.3 } else { 0.0 }).collect()
    }

    const HELD: Standstill = Standstill { hold_s: 0.45, ..Standstill::EXACT };

    #[test]
    fn zeros_count_after_the_hold_time_and_begin_anew_after_each_motion() {
        let expected: Vec<usize> = (9..15).chain(21..26).collect();
        assert_eq!(rows(HELD, None, &log(&stops())), expected);
        // one wheel that turns is motion
        let mut turning = log(&stops());
        turning.channels[1].values.fill(0.2);
        assert!(rows(HELD, None, &turning).is_empty());
    }

    #[test]
    fn missing_readings_are_passed_over_and_pauses_are_not() {
        let mut sparse = stops();
        (0..30).filter(|k| k % 2 == 1 && *k != 15).for_each(|k| sparse[k] = f64::NAN);
        // a row without a reading of its own stands as the rows around it do
        assert_eq!(rows(HELD, None, &log(&sparse)), (9..15).chain(21..26).collect::<Vec<_>>());
        let mut paused = vec![0.0; 30];
        paused[10..20].fill(f64::NAN);
        assert_eq!(rows(HELD, None, &log(&paused)), (5..14).chain(25..30).collect::<Vec<_>>());
        let mut jump = log(&[0.0; 12]);
        jump.time = TimeAxis::Explicit((0..12).map(|k| 0.1 * f64::from(k) + if k > 7 { 5.0 } else { 0.0 }).collect());
        assert_eq!(rows(HELD, None, &jump), [5, 6, 7]);
    }

    #[test]
    fn counts_go_before_speeds() {
        // noisy speeds beside ticks that stand still from row 4 on
        let mut counted = log(&[0.013; 12]);
        let counts: Vec<f64> = (0..12).map(|k: i32| f64::from(k.min(4))).collect();
        counted.push(names::WHEEL_LEFT_TICKS, counts.clone()).unwrap();
        counted.push(names::WHEEL_RIGHT_TICKS, counts).unwrap();
        assert_eq!(rows(HELD, Some(1000.0), &counted), [9, 10, 11]);
    }

    #[test]
    fn an_odometry_stands_where_both_its_numbers_are_zero_and_one_speed_where_the_gyro_agrees() {
        let other = |channels: &[(&str, Vec<f64>)]| {
            let mut log = log(&[0.0; 12]);
            log.channels.clear();
            channels.iter().for_each(|(name, values)| log.push(*name, values.clone()).unwrap());
            log
        };
        let (zeros, turn) = (vec![0.0; 12], (0..12).map(|k| if k < 3 { 0.2 } else { 0.0 }).collect::<Vec<_>>());
        let both = other(&[(names::ODO_SPEED, zeros.clone()), (names::ODO_YAW_RATE, turn)]);
        assert_eq!(rows(HELD, None, &both), [8, 9, 10, 11]);
        // a gyro with a bias of half a degree a second, and one that turns on the spot
        for (rate, [expected, within]) in [(0.009, [vec![5, 6], (5..12).collect()]), (0.3, [vec![], vec![]])] {
            let one = other(&[(names::ODO_SPEED, zeros.clone()), (names::GYRO_Z, vec![rate; 12])]);
            assert_eq!(rows(HELD, None, &one), expected, "{rate}");
            let asked = Standstill { within_noise: true, ..HELD };
            let noisy = [5e-4, -5e-4].repeat(6);
            let one = other(&[(names::ODO_SPEED, noisy), (names::GYRO_Z, vec![rate; 12])]);
            assert_eq!(rows(asked, None, &one), within, "{rate}");
        }
        // 0.05 · 0.02/√2/√5 three times is 0.95 mm/s
        let fast = other(&[(names::ODO_SPEED, vec![1.1e-3; 12]), (names::GYRO_Z, zeros)]);
        assert!(rows(Standstill { within_noise: true, ..HELD }, None, &fast).is_empty());
    }

    #[test]
    fn noise_about_zero_counts_only_on_request_and_not_under_torque() {
        let mut noisy = log(&[0.01, -0.01].repeat(10));
        assert!(rows(HELD, None, &noisy).is_empty());
        let asked = Standstill { within_noise: true, ..HELD };
        assert_eq!(rows(asked, None, &noisy), (5..20).collect::<Vec<_>>());
        // 0.02/√5 three times is 0.027
        assert!(rows(asked, None, &log(&[0.03; 20])).is_empty());
        noisy.push(names::TORQUE_LEFT, vec![0.0; 20]).unwrap();
        noisy.push(names::TORQUE_RIGHT, vec![0.001; 20]).unwrap();
        // 4e-4/√0.45 three times is 1.8e-3
        assert_eq!(rows(asked, None, &noisy).len(), 15);
        noisy.channels[3].values.fill(0.002);
        assert!(rows(asked, None, &noisy).is_empty());
    }

    #[test]
    fn the_variance_sums_to_the_hold_times_and_ticks_widen_it() {
        let (zeros, times): (_, Vec<f64>) = (log(&[0.0; 101]), (0..101).map(|k| 0.1 * f64::from(k)).collect());
        let information = |ticks: Option<f64>, from_s: f64| -> f64 {
            let mut config = Config::parse(TEXT, "x").unwrap();
            config.encoder.as_mut().unwrap().ticks_per_revolution = ticks;
            let odometry = sensors::odometry(&config, &zeros).unwrap();
            let mut detector = Detector::new(HELD, &config, &zeros, &odometry, &times).unwrap();
            let rows = (0..101).filter_map(|k| Some((times[k], detector.variances(k)?[1])));
            rows.filter(|(t, _)| *t > from_s).map(|(_, variance)| 1.0 / variance).sum()
        };
        // rocking alone: one measurement of 1e-4 each hold time
        let expected = (10.0 - 5.0) / HELD.hold_s / 1e-8;
        assert!((information(None, 5.0) / expected - 1.0).abs() < 1e-9, "{}", information(None, 5.0));
        // coarse ticks alone: S²/c² of the yaw rate, less what the time before 5 s gave
        let c2 = 2.0 * (0.05f64 / 0.34).powi(2) * (std::f64::consts::TAU / 20.0).powi(2) / 6.0;
        let expected = (100.0 - 25.0) / c2;
        // a sum over rows of 0.1 s in place of the integral: half a row at each end
        assert!((information(Some(20.0), 5.0) / expected - 1.0).abs() < 0.02, "{}", information(Some(20.0), 5.0));
    }

    #[test]
    fn bad_settings_are_named() {
        let config = Config::parse(TEXT, "x").unwrap();
        let (log, times) = (log(&[0.0; 3]), [0.0, 0.1, 0.2]);
        let odometry = sensors::odometry(&config, &log).unwrap();
        let refused = |rule: Standstill, part: &str| {
            let error = Detector::new(rule, &config, &log, &odometry, &times).err().unwrap().to_string();
            assert!(error.contains(part), "{error}");
        };
        refused(Standstill { hold_s: 0.0, ..HELD }, "hold time");
        refused(Standstill { yaw_rate_std_rad_s: f64::NAN, ..HELD }, "yaw_rate_std_rad_s");
    }
}
