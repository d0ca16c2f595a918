//! NIS = ν²/S: chi-squared with one degree of freedom, and white, where model and noise are as stated
//!
//! A row's readings are taken in one after the other, each given those before it: the sum of their NIS is the NIS of
//! the row's innovation vector, chi-squared with as many degrees of freedom (Bar-Shalom, Li, Kirubarajan, *Estimation
//! with Applications to Tracking and Navigation*, Wiley 2001, section 5.4).
//!
//! # Fit for use
//!
//! A filter whose model holds has a mean NIS of one in every channel. The mean m of n independent NIS is chi-squared over n. They
//! are not independent, and scatter more, where the model is a little wrong for a while: with ρ(k) the autocorrelation of a
//! channel's NIS and s² their variance (2 m² where they are chi-squared), the mean has the variance of
//! n min(1, 2 m²/s²)/(1 + 2 Σ ρ(k)) independent ones, and is held against the bounds of that many degrees of freedom at 99.9 %. The sum ends where two neighbouring ρ(k) first sum to less than zero (Geyer, *Practical Markov chain Monte Carlo*,
//! Statistical Science 7 (1992) 473).
//! Where accelerations are unknown, their density is measured at lags of N parts of the log, and known to √(8/(3 N)) (see
//! [`super::run()`]): an innovation's variance may be off by as much, and the upper bound is wider by that. The lower bound is zero:
//! motion that is smoother than white accelerations leaves smaller innovations, and standard deviations that are too large.
//! Of ticks taken as means whose neighbours are anticorrelated, a mean NIS of up to 4 - 2√2 is expected ([`super::Filter`]); of a
//! wheel that hardly turns they err less than by a uniform part of a tick, and the lower bound is zero too.

use super::{Innovation, Sensor};
use crate::math::NORMAL_975;
use crate::math::distributions::{chi_squared_interval, chi_squared_interval95};
use crate::math::spectra::autocorrelation;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// NIS over a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Consistency {
    /// Readings used.
    pub readings: u64,
    /// Readings that the gate left out.
    pub gated: u64,
    /// Sum of NIS over the number of readings; expected: 1.
    pub nis_mean: f64,
    /// Between these `nis_mean` lies in 95 % of runs if the model holds.
    pub nis_mean_bounds95: [f64; 2],
    /// Whether `nis_mean` lies inside its bounds.
    pub nis_holds: bool,
    /// Whether the means of all sensors' innovations are zero, by a joint test at 95 %. A small bias of a noisy sensor
    /// shows here long before it shows in NIS.
    pub unbiased: bool,
    /// Whether all sensors' innovations are white at lag one, by a joint test at 95 %.
    pub white: bool,
    /// Whether every sensor's mean NIS lies inside its 99.9 % bounds: else pose and standard deviations are not to be relied on.
    pub fit_for_use: bool,
    /// Part of the rows whose NIS lies inside its own two-sided 95 % interval; expected: 0.95.
    pub rows_inside95: f64,
    /// Each sensor that was read.
    pub sensors: Vec<SensorConsistency>,
}

/// NIS and whiteness of one sensor's innovations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorConsistency {
    /// `gyro`, `wheel_left`, `wheel_right`, `speed`, `x`, `y` or `heading`.
    pub sensor: &'static str,
    /// Readings used.
    pub readings: u64,
    /// Mean NIS; expected: 1.
    pub nis_mean: f64,
    /// Between these `nis_mean` lies in 95 % of runs if the model holds.
    pub nis_mean_bounds95: [f64; 2],
    /// Number of independent NIS with the same variance of the mean; no more than the readings.
    pub nis_effective_readings: f64,
    /// Interval of `nis_mean` in 99.9 % of runs if the model holds, with the autocorrelation that NIS shows.
    pub nis_mean_bounds999: [f64; 2],
    /// Whether `nis_mean` lies inside that interval.
    pub fit_for_use: bool,
    /// Part of the readings inside ±1.96 standard deviations; expected: 0.95.
    pub inside95: f64,
    /// Mean of the standardised innovations; expected: 0.
    pub mean: f64,
    /// Its 95 % bound for white innovations, 1.96/√n.
    pub mean_bound95: f64,
    /// Autocorrelation of the standardised innovations at lag one; expected: 0.
    pub lag1_autocorrelation: f64,
    /// Its 95 % bound for white innovations, 1.96/√n.
    pub lag1_bound95: f64,
}

