//! Means and spreads over the logs of an axis, and the logs that are outliers.
//!
//! C2 and C1 are held to be normal from log to log, T log-normal, as the simulator draws them. The spread of C1, relative to its mean,
//! and that of ln T are one number in the configuration (`warm_up_relative_std`): it is estimated from both, with the covariance of
//! their errors, and has twice the degrees of freedom.

use super::row::Row;
use crate::math::outlying::outlying;
use crate::math::random_effects::{Observed, Spread, spread};
use crate::math::robust::median;
use nalgebra::{Matrix2, Vector2};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// How a population is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Options {
    /// Count also logs that are not of one population with the others.
    pub keep_outlying: bool,
    /// Count also logs whose residuals are not white.
    pub accept_not_white: bool,
    /// An ordinary population has an outlying log with this probability at most.
    pub level: f64,
    /// Simulated populations.
    pub draws: usize,
    /// Their seed.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { keep_outlying: false, accept_not_white: false, level: 0.05, draws: 999, seed: 1 }
    }
}

/// Names of C1, C2 and T.
pub(super) const PARAMETERS: [&str; 3] = ["c1", "c2", "time_constant"];

/// A parameter over the population.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Parameter {
    /// Mean; of T, the exponential of that of ln T.
    pub mean: f64,
    /// Its 95 % interval.
    pub mean_ci95: [f64; 2],
    /// Standard deviation from log to log, net of the logs' own errors.
    pub spread: f64,
    /// Its 95 % interval.
    pub spread_ci95: [f64; 2],
    /// The spread over the size of the mean; of T, the standard deviation of ln T.
    pub relative_spread: f64,
    /// Its 95 % interval.
    pub relative_ci95: [f64; 2],
    /// Probability of such differences if there were no spread.
    pub p_value: f64,
}

/// A relative spread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Repeatability {
    /// Relative standard deviation from log to log.
    pub relative_std: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
    /// Probability of such differences if there were no spread.
    pub p_value: f64,
}

/// A log that does not count.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct LeftOut {
    /// Its row.
    pub row: usize,
    /// Why.
    pub why: String,
}

/// A log that is not of one population with the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OutlyingLog {
    /// Its row.
    pub row: usize,
    /// `c1`, `c2` or `time_constant`.
    pub parameter: &'static str,
    /// Its distance from the median, in robust standard deviations.
    pub studentized: f64,
    /// Probability of a log as far in an ordinary population, all its logs and parameters looked at.
    pub p_value: f64,
}

/// Ranges of time and temperature of the counted logs, and their common noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Span {
    /// N, root mean square over the logs, rad/√s.
    pub angle_random_walk_rad_sqrt_s: f64,
    /// K, likewise, where most logs show one, rad/s/√s.
    pub rate_random_walk_rad_s_sqrt_s: Option<f64>,
    /// Samples of all.
    pub samples: u64,
    /// Median of their rates, Hz.
    pub sample_rate_hz: f64,
    /// Time since power-on from which all are there, s.
    pub from_s: f64,
    /// Up to which all are there, s.
    pub to_s: f64,
    /// Lowest and highest temperature of all, °C.
    pub temperature_c: Option<[f64; 2]>,
    /// Smallest joint p value of whiteness times the number of logs (Bonferroni), 1 at most.
    pub joint_p_value: f64,
    /// Level at which the logs were judged.
    pub level: f64,
    /// Averaging times of the whiteness tests, s.
    pub averaging_times_s: Vec<f64>,
}

