//! Whether a block of samples was taken at rest, told by the wheels or by the rate itself
//!
//! A block is half a second of samples, at least eight. A line is fitted to its rates, y = m + c (t - t̄) + n. At rest, with
//! white noise of σ² in a sample, three statistics are independent of each other:
//!
//! ```text
//!     residual   SSE/σ²                  chi-squared, n - 2 degrees of freedom
//!     slope      c √Σ(t - t̄)²/σ          standard normal
//!     mean       (m - b)/√(Pb + σ²/n)    standard normal, b the predicted bias with its variance Pb
//! ```
//!
//! # By the wheels
//!
//! Where wheels are read, a block is at rest if all their readings in it are exactly zero (or their positions unchanged) and
//! there was one. The rate itself is not asked but for this: it may not lie further than a clear turn from the predicted bias.
//!
//! # By the rate alone
//!
//! Without wheels a block is at rest if residual, slope and mean all lie within their bounds, each at a third of the level
//! 1e-3 (the residual one-sided, the others two-sided). So a block at rest is mistaken for motion once in a thousand.
//! A steady turn that is slower than the spread of the predicted bias cannot be told from a bias by any of them: who turns so
//! slowly should give wheels.
//!
//! # Three in a row
//!
//! The middle one of three blocks at rest is learnt. So a motion that begins or ends inside a block that looks still, and the
//! rocking after a stop, are left out.
//!
//! # Variance of a block's mean
//!
//! N²/D of the white noise over D seconds; the body's rocking, as the navigation filter has it; the sensor's steps, averaged only
//! where the noise carries the reading over them; and where wheels are read by ticks of known size, the turn that stays inside
//! one tick: its information after a standstill of S is S²/c², so that a block adds (S² - (S - D)²)/c².

use crate::config::{Config, Gyro};
use crate::math::distributions::chi_squared_interval;
use crate::navigate::{Standstill, TURN_RAD_S};
use crate::vehicle::Rolling;

/// Shortest block, s.
pub(super) const BLOCK_S: f64 = 0.5;

/// Fewest samples of a block.
const FEWEST: u32 = 8;

/// Probability of each of three false alarms.
const PART: f64 = 1e-3 / 3.0;
/// Normal quantile of 1 - [`PART`]/2.
const TWO_SIDED: f64 = 3.588;

/// Samples of a block so far, counted from its first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    n: u32,
    /// Stamp of the last sample before it, s from an origin of the caller's: where it begins.
    begin_s: f64,
    last_s: f64,
    first_rad_s: f64,
    time: f64,
    time2: f64,
    rate: f64,
    rate_time: f64,
    rate2: f64,
}

/// A block that is complete.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finished {
    n: f64,
    pub duration_s: f64,
    pub mean_rad_s: f64,
    /// Sum of squares about the line, rad²/s².
    residual: f64,
    /// c √Σ(t - t̄)², rad/s.
    slope_rad_s: f64,
}

impl Block {
    /// An empty one after the sample at `begin_s`.
    pub(super) fn after(begin_s: f64) -> Self {
        Self { begin_s, last_s: begin_s, ..Self::default() }
    }

    /// Adds a sample; the block, if that completes it.
    pub(super) fn add(&mut self, stamp_s: f64, rate_rad_s: f64) -> Option<Finished> {
        if self.n == 0 {
            self.first_rad_s = rate_rad_s;
        }
        // from the block's beginning: nothing cancels
        let (t, y) = (stamp_s - self.begin_s, rate_rad_s - self.first_rad_s);
        self.n += 1;
        self.last_s = stamp_s;
        self.time += t;
        self.time2 += t * t;
        self.rate += y;
        self.rate_time += y * t;
        self.rate2 += y * y;
        (self.n >= FEWEST && t >= BLOCK_S).then(|| self.finish(t))
    }

    fn finish(&self, duration_s: f64) -> Finished {
        let n = f64::from(self.n);
        let (t, y) = (self.time / n, self.rate / n);
        let tt = (self.time2 - n * t * t).max(f64::MIN_POSITIVE);
        let ty = self.rate_time - n * t * y;
        let slope_rad_s = ty / tt.sqrt();
        let residual = (self.rate2 - n * y * y - slope_rad_s * slope_rad_s).max(0.0);
        Finished { n, duration_s, mean_rad_s: self.first_rad_s + y, residual, slope_rad_s }
    }
}

