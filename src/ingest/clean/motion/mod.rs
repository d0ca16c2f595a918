//! Motion in a log that should be at rest.
//!
//! The log is cut into windows of half a second (ten samples at least). Of each, two numbers that a stray sample cannot
//! move: its level (median) and its spread (mean deviation from it, the largest tenth left out). A window moves if
//!
//! - its spread is larger than the log's own rest spread by more than its scatter explains, or
//! - its level leaves the rest level before it, and also the rest level after it.
//!
//! The rest level is followed, forward and backward, as a random walk under white noise: a window belongs to it if it lies
//! within z √(a² + w² g) + 2 |r| g + f of the last window that did, g windows before. a and w are the white and the walking
//! part of the level's scatter, told apart by its differences over one and over several windows; r is the drift of the last
//! windows, f two standard deviations of a sample (or two lattice steps). So drift and random walk of the bias are followed,
//! and a bias step, which is left in one direction only, is no motion. z makes the chance of one false alarm in a log of
//! normal noise less than 1e-3.
//!
//! Limits: a turn at constant rate, without more noise than at rest, for longer than two minutes is taken for two bias steps;
//! so is a turn of less than a degree per second that the log begins or ends in;
//! two bias steps within two minutes, there and back and of more than f, are taken for a turn.

use crate::math::robust::{mad_std, median, quantile};
use crate::signal::TimeAxis;
use crate::units::RAD_S_PER_DEG_S;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

/// Stretch of time, s, on the log's clock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Interval {
    /// First moment.
    pub start_s: f64,
    /// Last moment.
    pub end_s: f64,
}

/// Where a log moves.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Motion {
    /// Whether the log is long enough to tell (ten windows).
    pub assessed: bool,
    /// Length of a window, s.
    pub window_s: f64,
    /// Stretches that move, one window added at either end.
    pub intervals: Vec<Interval>,
    /// Their total length, s.
    pub total_s: f64,
    /// Samples in them.
    pub samples: usize,
}

/// Chance of a false alarm per log.
const FALSE_ALARM: f64 = 1e-3;
const WINDOW_S: f64 = 0.5;
const FEWEST_SAMPLES: usize = 10;
const FEWEST_WINDOWS: usize = 10;
/// Windows after which a level that stays where it is counts as the rest level.
const RELOCK: usize = 240;
/// No bias of a working gyro jumps by more, rad/s: one degree per second.
const LARGEST_STEP_RAD_S: f64 = RAD_S_PER_DEG_S;
/// Windows over which the drift of the rest level is taken.
const DRIFT: usize = 20;

/// Windows that means over blocks are gathered into.
const MOST_WINDOWS: usize = 1 << 17;

struct Window {
    first: usize,
    last: usize,
    level: f64,
    spread: f64,
}

/// Finds the motion in `rate`, sampled at `time` about `step_s` apart, with the noise of a sample and its lattice.
pub(crate) fn detect(time: &TimeAxis, rate: &[f64], step_s: f64, noise_std: f64, lattice: Option<f64>) -> Motion {
    let per_window = ((WINDOW_S / step_s).round() as usize).clamp(FEWEST_SAMPLES, rate.len().max(FEWEST_SAMPLES));
    let q = lattice.unwrap_or(0.0);
    let windows = cut(rate, per_window, q);
    let at = |i: usize| time.at(i);
    let mut motion = judge(&windows, &at, per_window, per_window as f64 * step_s, noise_std, q);
    let within = |i: &Interval| time.partition_point(|t| t <= i.end_s) - time.partition_point(|t| t < i.start_s);
    motion.samples = motion.intervals.iter().map(within).sum();
    motion
}

