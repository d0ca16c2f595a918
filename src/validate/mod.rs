//! Floor 3: are the residuals white, at every averaging time?
//!
//! Slow structure hides under white noise at the sample rate: a random walk that ruins the heading in a minute is a
//! thousandth of the variance of a sample. So the residuals are tested as samples and as means over 1, 10, 100 s …,
//! each by four tests. The joint level comes from permutations of the residuals with the fit repeated on each (the
//! fitted directions projected out), as the smallest p value of all (Westfall and Young 1993): its size is right
//! however few the blocks, however the tests depend on each other, and whatever the distribution of the noise.

use crate::math::basis::Basis;
use crate::math::random::Stream;
use crate::math::whiteness::{self, Plan, Whiteness};
use crate::signal::TimeAxis;
use crate::signal::slots::{block_means, slots};
use rayon::prelude::*;
use serde::Serialize;

/// How the verdict is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// White residuals fail with this probability.
    pub level: f64,
    /// Permutations.
    pub draws: usize,
    /// Seed of the permutations.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { level: 0.05, draws: 999, seed: 1 }
    }
}

/// One averaging time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Level {
    /// Averaging time, s.
    pub averaging_time_s: f64,
    /// Slots averaged in a block; 1 for the samples themselves.
    pub block_samples: usize,
    /// The tests with their textbook p values.
    #[serde(flatten)]
    pub whiteness: Whiteness,
    /// p values of the four tests, in the order of `Whiteness::TESTS`, by permutation; where there are more than
    /// 20 000 blocks the textbook ones, which are exact enough there.
    pub calibrated_p_values: [f64; 4],
    /// Cumulative periodogram, from the lowest frequency to Nyquist.
    #[serde(skip)]
    pub cumulative_periodogram: Vec<f64>,
}

/// The verdict and its evidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validation {
    /// Whether the joint p value is above the level.
    pub white: bool,
    /// Joint p value over all tests and averaging times; NaN (JSON: null) where there are too few samples to test.
    pub joint_p_value: f64,
    /// Level of the verdict.
    pub level: f64,
    /// Permutations.
    pub draws: usize,
    /// Seed of the permutations.
    pub seed: u64,
    /// From the samples to the longest averaging time with 12 blocks.
    pub levels: Vec<Level>,
}

impl Validation {
    /// The most telling test: index of the level, name of the test, its p value.
    #[must_use]
    pub fn strongest(&self) -> Option<(usize, &'static str, f64)> {
        let all = self.levels.iter().enumerate().flat_map(|(i, level)| {
            level.calibrated_p_values.iter().zip(Whiteness::TESTS).map(move |(p, name)| (i, name, *p))
        });
        all.min_by(|a, b| a.2.total_cmp(&b.2))
    }
}

/// Levels with more blocks keep their textbook p values.
const MOST_PERMUTED: usize = 20_000;

/// Tests `residual` (rad/s) at `time` (s). `fitted` holds the directions that the fit has taken out of it (columns
/// of its Jacobian, one value a sample): the same is done to each permutation.
#[must_use]
pub fn whiteness(time: &TimeAxis, residual: &[f64], fitted: &[Vec<f64>], options: &Options) -> Validation {
    let series = slots(time, residual);
    let step_s = time.median_step_s();
    let sizes = block_sizes(series.len(), step_s);
    let columns =
        |size: usize| -> Vec<Vec<f64>> { fitted.iter().map(|c| block_means(&slots(time, c), size)).collect() };
    judge(series.len(), step_s, &sizes, &|size| block_means(&series, size), &columns, options)
}

/// The tests at averages over `sizes` slots of `slots`: `means` and `columns` give the residuals and the fitted directions
/// at a size.
fn judge(
    slots: usize,
    step_s: f64,
    sizes: &[usize],
    means: &dyn Fn(usize) -> Vec<f64>,
    columns: &dyn Fn(usize) -> Vec<Vec<f64>>,
    options: &Options,
) -> Validation {
    let mut levels: Vec<Level> = Vec::new();
    for &size in sizes {
        let blocks = means(size);
        if let Some((whiteness, ordinates)) = whiteness::evaluate(&blocks, &mut Plan::new(blocks.len())) {
            levels.push(Level {
                averaging_time_s: step_s * size as f64,
                block_samples: size,
                calibrated_p_values: whiteness.p_values(),
                whiteness,
                cumulative_periodogram: whiteness::cumulative(&ordinates),
            });
        }
    }
    let joint_p_value = joint(slots, means, columns, &mut levels, options);
    Validation {
        white: joint_p_value > options.level,
        joint_p_value,
        level: options.level,
        draws: options.draws,
        seed: options.seed,
        levels,
    }
}

/// The samples, then decades of seconds.
fn block_sizes(slots: usize, step_s: f64) -> Vec<usize> {
    let mut sizes = vec![1];
    let mut averaging_s = 1.0;
    while averaging_s < 1e9 {
        let size = (averaging_s / step_s).round();
        if size >= 2.0 {
            if (slots as f64 / size) < whiteness::FEWEST as f64 {
                break;
            }
            sizes.push(size as usize);
        }
        averaging_s *= 10.0;
    }
    sizes
}

