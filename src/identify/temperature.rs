//! e(θ) = b + s (θ - θr) + q (θ - θr)², beside e(t)
//!
//! Least squares on means of rate and temperature over blocks of time, short against what changes in either, so that the noise
//! of the thermometer is averaged out of the regressor. The covariance is that of the time model: it allows for a random walk
//! of the bias (`noise`). q is kept where chance would hardly make as large a one. What is left of the thermometer's noise flattens the slope
//! by its share of the temperature's variance (Fuller, *Measurement Error Models*, 1987, 1.1): that share is stated.
//! Whether time or temperature is the better explanation is another question, and `terms::drift` answers it.

use super::noise::{self, Columns, NoiseFit};
use super::projection::BlockSum;
use super::terms::{DriftCause, drift_explained, drift_explained_reduced};
use super::types::{Estimate, NoiseEstimate};
use super::{LEVEL, difference_variance, estimate_noise};
use crate::bias::Thermal;
use crate::error::{Error, ErrorKind, Result};
use crate::signal::{Course, Reduced, TimeAxis, bridged, names};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// Blocks of time whose means are fitted.
const BLOCKS: usize = 8192;
/// Probability at which a curvature that is not there is kept.
const CURVED: f64 = 0.01;
/// A temperature that moves less is constant, °C.
const CONSTANT_C: f64 = 1e-6;
/// Largest factor by which the other columns may inflate a variance.
const MOST_INFLATED: f64 = 1e10;
/// Fewest blocks.
const FEWEST: usize = 8;

/// The gyro's error fitted against its temperature.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TemperatureFit {
    /// θr, about the log's mean, °C.
    pub reference_c: f64,
    /// b: the error at θr, rad/s.
    pub bias_rad_s: Estimate,
    /// s: the slope at θr, rad/s per K.
    pub sensitivity_rad_s_k: Estimate,
    /// q, rad/s per K²; none where the log does not support it.
    pub curvature_rad_s_k2: Option<Estimate>,
    /// Covariance of (b, s, q) that allows for autocorrelated residuals, SI; zero for q where it is not fitted.
    pub covariance: [[f64; 3]; 3],
    /// Probability of as large a slope or curvature where temperature has no effect.
    pub p_value: f64,
    /// Probability of as large a curvature where there is none; none where the temperatures are too few to tell.
    pub curvature_p_value: Option<f64>,
    /// Lowest and highest temperature of the blocks, °C.
    pub range_c: [f64; 2],
    /// Noise of the temperature's block means, °C.
    pub temperature_noise_c: f64,
    /// Share of its size by which that noise flattens the slope.
    pub attenuation: f64,
    /// sqrt(Σ r² / degrees of freedom) of the samples, rad/s.
    pub residual_std_rad_s: f64,
    /// Noise of the residuals.
    pub noise: NoiseEstimate,
    /// Time, temperature, both or neither; none where the log is too short to compare them.
    pub explanation: Option<DriftCause>,
}

impl TemperatureFit {
    /// The fitted model.
    #[must_use]
    pub fn model(&self) -> Thermal {
        Thermal {
            reference_c: self.reference_c,
            bias_rad_s: self.bias_rad_s.estimate,
            sensitivity_rad_s_k: self.sensitivity_rad_s_k.estimate,
            curvature_rad_s_k2: self.curvature_rad_s_k2.map_or(0.0, |q| q.estimate),
        }
    }

    /// Whether temperature has an effect at the 5 % level.
    #[must_use]
    pub fn found(&self) -> bool {
        self.p_value < 0.05
    }

    /// Standard deviation of the model's error at `temperature_c`, rad/s.
    #[must_use]
    pub fn model_std_rad_s(&self, temperature_c: f64) -> f64 {
        self.model().variance_rad2_s2(&self.covariance, temperature_c).sqrt()
    }