/// Finds the motion in means over blocks of `block` samples, whose first times are `time_s`, with the spread of the samples in
/// each; a block without a mean is passed over. A spread that is a standard deviation sees a stray sample; a window as long
/// as a block cannot tell it from motion.
pub(crate) fn detect_blocks(
    time_s: &[f64],
    means: &[f64],
    spreads: &[f64],
    block: usize,
    block_s: f64,
    noise_std: f64,
) -> Motion {
    let together = ((WINDOW_S / block_s).ceil() as usize).max(FEWEST_SAMPLES.div_ceil(block));
    let together = together.max(means.len().div_ceil(MOST_WINDOWS)).max(1);
    let window = |k: usize| -> Option<Window> {
        let (first, last) = (k * together, (k * together + together).min(means.len()) - 1);
        let there: Vec<usize> = (first..=last).filter(|&i| means[i].is_finite()).collect();
        let n = there.len() as f64;
        let level = there.iter().map(|&i| means[i]).sum::<f64>() / n;
        // within the blocks and between them
        let within = |i: &usize| spreads[*i].powi(2) + (means[*i] - level).powi(2);
        let spread = (there.iter().map(within).sum::<f64>() / n).sqrt();
        (2 * there.len() > last - first).then_some(Window { first, last, level, spread })
    };
    let windows: Vec<Window> = (0..means.len() / together).filter_map(window).collect();
    let mut motion = judge(&windows, &|i| time_s[i], together * block, together as f64 * block_s, noise_std, 0.0);
    let within = |i: &Interval| ((i.end_s - i.start_s) / block_s).round() as usize * block;
    motion.samples = motion.intervals.iter().map(within).sum();
    motion
}

/// Which windows move; the samples in them are not counted yet.
fn judge(
    windows: &[Window],
    at_s: &dyn Fn(usize) -> f64,
    per_window: usize,
    window_s: f64,
    noise_std: f64,
    q: f64,
) -> Motion {
    let mut motion = Motion { assessed: false, window_s, intervals: Vec::new(), total_s: 0.0, samples: 0 };
    if windows.len() < FEWEST_WINDOWS {
        return motion;
    }
    motion.assessed = true;
    let m = windows.len() as f64;
    // two tests a window, each two-sided; the scale is itself an estimate, the more uncertain the fewer windows there are
    let z = Normal::standard().inverse_cdf(1.0 - FALSE_ALARM / (4.0 * m)) * (1.0 + 3.0 / m.sqrt());
    let calm = calm(windows, per_window, z);
    let levels: Vec<f64> = windows.iter().map(|w| w.level).collect();
    let walk = Walk::of(&levels, z, (2.0 * noise_std).max(2.0 * q));
    // a gap in the log counts as the windows that it could have held
    let start: Vec<f64> = windows.iter().map(|w| at_s(w.first) / window_s).collect();
    let forward = walk.leaves(&levels, &start, &calm);
    let reversed = |x: &[f64], sign: f64| x.iter().rev().map(|v| sign * v).collect::<Vec<f64>>();
    let calm_back: Vec<bool> = calm.iter().rev().copied().collect();
    let mut backward = walk.leaves(&reversed(&levels, 1.0), &reversed(&start, -1.0), &calm_back);
    backward.reverse();
    let mut moves: Vec<bool> =
        (0..windows.len()).map(|k| !calm[k] || (forward[k] > 0.0 && backward[k] > 0.0)).collect();
    // at its ends a log is left by motion in one direction only; beyond a degree per second no bias steps
    let large = LARGEST_STEP_RAD_S.max(20.0 * noise_std);
    let end = forward.iter().rev().zip(calm.iter().rev()).take_while(|(f, calm)| **f > large || !**calm).count();
    let start = backward.iter().zip(&calm).take_while(|(b, calm)| **b > large || !**calm).count();
    if start.max(end) < windows.len() / 2 {
        moves[..start].fill(true);
        moves[windows.len() - end..].fill(true);
    }
    for k in (0..windows.len()).filter(|&k| moves[k]) {
        let start_s = at_s(windows[k.saturating_sub(1)].first);
        let end_s = at_s(windows[(k + 1).min(windows.len() - 1)].last);
        match motion.intervals.last_mut() {
            Some(before) if start_s <= before.end_s + window_s => before.end_s = end_s,
            _ => motion.intervals.push(Interval { start_s, end_s }),
        }
    }
    motion.total_s = motion.intervals.iter().map(|i| i.end_s - i.start_s).sum();
    motion
}

/// Windows of `per_window` samples; what is left over at the end belongs to the last one.
fn cut(rate: &[f64], per_window: usize, q: f64) -> Vec<Window> {
    let count = rate.len() / per_window;
    (0..count)
        .into_par_iter()
        .map_init(Vec::new, |x, k| {
            let first = k * per_window;
            let last = if k + 1 == count { rate.len() } else { first + per_window };
            x.clear();
            x.extend_from_slice(&rate[first..last]);
            let level = median(x);
            x.iter_mut().for_each(|v| *v = (*v - level).abs());
            let keep = x.len() - x.len().div_ceil(10);
            x.select_nth_unstable_by(keep - 1, f64::total_cmp);
            let spread = x[..keep].iter().sum::<f64>() / keep as f64;
            // between two levels of the lattice the spread cannot be told
            Window { first, last: last - 1, level, spread: spread.hypot(q / 2.0) }
        })
        .collect()
}