/// Degrees of freedom that a row can have.
const ROW_READINGS: usize = Sensor::ALL.len();

/// Gathers innovations; of a reading NIS and sums are kept.
#[derive(Debug, Clone)]
pub(super) struct Gatherer {
    sensors: [Sums; ROW_READINGS],
    row_intervals: [[f64; 2]; ROW_READINGS + 1],
    row_nis: f64,
    row_readings: usize,
    rows: u64,
    rows_inside: u64,
    gated: u64,
}

#[derive(Debug, Clone, Default)]
struct Sums {
    /// NIS, one a reading.
    each: Vec<f64>,
    /// Whether they are means of ticks.
    ticks: bool,
    readings: u64,
    inside: u64,
    sum: f64,
    nis: f64,
    products: f64,
    last: Option<f64>,
}

impl Gatherer {
    pub(crate) fn new() -> Self {
        let interval = |readings: usize| if readings == 0 { [0.0; 2] } else { chi_squared_interval95(readings as f64) };
        Self {
            sensors: Default::default(),
            row_intervals: std::array::from_fn(interval),
            row_nis: 0.0,
            row_readings: 0,
            rows: 0,
            rows_inside: 0,
            gated: 0,
        }
    }

    /// Declares the readings of this sensor to be means of ticks.
    pub(crate) fn of_ticks(&mut self, sensor: Sensor) {
        self.sensors[sensor as usize].ticks = true;
    }

    pub(crate) fn add(&mut self, sensor: Sensor, innovation: &Innovation) {
        if !innovation.used {
            self.gated += 1;
            return;
        }
        let z = innovation.standardised();
        self.row_nis += z * z;
        self.row_readings += 1;
        let sums = &mut self.sensors[sensor as usize];
        sums.each.push(z * z);
        sums.readings += 1;
        sums.sum += z;
        sums.nis += z * z;
        sums.inside += u64::from(z.abs() <= NORMAL_975);
        sums.products += sums.last.map_or(0.0, |last| last * z);
        sums.last = Some(z);
    }

    /// Ends a row; its NIS, NaN without readings.
    pub(crate) fn end_row(&mut self) -> f64 {
        let (nis, readings) = (self.row_nis, self.row_readings);
        (self.row_nis, self.row_readings) = (0.0, 0);
        if readings == 0 {
            return f64::NAN;
        }
        // sensors that are late may read more than once in a row of uneven steps
        let known = self.row_intervals.get(readings).copied();
        let [low, high] = known.unwrap_or_else(|| chi_squared_interval95(readings as f64));
        self.rows += 1;
        self.rows_inside += u64::from((low..=high).contains(&nis));
        nis
    }

    /// Statistics of the innovations; `lags` is the number of lags at which unknown accelerations were measured, if
    /// they were.
    pub(crate) fn finish(&self, lags: Option<f64>) -> Consistency {
        let readings: u64 = self.sensors.iter().map(|s| s.readings).sum();
        let nis: f64 = self.sensors.iter().map(|s| s.nis).sum();
        let read = Sensor::ALL.iter().zip(&self.sensors).filter(|(_, sums)| sums.readings > 0);
        let sensors: Vec<_> = read.map(|(sensor, sums)| sums.finish(name(*sensor), lags)).collect();
        // Šidák: k independent tests hold together at 95 % if each holds at 0.95^(1/k)
        let each = 0.95f64.powf(1.0 / sensors.len().max(1) as f64);
        let joint = normal_quantile(0.5 + 0.5 * each);
        let all = |deviate: fn(&SensorConsistency) -> f64| {
            sensors.iter().all(|s| deviate(s).abs() * (s.readings as f64).sqrt() <= joint)
        };
        let nis_mean = nis / readings as f64;
        let nis_mean_bounds95 = mean_bounds95(readings);
        Consistency {
            readings,
            gated: self.gated,
            nis_mean,
            nis_mean_bounds95,
            nis_holds: (nis_mean_bounds95[0]..=nis_mean_bounds95[1]).contains(&nis_mean),
            unbiased: all(|s| s.mean),
            white: all(|s| s.lag1_autocorrelation),
            fit_for_use: sensors.iter().all(|s| s.fit_for_use),
            rows_inside95: self.rows_inside as f64 / self.rows as f64,
            sensors,
        }
    }
}