    /// Derivatives of e(θ) by the fitted ones of b, s and q, as functions of the temperature, °C: the directions that the fit has
    /// taken out of its residuals.
    #[must_use]
    pub fn directions(&self) -> Vec<impl Fn(f64) -> f64 + use<>> {
        let model = self.model();
        let fitted = if self.curvature_rad_s_k2.is_some() { 3 } else { 2 };
        (0..fitted).map(|j| move |temperature_c: f64| model.gradient(temperature_c)[j]).collect()
    }
}

/// Fits the error of a gyro at rest against its temperature: `values` (rad/s) at `time` (s since power-on), `temperature_c` beside
/// them, where it may be missing (NaN) for a while.
///
/// # Errors
/// [`ErrorKind::Column`] if lengths differ; [`ErrorKind::Value`] where the temperature is constant, or missing for long;
/// [`ErrorKind::TooShort`] below eight samples.
pub fn fit_temperature(time: &TimeAxis, values: &[f64], temperature_c: &[f64]) -> Result<TemperatureFit> {
    if values.len() != time.len() {
        let found = format!("{} values on {} times", values.len(), time.len());
        return Err(Error::new(ErrorKind::Column, "log", found));
    }
    let temperature = bridged(names::TEMPERATURE, time, temperature_c)?;
    let mut fit = solve(&blocks(time, values, &temperature), time.median_step_s(), || difference_variance(values))?;
    fit.explanation = drift_explained(time, values, &temperature, &fit.noise)?;
    Ok(fit)
}

/// Means over as many samples each.
fn blocks(time: &TimeAxis, values: &[f64], temperature: &[f64]) -> Vec<Block> {
    let size = values.len().div_ceil(BLOCKS).max(1);
    let first_s = if time.is_empty() { 0.0 } else { time.at(0) };
    let block = |(k, y): (usize, &[f64])| {
        let rows = k * size..k * size + y.len();
        let n = y.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
        let rate = mean(y);
        Block {
            n,
            // the middle of a block is near enough to the mean of its times
            mid_s: 0.5 * (time.at(rows.start) + time.at(rows.end - 1)) - first_s,
            rate,
            temperature: mean(&temperature[rows]),
            within: y.iter().map(|v| (v - rate).powi(2)).sum(),
        }
    };
    values.chunks(size).enumerate().map(block).collect()
}

/// The same of a log of which one pass kept block means.
///
/// # Errors
/// As [`fit_temperature`]; [`ErrorKind::Column`] where no temperature was logged.
pub fn fit_temperature_reduced(log: &Reduced) -> Result<TemperatureFit> {
    let coarse = &log.coarse;
    let Some(course) = Course::of_temperature(log)? else {
        return Err(Error::new(ErrorKind::Column, "log", format!("no channel {:?}", names::TEMPERATURE)));
    };
    let size = coarse.means.len().div_ceil(BLOCKS).max(1);
    let blocks = (0..coarse.means.len()).step_by(size).filter_map(|from| {
        let rows = from..(from + size).min(coarse.means.len());
        let there: Vec<usize> = rows.filter(|&i| coarse.means[i].is_finite()).collect();
        let n: f64 = there.iter().map(|&i| f64::from(coarse.counts[i])).sum();
        if n == 0.0 {
            return None;
        }
        let mean =
            |of: &dyn Fn(usize) -> f64| there.iter().map(|&i| f64::from(coarse.counts[i]) * of(i)).sum::<f64>() / n;
        let rate = mean(&|i| coarse.means[i]);
        let square = |i: usize| {
            let n = f64::from(coarse.counts[i]);
            (n - 1.0).max(0.0) * coarse.spreads[i].powi(2) + n * (coarse.means[i] - rate).powi(2)
        };
        Some(Block {
            n,
            mid_s: mean(&|i| coarse.middle_s(i)) - log.moments.first_s,
            rate,
            temperature: mean(&|i| course.values[i]),
            within: there.iter().map(|&i| square(i)).sum(),
        })
    });
    let blocks: Vec<Block> = blocks.collect();
    let mut fit = solve(&blocks, coarse.step_s, || log.difference_variance)?;
    fit.explanation = drift_explained_reduced(log, &course, &fit.noise)?;
    Ok(fit)
}