/// Noise of the gyro at rest, as the configuration states it.
#[derive(Debug, Clone, Copy)]
pub(super) struct RestNoise {
    /// N², rad²/s.
    white_rad2_s: f64,
    /// lsb²/12, rad²/s².
    step_rad2_s2: f64,
    /// Variance of the vibrations in a sample, rad²/s².
    bands_rad2_s2: f64,
    rocking_std_rad_s: f64,
    /// c² of the yaw rate, rad²: 0 where ticks are not known.
    creep_rad2: f64,
}

impl RestNoise {
    pub(super) fn new(config: &Config, gyro: &Gyro) -> Self {
        let noise = gyro.noise.as_ref();
        let lsb = noise.and_then(|n| n.quantization_lsb_rad_s).unwrap_or(0.0);
        let bands = noise.map_or(0.0, |n| n.narrow_band.iter().map(|b| b.std_rad_s * b.std_rad_s).sum());
        let tick = config.encoder.and_then(|e| e.tick_rad()).unwrap_or(0.0);
        let yaw = config.vehicle.as_ref().map_or(0.0, |v| Rolling::new(v).speed_and_yaw_rate([0.0, 1.0])[1]);
        Self {
            white_rad2_s: gyro.angle_random_walk_rad_sqrt_s * gyro.angle_random_walk_rad_sqrt_s,
            step_rad2_s2: lsb * lsb / 12.0,
            bands_rad2_s2: bands,
            rocking_std_rad_s: Standstill::EXACT.yaw_rate_std_rad_s,
            creep_rad2: 2.0 * yaw * yaw * tick * tick / 6.0,
        }
    }

    /// Variance of a sample that stands for `step_s`, rad²/s².
    pub(super) fn sample_rad2_s2(&self, step_s: f64) -> f64 {
        self.white_rad2_s / step_s + self.step_rad2_s2 + self.bands_rad2_s2
    }

    /// Variance of a block's mean as a reading of the bias, after a standstill of `stood_s` that the wheels tell, rad²/s².
    pub(super) fn mean_rad2_s2(&self, block: &Finished, stood_s: Option<f64>) -> f64 {
        let d = block.duration_s;
        let white = self.white_rad2_s / d;
        // a reading that stays on one step errs by up to half of it for as long as it stays
        let carried = 4.0 * self.white_rad2_s * block.n / d >= 12.0 * self.step_rad2_s2;
        let steps = if carried { self.step_rad2_s2 / block.n } else { self.step_rad2_s2 };
        let rocking = self.rocking_std_rad_s * self.rocking_std_rad_s * Standstill::EXACT.hold_s / d;
        let creep = stood_s.map_or(0.0, |stood| {
            let before = (stood - d).max(0.0);
            self.creep_rad2 / (stood * stood - before * before)
        });
        white + steps + rocking + creep
    }

    /// Whether residual and slope are those of noise alone.
    pub(super) fn steady(&self, block: &Finished) -> bool {
        let variance = self.sample_rad2_s2(block.duration_s / block.n);
        let [_, most] = chi_squared_interval(block.n - 2.0, 1.0 - 2.0 * PART);
        block.residual <= most * variance && block.slope_rad_s.abs() <= TWO_SIDED * variance.sqrt()
    }
}

/// Whether an innovation with this NIS is that of a mean at rest.
pub(super) fn as_predicted(nis: f64) -> bool {
    nis <= TWO_SIDED * TWO_SIDED
}

/// Whether an innovation is a clear turn.
pub(super) fn turns(innovation_rad_s: f64) -> bool {
    innovation_rad_s.abs() > TURN_RAD_S
}

/// Readings of the wheels since the block's beginning.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Wheels {
    readings: u32,
    moved: bool,
    /// Arrival of the reading since which they stand, s.
    pub since_s: Option<f64>,
}

impl Wheels {
    /// Takes in a reading that arrived at `arrival_s`.
    pub(super) fn add(&mut self, still: bool, arrival_s: f64) {
        self.readings = self.readings.saturating_add(1);
        self.moved |= !still;
        self.since_s = if still { self.since_s.or(Some(arrival_s)) } else { None };
    }