impl Sums {
    fn finish(&self, sensor: &'static str, lags: Option<f64>) -> SensorConsistency {
        let n = self.readings as f64;
        let nis_mean = self.nis / n;
        let effective = effective_number(&self.each);
        let [low, high] = chi_squared_interval(effective, FIT_LEVEL).map(|x| x / effective);
        let of_lags = |lags: f64| 1.0 + normal_quantile(0.5 + 0.5 * FIT_LEVEL) * (8.0 / (3.0 * lags)).sqrt();
        let of_ticks = if self.ticks { TICKS_NIS } else { 1.0 };
        let wider = of_ticks * lags.map_or(1.0, of_lags);
        let smaller = self.ticks || lags.is_some();
        let nis_mean_bounds999 = [if smaller { 0.0 } else { low }, high * wider];
        SensorConsistency {
            sensor,
            readings: self.readings,
            nis_mean,
            nis_effective_readings: effective,
            nis_mean_bounds999,
            fit_for_use: (nis_mean_bounds999[0]..=nis_mean_bounds999[1]).contains(&nis_mean),
            nis_mean_bounds95: mean_bounds95(self.readings),
            inside95: self.inside as f64 / n,
            mean: self.sum / n,
            mean_bound95: NORMAL_975 / n.sqrt(),
            lag1_autocorrelation: self.products / self.nis,
            lag1_bound95: NORMAL_975 / n.sqrt(),
        }
    }
}

fn normal_quantile(probability: f64) -> f64 {
    Normal::standard().inverse_cdf(probability)
}

fn name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "gyro",
        Sensor::WheelLeft => "wheel_left",
        Sensor::WheelRight => "wheel_right",
        Sensor::Speed => "speed",
        Sensor::PoseX => "x",
        Sensor::PoseY => "y",
        Sensor::PoseHeading => "heading",
    }
}

/// How often a sensor's mean NIS lies inside its bounds if the model holds.
const FIT_LEVEL: f64 = 0.999;

/// The largest mean NIS of means of ticks whose filter holds: 4 - 2√2.
const TICKS_NIS: f64 = 4.0 - 2.0 * std::f64::consts::SQRT_2;

/// Lags to which an autocorrelation is followed: beyond a tenth of the series it is known too badly.
const LAG_SHARE: usize = 10;

/// n min(1, 2 m²/s²)/(1 + 2 Σ ρ(k)): at most n, and at least one.
fn effective_number(series: &[f64]) -> f64 {
    let n = series.len() as f64;
    let mean = series.iter().sum::<f64>() / n;
    let variance = series.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    let scatter = (2.0 * mean * mean / variance).min(1.0);
    let Some(found) = autocorrelation(series, series.len() / LAG_SHARE) else { return n };
    let pairs = found.r[1..].chunks_exact(2).map(|pair| pair[0] + pair[1]);
    let sum: f64 = pairs.take_while(|pair| *pair > 0.0).sum();
    (n * scatter / (1.0 + 2.0 * sum)).max(1.0)
}