/// The logs of one axis, of one topic where topics were named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Population {
    /// As in the rows.
    pub topic: Option<String>,
    /// As in the rows.
    pub axis: String,
    /// Logs.
    pub logs: usize,
    /// Those that could not be fitted.
    pub failed: usize,
    /// Rows that count.
    pub counted: Vec<usize>,
    /// Rows that were fitted and do not count.
    pub left_out: Vec<LeftOut>,
    /// Outlying logs, whether they count or not.
    pub outlying: Vec<OutlyingLog>,
    /// Whether there were enough logs to look for outlying ones.
    pub outlying_tested: bool,
    /// Probability that an ordinary population has any.
    pub level: f64,
    /// C1, rad/s; none where it was given, or fewer than two logs count.
    pub c1: Option<Parameter>,
    /// C2, rad/s: its spread is the turn-on repeatability.
    pub c2: Option<Parameter>,
    /// T, s.
    pub time_constant: Option<Parameter>,
    /// Relative spread of C1 and T together.
    pub warm_up: Option<Repeatability>,
    /// Covariance of the means of (C1, C2, T), SI.
    pub mean_covariance: [[f64; 3]; 3],
    /// Ranges and noise of the counted logs.
    pub span: Option<Span>,
}

/// C1, C2, ln T of a row, and the covariance of their errors.
struct Sample {
    row: usize,
    value: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Sample {
    fn of(row: usize, rows: &[Row]) -> Option<Self> {
        let (mut value, covariance) = rows[row].estimates()?;
        let t = value[2];
        if !(t > 0.0) {
            return None;
        }
        value[2] = t.ln();
        let scale = [1.0, 1.0, t];
        let of_logarithm = |a: usize| std::array::from_fn(|b| covariance[a][b] / (scale[a] * scale[b]));
        Some(Self { row, value, covariance: std::array::from_fn(of_logarithm) })
    }

    fn std(&self, k: usize) -> f64 {
        self.covariance[k][k].max(0.0).sqrt()
    }

    fn number(&self, k: usize) -> Observed<1> {
        Observed::number(self.value[k], self.std(k))
    }
}

impl Population {
    /// One population a topic and axis of `rows`, in the order in which they come.
    #[must_use]
    pub(crate) fn by_axis(rows: &[Row], options: &Options) -> Vec<Self> {
        let mut gyros: Vec<(&Option<String>, &str)> = Vec::new();
        for row in rows {
            let gyro = (&row.source.topic, row.source.axis.as_str());
            if !gyros.contains(&gyro) {
                gyros.push(gyro);
            }
        }
        gyros.into_iter().map(|(topic, axis)| Self::of(topic.as_deref(), axis, rows, options)).collect()
    }

    fn of(topic: Option<&str>, axis: &str, rows: &[Row], options: &Options) -> Self {
        let is_own = |row: &Row| row.source.topic.as_deref() == topic && row.source.axis == axis;
        let own: Vec<usize> = (0..rows.len()).filter(|i| is_own(&rows[*i])).collect();
        let (mut samples, mut left_out, mut bytes) = (Vec::new(), Vec::new(), BTreeMap::new());
        for row in own.iter().copied().filter(|i| rows[*i].source.error.is_none()) {
            let why = match bytes.insert(&rows[row].source.sha256, row) {
                Some(other) => Some(format!("the same bytes as {}", rows[other].source.path)),
                None => unfit(&rows[row], options).map(String::from),
            };
            match (why, Sample::of(row, rows)) {
                (None, Some(sample)) => samples.push(sample),
                (why, _) => {
                    let why = why.unwrap_or_else(|| "its errors are not known".into());
                    left_out.push(LeftOut { row, why });
                }
            }
        }
        let (outlying, outlying_tested) = outlying_logs(&samples, options);
        if !options.keep_outlying {
            let far: BTreeSet<usize> = outlying.iter().map(|o| o.row).collect();
            samples.retain(|s| !far.contains(&s.row));
            left_out.extend(far.into_iter().map(|row| LeftOut { row, why: "outlying".into() }));
        }
        let parameters: [Option<Spread<1>>; 3] = std::array::from_fn(|k| free_spread(&samples, k));
        let [c1, c2, time_constant] = std::array::from_fn(|k| parameters[k].map(|s| parameter(&s, k == 2)));
        Self {
            topic: topic.map(str::to_string),
            axis: axis.to_string(),
            logs: own.len(),
            failed: own.iter().filter(|i| rows[**i].source.error.is_some()).count(),
            counted: samples.iter().map(|s| s.row).collect(),
            left_out,
            outlying,
            outlying_tested,
            level: options.level,
            c1,
            c2,
            time_constant,
            warm_up: warm_up(&samples, &parameters),
            mean_covariance: mean_covariance(&samples, &parameters),
            span: span(&samples.iter().map(|s| &rows[s.row]).collect::<Vec<_>>()),
        }
    }