/// Means over a stretch of time.
#[derive(Debug, Clone, Copy)]
struct Block {
    n: f64,
    /// From the first sample, s.
    mid_s: f64,
    rate: f64,
    temperature: f64,
    /// Σ (y - mean)² over its samples.
    within: f64,
}

/// A polynomial of one degree: coefficients of powers of (θ - θr)/half range, their noise, Σ r² over the samples.
struct Solved {
    coefficients: DVector<f64>,
    noise: NoiseFit,
    rss: f64,
}

impl Solved {
    fn variances(&self, i: usize) -> Vec<f64> {
        self.noise.members.iter().map(|m| m.covariance[(i, i)]).collect()
    }

    fn p_value(&self, i: usize) -> f64 {
        self.noise.p_value(self.coefficients[i], &self.variances(i))
    }
}

fn solve(blocks: &[Block], step_s: f64, by_differences: impl Fn() -> f64) -> Result<TemperatureFit> {
    if blocks.len() < FEWEST {
        let found = format!("{} means of rate and temperature", blocks.len());
        return Err(Error::new(ErrorKind::TooShort, "log", found).hint("record a longer log"));
    }
    let count: f64 = blocks.iter().map(|b| b.n).sum();
    let over = |of: &dyn Fn(&Block) -> f64| blocks.iter().map(|b| b.n * of(b)).sum::<f64>() / count;
    let mean_c = over(&|b| b.temperature);
    let ends = |(low, high): (f64, f64), b: &Block| (low.min(b.temperature), high.max(b.temperature));
    let (low, high) = blocks.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let constant = || {
        Error::new(ErrorKind::Value, "log", format!("the temperature is {mean_c:.2} °C throughout"))
            .at(format!("channel {:?}", names::TEMPERATURE))
            .hint("record a log in which the sensor warms or cools")
    };
    if !(high - low > CONSTANT_C) {
        return Err(constant());
    }
    // a tenth of a degree is easier to read, and no further from the mean than matters
    let reference_c = if high - low > 1.0 { (10.0 * mean_c).round() / 10.0 } else { mean_c };
    let half = 0.5 * (high - low);
    let level = over(&|b| b.rate);
    let rise = |b: &Block| (b.temperature - reference_c) / half;
    let line = polynomial(blocks, 1, level, &rise).ok_or_else(constant)?;
    let bent = polynomial(blocks, 2, level, &rise);
    let curvature_p_value = bent.as_ref().map(|s| s.p_value(2));
    let (best, curved) = match bent {
        Some(bent) if curvature_p_value.is_some_and(|p| p < CURVED) => (bent, true),
        _ => (line, false),
    };
    let p_value = if curved { (2.0 * best.p_value(1).min(best.p_value(2))).min(1.0) } else { best.p_value(1) };

    let k = best.coefficients.len();
    let scale = |i: usize| half.powi(-(i as i32));
    let mut covariance = [[0.0; 3]; 3];
    for (i, row) in covariance.iter_mut().enumerate().take(k) {
        for (j, value) in row.iter_mut().enumerate().take(k) {
            *value = scale(i) * scale(j) * best.noise.mean(|m| m.covariance[(i, j)]);
        }
    }
    let freedom = count - k as f64;
    let white = best.rss / freedom;
    let estimate = |i: usize| {
        let value = best.coefficients[i] * scale(i) + if i == 0 { level } else { 0.0 };
        let half_width = best.noise.half_width(&best.variances(i), LEVEL) * scale(i);
        let std_white = (white * best.noise.inverse_normal[(i, i)]).sqrt() * scale(i);
        let ci95 = [value - half_width, value + half_width];
        Estimate { estimate: value, std: covariance[i][i].sqrt(), std_white, ci95 }
    };
    // neighbours differ by twice the variance of the noise, and by next to nothing else
    let jumps: f64 = blocks.windows(2).map(|w| (w[1].temperature - w[0].temperature).powi(2)).sum();
    let noise_c2 = 0.5 * jumps / (blocks.len() - 1) as f64;
    let spread_c2 = over(&|b| (b.temperature - mean_c).powi(2));
    Ok(TemperatureFit {
        reference_c,
        bias_rad_s: estimate(0),
        sensitivity_rad_s_k: estimate(1),
        curvature_rad_s_k2: curved.then(|| estimate(2)),
        covariance,
        p_value,
        curvature_p_value,
        range_c: [low, high],
        temperature_noise_c: noise_c2.sqrt(),
        attenuation: (noise_c2 / spread_c2).min(1.0),
        residual_std_rad_s: white.sqrt(),
        noise: estimate_noise(&best.noise, step_s, white, &by_differences),
        explanation: None,
    })
}

