//! d(x) of one recording, for every curve: block means, spectrum, Allan deviation, amplitudes, means and noise by
//! conditions

use super::axes::{amplitudes, bands, blocks, has_lines, octaves};
use super::calm::without_outliers;
use super::condition::{Condition, conditions};
use super::repeatability::Repeatability;
use crate::gap::rest::predictive::curve::{Over, Shown};
use crate::math::robust::{MAD_TO_STD, median};
use crate::math::spectra::{Periodogram, quick_len};
use crate::model::Scene;
use std::f64::consts::SQRT_2;

const RATE: &str = "rad/s";
const POWER: &str = "rad²/s²/Hz";

/// Scatter of the values of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scatter {
    /// The same standard deviation everywhere.
    Normal,
    /// A standard deviation in proportion to the value.
    Logarithmic,
    /// That of counts out of this total.
    Counts(f64),
}

/// Definition of one curve.
pub(super) struct Recipe {
    pub over: Over,
    pub shown: Shown,
    pub x_unit: &'static str,
    pub unit: &'static str,
    pub x: Vec<f64>,
    pub bins: Vec<[f64; 2]>,
    pub scatter: Scatter,
}

impl Recipe {
    fn new(over: Over, shown: Shown, bins: Vec<[f64; 2]>, scatter: Scatter) -> Self {
        let geometric = matches!(over, Over::Frequency | Over::AveragingTime);
        let middle = |[a, b]: &[f64; 2]| if geometric { (a * b).sqrt() } else { 0.5 * (a + b) };
        let x_unit = match over {
            Over::Time | Over::AveragingTime | Over::ElapsedTime => "s",
            Over::Frequency => "Hz",
            Over::Amplitude => "standard deviations",
            Over::TemperatureC => "°C",
            Over::TemperatureRate => "°C/s",
            Over::SupplyV => "V",
        };
        let unit = match shown {
            Shown::Power | Shown::LargestPower => POWER,
            Shown::ShareOfSamples | Shown::NoiseLevel => "1",
            _ => RATE,
        };
        Self { over, shown, x_unit, unit, x: bins.iter().map(middle).collect(), bins, scatter }
    }
}

/// Measurement of recordings of one scene, all with the same samples missing.
pub(super) struct Instrument {
    pub recipes: Vec<Recipe>,
    step_s: f64,
    samples: f64,
    transformed: usize,
    warm_up_rad_s: Vec<f64>,
    repeatability: Repeatability,
    blocks: Vec<[usize; 2]>,
    bands: Vec<[usize; 2]>,
    periodogram: Periodogram,
    octaves: Vec<usize>,
    amplitudes: Vec<f64>,
    white_std_rad_s: f64,
    conditions: Vec<Condition>,
}

impl Instrument {
    /// For recordings of `scene` in which the same samples are missing as in `recorded_rad_s`.
    pub(crate) fn new(scene: &Scene, recorded_rad_s: &[f64]) -> Self {
        let rows = scene.len();
        let there: Vec<bool> = recorded_rad_s.iter().map(|v| v.is_finite()).collect();
        let step_s = scene.step_s;
        let blocks: Vec<[usize; 2]> =
            blocks(rows).into_iter().filter(|[a, b]| there[*a..*b].iter().any(|t| *t)).collect();
        // the spectrum is that of the largest number of rows with a fast transform
        let transformed = quick_len(rows);
        let bands = bands((transformed - 1) / 2);
        let octaves = octaves(rows);
        let amplitudes = amplitudes();
        let differences = there.windows(2).filter(|w| w[0] && w[1]).count();
        let conditions = conditions(scene, &there);

        let time = |[a, b]: &[usize; 2]| [scene.time.at(*a), scene.time.at(b - 1) + step_s];
        let hertz = 1.0 / (transformed as f64 * step_s);
        let band = |[a, b]: &[usize; 2]| [(*a as f64 - 0.5) * hertz, (*b as f64 - 0.5) * hertz];
        let lines = bands.iter().filter(|b| has_lines(b));
        let averaging = |m: &usize| [*m as f64 * step_s / SQRT_2, *m as f64 * step_s * SQRT_2];
        let mut recipes = vec![
            Recipe::new(Over::Time, Shown::Deviation, blocks.iter().map(time).collect(), Scatter::Normal),
            Recipe::new(Over::Frequency, Shown::Power, bands.iter().map(band).collect(), Scatter::Logarithmic),
            Recipe::new(Over::Frequency, Shown::LargestPower, lines.map(band).collect(), Scatter::Logarithmic),
            Recipe::new(
                Over::AveragingTime,
                Shown::AllanDeviation,
                octaves.iter().map(averaging).collect(),
                Scatter::Logarithmic,
            ),
            Recipe::new(
                Over::Amplitude,
                Shown::ShareOfSamples,
                amplitudes.windows(2).map(|w| [w[0], w[1]]).collect(),
                Scatter::Counts(differences as f64),
            ),
        ];
        for c in &conditions {
            for (shown, scatter) in [(Shown::Deviation, Scatter::Normal), (Shown::NoiseLevel, Scatter::Logarithmic)] {
                recipes.push(Recipe { x: c.x.clone(), ..Recipe::new(c.over, shown, c.edges.clone(), scatter) });
            }
        }
        Self {
            recipes,
            step_s,
            samples: there[..transformed].iter().filter(|t| **t).count() as f64,
            transformed,
            warm_up_rad_s: (0..rows).map(|row| scene.warm_up.error_rad_s(scene.time.at(row))).collect(),
            repeatability: Repeatability::new(scene, &there),
            blocks,
            bands,
            periodogram: Periodogram::new(transformed),
            octaves,
            amplitudes,
            white_std_rad_s: scene.white_std_rad_s,
            conditions,
        }
    }