/// Which windows are as calm as the log at rest: the lower quartile of all windows is taken to be at rest.
fn calm(windows: &[Window], per_window: usize, z: f64) -> Vec<bool> {
    let logs: Vec<f64> = windows.iter().map(|w| w.spread.max(f64::MIN_POSITIVE).ln()).collect();
    let low = quantile(&mut logs.clone(), 0.05);
    let quarter = quantile(&mut logs.clone(), 0.25);
    // normal quantiles: Φ⁻¹(0.25) = -0.674, Φ⁻¹(0.05) = -1.645; a mean deviation scatters by about 0.8/√n
    let scatter = ((quarter - low) / 0.970).max(0.8 / (per_window as f64).sqrt());
    let most = quarter + 0.674 * scatter + (z * scatter).max(std::f64::consts::LN_2);
    logs.iter().map(|&l| l <= most).collect()
}

/// A rest level that walks under white noise.
struct Walk {
    z: f64,
    /// Variance of the difference of two neighbouring windows that comes from white noise.
    white: f64,
    /// Variance that the walk adds a window.
    walking: f64,
    floor: f64,
}

impl Walk {
    /// Differences over `lag` windows have the variance white + lag · walking.
    fn of(levels: &[f64], z: f64, floor: f64) -> Self {
        const LAG: usize = 16;
        let variance = |lag: usize| {
            let mut differences: Vec<f64> = levels.iter().zip(&levels[lag..]).map(|(a, b)| b - a).collect();
            let centre = median(&mut differences);
            mad_std(&mut differences, centre).powi(2)
        };
        let near = variance(1);
        let lag = LAG.min(levels.len() / 8);
        if lag < 2 {
            // too short to tell the two apart: all of it walks
            return Self { z, white: 0.0, walking: near, floor };
        }
        // few independent differences over a long lag: three standard errors on the safe side
        let far = variance(lag) * (1.0 + 3.0 * (lag as f64 / levels.len() as f64).sqrt());
        let walking = ((far - near) / (lag - 1) as f64).max(0.0);
        Self { z, white: (near - walking).max(0.0), walking, floor }
    }

    /// How far the calm windows lie off the rest level that was followed up to them; 0 for those that belong to it.
    fn leaves(&self, levels: &[f64], at: &[f64], calm: &[bool]) -> Vec<f64> {
        let n = levels.len();
        let mut off = vec![0.0; n];
        let mut first: Vec<f64> = (0..n).filter(|&k| calm[k]).map(|k| levels[k]).take(9).collect();
        if first.is_empty() {
            return off;
        }
        // (where, level) of the last windows at rest
        let mut rest: std::collections::VecDeque<(f64, f64)> = std::collections::VecDeque::new();
        let mut anchor = (at[0] - 1.0, median(&mut first));
        let mut alike = 0;
        let mut before = f64::NAN;
        for k in (0..n).filter(|&k| calm[k]) {
            let g = (at[k] - anchor.0).max(1.0);
            let drift = match (rest.front(), rest.back()) {
                (Some(a), Some(b)) if rest.len() == DRIFT => ((b.1 - a.1) / (b.0 - a.0)).abs(),
                _ => 0.0,
            };
            let bound = self.z * (self.white + self.walking * g).sqrt() + 2.0 * drift * g + self.floor;
            let near = self.z * (self.white + self.walking).sqrt() + self.floor;
            alike = if (levels[k] - before).abs() <= near { alike + 1 } else { 0 };
            before = levels[k];
            let relock = alike >= RELOCK && (levels[k] - anchor.1).abs() > bound;
            if relock {
                rest.clear();
            } else if (levels[k] - anchor.1).abs() > bound {
                off[k] = (levels[k] - anchor.1).abs();
                continue;
            }
            anchor = (at[k], levels[k]);
            rest.push_back(anchor);
            if rest.len() > DRIFT {
                rest.pop_front();
            }
        }
        off
    }
}

#[cfg(test)]
mod tests;