    /// Whether they stood all through the block that ends now; the next one begins.
    pub(super) fn stood(&mut self) -> bool {
        let stood = self.readings > 0 && !self.moved;
        if self.readings == 0 {
            // nothing is known of a pause in the readings
            self.since_s = None;
        }
        (self.readings, self.moved) = (0, false);
        stood
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn noise(text: &str) -> RestNoise {
        let text = format!(
            "schema = 1\n[gyro]\nc1_rad_s = 0.0\nc2_rad_s = 0.0\ntime_constant_s = 100.0\n\
             angle_random_walk_rad_sqrt_s = 1.5e-4\n{text}"
        );
        let config = Config::parse(&text, "x").unwrap();
        RestNoise::new(&config, config.gyro.as_ref().unwrap())
    }

    /// Blocks at `rate_hz` of white noise and `motion`.
    fn blocks(rate_hz: f64, count: usize, motion: impl Fn(f64) -> f64) -> Vec<Finished> {
        let (mut draw, mut block, mut found) = (Stream::new(4, 0), Block::after(0.0), Vec::new());
        for k in 1.. {
            let t = f64::from(k) / rate_hz;
            if let Some(done) = block.add(t, 8e-3 + motion(t) + 1.5e-4 * rate_hz.sqrt() * draw.normal()) {
                found.push(done);
                block = Block::after(t);
            }
            if found.len() == count {
                break;
            }
        }
        found
    }

    #[test]
    fn a_block_at_rest_is_mistaken_as_often_as_stated() {
        let noise = noise("");
        for rate_hz in [10.0, 50.0, 200.0] {
            let count = 30_000;
            let all = blocks(rate_hz, count, |_| 0.0);
            let wrong = all.iter().filter(|b| !noise.steady(b)).count() as f64;
            // two of the three thirds of 1e-3, and a tenth of that for the cube root; five deviations of a count
            let expected = 2e-3 / 3.0 * count as f64;
            assert!((wrong - expected).abs() < 5.0 * expected.sqrt() + 0.1 * expected, "{rate_hz}: {wrong} {expected}");
            let mean = all.iter().map(|b| b.mean_rad_s).sum::<f64>() / count as f64;
            let spread = all.iter().map(|b| (b.mean_rad_s - 8e-3).powi(2)).sum::<f64>() / count as f64;
            let stated = noise.white_rad2_s / all[0].duration_s;
            assert!((mean - 8e-3).abs() < 5.0 * (stated / count as f64).sqrt());
            assert!((spread / stated - 1.0).abs() < 5.0 * (2.0 / count as f64).sqrt(), "{rate_hz}");
        }
    }

    #[test]
    fn motions_are_found_down_to_the_noise() {
        let noise = noise("");
        // a turn that begins, at 0.01 rad/s²; a hand that trembles by 1 mrad at 5 Hz
        let begins = blocks(200.0, 200, |t| 0.01 * t.rem_euclid(0.5));
        let trembles = blocks(200.0, 200, |t| 1e-3 * 31.4 * (31.4 * t).cos());
        for moving in [begins, trembles] {
            assert!(moving.iter().filter(|b| noise.steady(b)).count() < 4);
        }
    }

    #[test]
    fn ticks_widen_the_first_blocks_and_steps_are_not_averaged_without_noise() {
        let robot = "[vehicle]\nmass_kg = 9.5\nyaw_inertia_kg_m2 = 0.21\nhalf_track_m = 0.17\nwheel_radius_m = 0.05\n\
            wheel_inertia_kg_m2 = 0.0008\nviscous_friction_n_m_s = 0.0006\ntorque_noise_n_m_sqrt_s = 0.0004\n\
            [encoder]\nspeed_noise_std_rad_s = 0.02\nticks_per_revolution = 500.0\n";
        let ticked = noise(robot);
        let block = blocks(200.0, 1, |_| 0.0)[0];
        let d = block.duration_s;
        let c2 = 2.0 * (0.05f64 / 0.34).powi(2) * (std::f64::consts::TAU / 500.0).powi(2) / 6.0;
        let bare = ticked.mean_rad2_s2(&block, None);
        assert!(((ticked.mean_rad2_s2(&block, Some(d)) - bare) / (c2 / (d * d)) - 1.0).abs() < 1e-9);
        assert!(((ticked.mean_rad2_s2(&block, Some(3.0 * d)) - bare) / (c2 / (5.0 * d * d)) - 1.0).abs() < 1e-9);
        let lsb = 0.02;
        let coarse = noise(&format!("[gyro.noise]\nquantization_lsb_rad_s = {lsb}\n"));
        assert!(coarse.mean_rad2_s2(&block, None) > lsb * lsb / 12.0);
    }

    #[test]
    fn wheels_stand_only_where_they_are_read() {
        let mut wheels = Wheels::default();
        assert!(!wheels.stood());
        wheels.add(true, 1.0);
        wheels.add(true, 2.0);
        assert!(wheels.stood() && wheels.since_s == Some(1.0));
        wheels.add(true, 3.0);
        wheels.add(false, 3.5);
        assert!(!wheels.stood() && wheels.since_s.is_none());
        wheels.add(true, 4.0);
        assert!(wheels.stood() && !wheels.stood() && wheels.since_s.is_none());
    }
}