/// 95 % interval of a chi-squared variable over its degrees of freedom; the whole axis without any.
fn mean_bounds95(degrees: u64) -> [f64; 2] {
    if degrees == 0 {
        return [0.0, f64::INFINITY];
    }
    chi_squared_interval95(degrees as f64).map(|x| x / degrees as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    fn gather(innovations: impl Iterator<Item = [f64; 2]>) -> Consistency {
        let mut g = Gatherer::new();
        for row in innovations {
            for (sensor, residual) in [Sensor::Gyro, Sensor::WheelLeft].into_iter().zip(row) {
                g.add(sensor, &Innovation { residual, variance: 4.0, used: true });
            }
            g.end_row();
        }
        g.finish(None)
    }

    #[test]
    fn white_innovations_of_the_stated_variance_are_consistent() {
        let mut stream = Stream::new(1, 0);
        let runs = 400;
        let (mut inside, mut white, mut unbiased) = (0, 0, 0);
        for _ in 0..runs {
            let c = gather((0..500).map(|_| [2.0 * stream.normal(), 2.0 * stream.normal()]));
            inside += i32::from(c.nis_holds);
            white += i32::from(c.white);
            unbiased += i32::from(c.unbiased);
            // 500 rows at 95 %: five binomial standard deviations are 0.049
            assert!((c.rows_inside95 - 0.95).abs() < 0.049, "{}", c.rows_inside95);
        }
        // five binomial standard deviations about 0.95 of 400 runs: 22
        for held in [inside, white, unbiased] {
            assert!((held - 380).abs() < 22, "{inside} {white} {unbiased}");
        }
    }

    #[test]
    fn too_large_and_coloured_innovations_are_not() {
        let mut stream = Stream::new(2, 0);
        let large = gather((0..500).map(|_| [2.4 * stream.normal(), 2.4 * stream.normal()]));
        assert!(!large.nis_holds && large.nis_mean > 1.0);
        let mut state = 0.0;
        let coloured = gather((0..500).map(|_| {
            state = 0.8 * state + 1.2 * stream.normal();
            [state, 2.0 * stream.normal()]
        }));
        assert!(!coloured.white && coloured.nis_holds);
        assert!((coloured.sensors[0].lag1_autocorrelation - 0.8).abs() < 0.1);
    }

    #[test]
    fn a_bias_too_small_for_nis_is_seen_in_the_mean() {
        let mut stream = Stream::new(3, 0);
        let c = gather((0..2000).map(|_| [2.0 * stream.normal() + 0.3, 2.0 * stream.normal()]));
        assert!(c.nis_holds && !c.unbiased);
        // 0.15 standard deviations, within five standard errors
        assert!((c.sensors[0].mean - 0.15).abs() < 5.0 / 2000f64.sqrt());
    }

    #[test]
    fn one_run_in_a_thousand_is_refused_however_long_nis_stays_where_it_is() {
        // innovations of the stated variance over the whole run, whose scale follows a process that forgets in 20 rows: what a
        // filter shows whose model is a little wrong for a while, and right on average
        let mut stream = Stream::new(5, 0);
        let (runs, kept) = (1000, (-1.0f64 / 20.0).exp());
        for scale in [0.0, 0.3] {
            let refused = (0..runs)
                .filter(|_| {
                    let mut level = stream.normal();
                    let c = gather((0..2000).map(|_| {
                        level = kept * level + (1.0 - kept * kept).sqrt() * stream.normal();
                        // the mean of exp(2 a x) over a normal x is exp(2 a²)
                        let std = 2.0 * (scale * level - scale * scale).exp();
                        [std * stream.normal(), 2.0 * stream.normal()]
                    }));
                    !c.fit_for_use
                })
                .count();
            // two sensors at one in a thousand: 2 of 1000 runs; eight or more come once in a thousand times, where the
            // process's own slow part, which the sum of the autocorrelation misses, adds as many again
            assert!(refused < if scale > 0.0 { 16 } else { 9 }, "{scale}: {refused}");
        }
    }

    #[test]
    fn what_is_twice_as_large_is_not_fit_for_use() {
        let mut stream = Stream::new(6, 0);
        let c = gather((0..2000).map(|_| [2.0 * stream.normal(), 2.8 * stream.normal()]));
        assert!(c.sensors[0].fit_for_use && !c.sensors[1].fit_for_use && !c.fit_for_use);
        let n = c.sensors[1].nis_effective_readings;
        assert!(n > 1500.0 && n <= 2000.0, "{n}");
    }

    #[test]
    fn rows_without_readings_count_nothing() {
        let mut g = Gatherer::new();
        assert!(g.end_row().is_nan());
        g.add(Sensor::Gyro, &Innovation { residual: 9.0, variance: 1.0, used: false });
        assert!(g.end_row().is_nan());
        let c = g.finish(None);
        assert_eq!((c.readings, c.gated, c.sensors.len()), (0, 1, 0));
    }
}