    /// Mean of (C1, C2, T) over the counted logs; a parameter that was given is what it was given as.
    #[must_use]
    pub(crate) fn means(&self, rows: &[Row]) -> Option<[f64; 3]> {
        let first = rows.get(*self.counted.first()?)?.estimates()?.0;
        let means = [self.c1, self.c2, self.time_constant];
        Some(std::array::from_fn(|k| means[k].map_or(first[k], |p| p.mean)))
    }
}

/// Why a fitted row does not count.
fn unfit(row: &Row, options: &Options) -> Option<&'static str> {
    match (row.warm_up_found, row.identifiable, row.white) {
        (Some(false), ..) => Some("no warm-up found"),
        (_, Some(false), _) => Some("T is not identifiable"),
        (.., Some(false)) if !options.accept_not_white => Some("the residuals are not white"),
        _ => None,
    }
}

fn outlying_logs(samples: &[Sample], options: &Options) -> (Vec<OutlyingLog>, bool) {
    let free: Vec<usize> = (0..3).filter(|k| samples.iter().any(|s| s.std(*k) > 0.0)).collect();
    let (mut found, mut tested) = (Vec::new(), false);
    for k in &free {
        let values: Vec<f64> = samples.iter().map(|s| s.value[*k]).collect();
        let errors: Vec<f64> = samples.iter().map(|s| s.std(*k)).collect();
        let Some(all) = outlying(&values, &errors, options.draws, options.seed.wrapping_add(*k as u64)) else {
            continue;
        };
        tested = true;
        for (sample, o) in samples.iter().zip(all) {
            // Bonferroni over the parameters
            let p_value = (o.p_value * free.len() as f64).min(1.0);
            if p_value <= options.level {
                let parameter = PARAMETERS[*k];
                found.push(OutlyingLog { row: sample.row, parameter, studentized: o.studentized, p_value });
            }
        }
    }
    found.sort_by_key(|o| o.row);
    (found, tested)
}

/// Spread of parameter `k`; none where it was given.
fn free_spread(samples: &[Sample], k: usize) -> Option<Spread<1>> {
    let free = samples.iter().any(|s| s.std(k) > 0.0);
    let observed: Vec<Observed<1>> = samples.iter().map(|s| s.number(k)).collect();
    spread(&observed).filter(|_| free)
}

fn parameter(s: &Spread<1>, logarithm: bool) -> Parameter {
    let (mean, half) = (s.mean[0], s.mean_half_width[0]);
    if logarithm {
        let t = mean.exp();
        return Parameter {
            mean: t,
            mean_ci95: [(mean - half).exp(), (mean + half).exp()],
            spread: t * s.std,
            spread_ci95: s.ci95.map(|v| t * v),
            relative_spread: s.std,
            relative_ci95: s.ci95,
            p_value: s.p_value,
        };
    }
    Parameter {
        mean,
        mean_ci95: [mean - half, mean + half],
        spread: s.std,
        spread_ci95: s.ci95,
        relative_spread: s.std / mean.abs(),
        relative_ci95: s.ci95.map(|v| v / mean.abs()),
        p_value: s.p_value,
    }
}