/// Weighted least squares of rate less `level` on powers of `rise` up to `degree`. `None` where they cannot be told apart.
fn polynomial(blocks: &[Block], degree: usize, level: f64, rise: &dyn Fn(&Block) -> f64) -> Option<Solved> {
    let k = degree + 1;
    let powers = |b: &Block| {
        let u = rise(b);
        DVector::from_fn(k, |i, _| u.powi(i as i32))
    };
    let mut normal = DMatrix::<f64>::zeros(k, k);
    for b in blocks {
        let x = powers(b);
        normal.ger(b.n, &x, &x, 1.0);
    }
    // two temperatures hold no parabola, whatever rounding makes of it
    let inverse = noise::inverse(&normal).filter(|v| (0..k).all(|i| v[(i, i)] * normal[(i, i)] < MOST_INFLATED))?;
    let mut coefficients = DVector::<f64>::zeros(k);
    // the second round gives back the digits that the first one lost
    for _ in 0..2 {
        let mut right = DVector::<f64>::zeros(k);
        for b in blocks {
            let x = powers(b);
            right.axpy(b.n * (b.rate - level - coefficients.dot(&x)), &x, 1.0);
        }
        coefficients += &inverse * right;
    }
    let count: f64 = blocks.iter().map(|b| b.n).sum();
    let mut groups: Vec<BlockSum> = Vec::new();
    let mut sums: Vec<Vec<f64>> = vec![Vec::new(); k];
    let mut residuals = Vec::new();
    let mut open = (BlockSum::default(), DVector::<f64>::zeros(k), 0.0);
    let mut rss = 0.0;
    for (i, b) in blocks.iter().enumerate() {
        let x = powers(b);
        let residual = b.rate - level - coefficients.dot(&x);
        rss += b.within + b.n * residual * residual;
        open.0.n += b.n;
        open.0.mid_s += b.n * b.mid_s;
        open.1.axpy(b.n, &x, 1.0);
        open.2 += b.n * residual;
        if open.0.n >= count / noise::GROUPS as f64 || i + 1 == blocks.len() {
            let (mut group, x, residual) = std::mem::replace(&mut open, (BlockSum::default(), DVector::zeros(k), 0.0));
            group.mid_s /= group.n;
            groups.push(group);
            sums.iter_mut().zip(x.iter()).for_each(|(s, x)| s.push(*x));
            residuals.push(residual);
        }
    }
    // groups follow one another: each ends half way to the next
    let middles: Vec<f64> = groups.iter().map(|g| g.mid_s).collect();
    for (i, group) in groups.iter_mut().enumerate() {
        let half_way = |j: usize| 0.5 * (middles[i] + middles[j]);
        let (before, after) = (i.checked_sub(1).map(half_way), (i + 1 < middles.len()).then(|| half_way(i + 1)));
        group.begin_s = before.or(after.map(|a| 2.0 * middles[i] - a)).unwrap_or(middles[i]);
        group.end_s = after.unwrap_or(2.0 * middles[i] - group.begin_s);
    }
    let span_s = blocks.last()?.mid_s - blocks[0].mid_s;
    let noise = noise::fit(&groups, &Columns { groups: sums, normal }, &residuals, span_s)?;
    Some(Solved { coefficients, noise, rss })
}

#[cfg(test)]
mod tests;