/// Calibrates the p values of the levels and returns the joint one.
fn joint(
    slots: usize,
    means: &dyn Fn(usize) -> Vec<f64>,
    columns: &dyn Fn(usize) -> Vec<Vec<f64>>,
    levels: &mut [Level],
    options: &Options,
) -> f64 {
    let Some(first) = levels.iter().position(|l| slots / l.block_samples <= MOST_PERMUTED) else {
        return sidak(levels.iter().flat_map(|l| l.calibrated_p_values).fold(f64::NAN, f64::min), 4 * levels.len());
    };
    let base_size = levels[first].block_samples;
    let base = means(base_size);
    let directions = orthonormal(&columns(base_size), &base);
    let ratios: Vec<usize> = levels[first..].iter().map(|l| l.block_samples / base_size).collect();
    let plans: Vec<Plan> = ratios.iter().map(|r| Plan::new(base.len() / r)).collect();
    let drawn: Vec<Vec<f64>> = (0..options.draws as u64)
        .into_par_iter()
        .map_init(
            || plans.clone(),
            |plans, draw| permuted_p_values(&base, &directions, &ratios, plans, options.seed, draw),
        )
        .filter(|p| p.len() == 4 * ratios.len())
        .collect();
    if drawn.is_empty() {
        return f64::NAN;
    }
    let observed: Vec<f64> = levels[first..].iter().flat_map(|l| l.calibrated_p_values).collect();
    let total = drawn.len() as f64 + 1.0;
    let sorted: Vec<Vec<f64>> = (0..observed.len())
        .map(|i| {
            let mut column: Vec<f64> = drawn.iter().map(|d| d[i]).collect();
            column.sort_by(f64::total_cmp);
            column
        })
        .collect();
    // ranks among all permutations and the log itself, for each of them alike: else the smallest would not compare
    let rank =
        |p: f64, i: usize| (sorted[i].partition_point(|q| *q <= p) + usize::from(observed[i] <= p)) as f64 / total;
    let calibrated: Vec<f64> = observed.iter().enumerate().map(|(i, p)| rank(*p, i)).collect();
    for (level, p) in levels[first..].iter_mut().zip(calibrated.chunks_exact(4)) {
        level.calibrated_p_values.copy_from_slice(p);
    }
    let smallest = calibrated.iter().copied().fold(f64::INFINITY, f64::min);
    let as_small = drawn
        .iter()
        .filter(|d| d.iter().enumerate().map(|(i, p)| rank(*p, i)).fold(f64::INFINITY, f64::min) <= smallest)
        .count();
    let permuted = (1 + as_small) as f64 / total;
    // finer levels look at other frequencies: independent of the blocks, their own tests dependent at most
    let fine = levels[..first].iter().flat_map(|l| l.calibrated_p_values).fold(f64::INFINITY, f64::min);
    if first == 0 { permuted } else { sidak(permuted.min(sidak(fine, 4 * first)), 2) }
}

/// p value of the smallest of `n` independent p values (Šidák, J. Am. Stat. Assoc. 62 (1967) 626).
fn sidak(smallest: f64, n: usize) -> f64 {
    -((-smallest).ln_1p() * n as f64).exp_m1()
}

/// p values of all levels for one permutation of the base level.
fn permuted_p_values(
    base: &[f64],
    directions: &Basis,
    ratios: &[usize],
    plans: &mut [Plan],
    seed: u64,
    draw: u64,
) -> Vec<f64> {
    let mut there: Vec<f64> = base.iter().copied().filter(|v| v.is_finite()).collect();
    Stream::new(seed, draw).shuffle(&mut there);
    let mut next = there.into_iter();
    let mut series: Vec<f64> =
        base.iter().map(|v| if v.is_finite() { next.next().unwrap_or(f64::NAN) } else { f64::NAN }).collect();
    for d in &directions.columns {
        let along: f64 = series.iter().zip(d).filter(|(v, _)| v.is_finite()).map(|(v, d)| v * d).sum();
        series.iter_mut().zip(d).for_each(|(v, d)| *v -= along * d);
    }
    let mut out = Vec::with_capacity(4 * ratios.len());
    for (ratio, plan) in ratios.iter().zip(plans) {
        if let Some((w, _)) = whiteness::evaluate(&block_means(&series, *ratio), plan) {
            out.extend(w.p_values());
        }
    }
    out
}

/// Orthonormal basis of the columns over the slots that are there.
fn orthonormal(columns: &[Vec<f64>], base: &[f64]) -> Basis {
    let mut basis = Basis::default();
    for column in columns {
        let both = column.iter().zip(base);
        let masked: Vec<f64> = both.map(|(c, b)| if b.is_finite() && c.is_finite() { *c } else { 0.0 }).collect();
        basis.push(&masked);
    }
    basis
}

mod reduced;

pub use reduced::{Residuals, whiteness_reduced};

#[cfg(test)]
mod tests;