    /// Values of every recipe, in the order of the recipes.
    pub(crate) fn read(&self, y_rad_s: &[f64]) -> Vec<Vec<f64>> {
        let differences = |y: &[f64]| -> Vec<f64> { y.windows(2).map(|w| w[1] - w[0]).collect() };
        let shares = self.shares(&differences(y_rad_s));
        // outliers count in the curve of the amplitudes alone
        let y_rad_s = without_outliers(y_rad_s);
        let mut deviation: Vec<f64> = y_rad_s.iter().zip(&self.warm_up_rad_s).map(|(y, e)| y - e).collect();
        self.repeatability.remove(&mut deviation);
        let differences = differences(&y_rad_s);
        let ordinates = self.periodogram.clone().ordinates(&deviation[..self.transformed]);
        // two-sided: Σ PSD / (transformed rows · step) over all frequencies is the variance
        let to_density = self.step_s / self.samples;
        let of_band = |[a, b]: &[usize; 2]| &ordinates[a - 1..b - 1];
        let mean = |band: &[usize; 2]| of_band(band).iter().sum::<f64>() / (band[1] - band[0]) as f64 * to_density;
        let largest = |band: &[usize; 2]| of_band(band).iter().copied().fold(0.0, f64::max) * to_density;
        let mut out = vec![
            self.blocks.iter().map(|[a, b]| mean_there(&deviation[*a..*b])).collect(),
            self.bands.iter().map(mean).collect(),
            self.bands.iter().filter(|b| has_lines(b)).map(largest).collect(),
            self.allan_deviation(&deviation),
            shares,
        ];
        for c in &self.conditions {
            // a constant offset or level depends on no condition: offsets show over time, levels over frequency
            let mean = mean_there(&deviation);
            out.push(by_bin(c, &deviation, |v| v - mean));
            let squares = differences.iter().map(|v| v * v);
            let level = mean_there(&squares.collect::<Vec<_>>()).max(f64::MIN_POSITIVE);
            out.push(by_bin(c, &differences, |v| v * v / level).into_iter().map(f64::sqrt).collect());
        }
        out
    }

    /// σ²(τ) = Σ (θ(t+2τ) - 2 θ(t+τ) + θ(t))² / (2 τ² count), missing samples as zero.
    fn allan_deviation(&self, deviation: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        let mut angle = Vec::with_capacity(deviation.len() + 1);
        angle.push(0.0);
        for d in deviation {
            sum += if d.is_finite() { *d } else { 0.0 };
            angle.push(sum);
        }
        let at = |m: &usize| {
            // starts τ/32 apart lose hardly any information
            let starts = (0..angle.len() - 2 * m).step_by((m / 32).max(1));
            let count = starts.len() as f64;
            let squares: f64 = starts.map(|k| (angle[k + 2 * m] - 2.0 * angle[k + m] + angle[k]).powi(2)).sum();
            (squares / (2.0 * count)).sqrt() / *m as f64
        };
        self.octaves.iter().map(at).collect()
    }

    /// Shares of the differences by size, in their own robust standard deviations; their level shows in the spectrum.
    fn shares(&self, differences: &[f64]) -> Vec<f64> {
        let mut sizes: Vec<f64> = differences.iter().filter(|d| d.is_finite()).map(|d| d.abs()).collect();
        let own = MAD_TO_STD * median(&mut sizes);
        // with coarse quantization most differences are zero
        let scale = if own > 0.0 { own } else { SQRT_2 * self.white_std_rad_s };
        let mut counts = vec![0_usize; self.amplitudes.len() - 1];
        for size in &sizes {
            let bin = self.amplitudes.partition_point(|e| *e <= size / scale);
            counts[bin.clamp(1, self.amplitudes.len() - 1) - 1] += 1;
        }
        counts.iter().map(|n| *n as f64 / sizes.len().max(1) as f64).collect()
    }
}

fn mean_there(values: &[f64]) -> f64 {
    let (sum, count) =
        values.iter().filter(|v| v.is_finite()).fold((0.0, 0_usize), |(sum, count), v| (sum + v, count + 1));
    sum / count as f64
}

/// Mean of `of(value)` over the rows of each bin; missing values are left out.
fn by_bin(condition: &Condition, values: &[f64], of: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_usize); condition.x.len()];
    for (value, bin) in values.iter().zip(&condition.bin) {
        if let (true, Some(bin)) = (value.is_finite(), bin) {
            let (sum, count) = &mut sums[usize::from(*bin)];
            *sum += of(*value);
            *count += 1;
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0 { sum / count as f64 } else { 0.0 }).collect()
}