/// C1 over its mean and ln T, one spread for both; alone where the other was given.
fn warm_up(samples: &[Sample], parameters: &[Option<Spread<1>>; 3]) -> Option<Repeatability> {
    let alone =
        |p: Parameter| Repeatability { relative_std: p.relative_spread, ci95: p.relative_ci95, p_value: p.p_value };
    let (c1, t) = match (parameters[0], parameters[2]) {
        (Some(c1), Some(t)) => (c1, t),
        (Some(c1), None) => return Some(alone(parameter(&c1, false))),
        (None, Some(t)) => return Some(alone(parameter(&t, true))),
        (None, None) => return None,
    };
    let (c1, ln_t) = (c1.mean[0], t.mean[0]);
    let observed: Vec<Observed<2>> = samples
        .iter()
        .map(|s| {
            let both = s.covariance[0][2] / c1;
            Observed {
                value: Vector2::new(s.value[0] / c1, s.value[2] - ln_t),
                covariance: Matrix2::new(s.covariance[0][0] / (c1 * c1), both, both, s.covariance[2][2]),
            }
        })
        .collect();
    spread(&observed).map(|s| Repeatability { relative_std: s.std, ci95: s.ci95, p_value: s.p_value })
}

/// Covariance of the means: each is Σ w_i y_i, so cov(a, b) = Σ w_ai w_bi S_i,ab; the spreads are independent.
fn mean_covariance(samples: &[Sample], parameters: &[Option<Spread<1>>; 3]) -> [[f64; 3]; 3] {
    let weights: [Vec<f64>; 3] = std::array::from_fn(|k| {
        let Some(s) = parameters[k] else { return vec![0.0; samples.len()] };
        let one = |sample: &Sample| 1.0 / (sample.covariance[k][k] + s.std * s.std);
        let sum: f64 = samples.iter().map(one).sum();
        samples.iter().map(|sample| one(sample) / sum).collect()
    });
    let scale = [1.0, 1.0, parameters[2].map_or(0.0, |t| t.mean[0].exp())];
    std::array::from_fn(|a| {
        std::array::from_fn(|b| {
            let added = |k: usize| parameters[k].map_or(0.0, |s| s.std * s.std);
            let of = |(i, s): (usize, &Sample)| {
                let own = if a == b { added(a) } else { 0.0 };
                weights[a][i] * weights[b][i] * (s.covariance[a][b] + own)
            };
            scale[a] * scale[b] * samples.iter().enumerate().map(of).sum::<f64>()
        })
    })
}

fn span(rows: &[&Row]) -> Option<Span> {
    let n = rows.len() as f64;
    let all = |of: fn(&Row) -> Option<f64>| -> Vec<f64> { rows.iter().filter_map(|r| of(r)).collect() };
    let most = |v: Vec<f64>| v.into_iter().max_by(f64::total_cmp);
    let least = |v: Vec<f64>| v.into_iter().min_by(f64::total_cmp);
    let mean_square = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
    let white = all(|r| r.angle_random_walk_rad_sqrt_s);
    let walks = all(|r| r.rate_random_walk_rad_s_sqrt_s.filter(|_| r.rate_random_walk_probability > Some(0.5)));
    let low = least(all(|r| r.temperature_low_c));
    let high = most(all(|r| r.temperature_high_c));
    let times = rows.iter().filter_map(|r| r.whiteness_p_values.as_deref()).flat_map(averaging_times);
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    Some(Span {
        angle_random_walk_rad_sqrt_s: mean_square(&white),
        rate_random_walk_rad_s_sqrt_s: (2 * walks.len() > rows.len()).then(|| mean_square(&walks)),
        samples: rows.iter().filter_map(|r| r.samples).map(i64::unsigned_abs).sum(),
        sample_rate_hz: median(&mut all(|r| r.sample_rate_hz)),
        from_s: most(all(|r| r.first_s))?,
        to_s: least(all(|r| Some(r.first_s? + r.span_s?)))?,
        temperature_c: low.zip(high).map(|(a, b)| [a, b]),
        joint_p_value: least(all(|r| r.whiteness_p_value)).map_or(f64::NAN, |p| (p * n).min(1.0)),
        level: least(all(|r| r.whiteness_level))?,
        averaging_times_s: times,
    })
}

fn averaging_times(json: &str) -> Vec<f64> {
    let map: serde_json::Map<String, serde_json::Value> = serde_json::from_str(json).unwrap_or_default();
    map.keys().filter_map(|k| k.parse().ok()).collect()
}
