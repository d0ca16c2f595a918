//! Defects of a stationary log, with place, amount, and how each was handled.

use super::motion;
use super::motion::Motion;
use super::quantization;
use crate::ingest::columns::rate_unit;
use crate::math::robust::{median, quantile, stretches};
use crate::math::scan;
use crate::signal::TimeAxis;
use crate::signal::slots::GAP_STEPS;
use rayon::prelude::*;
use serde::Serialize;

/// Shorter runs of a value are never called stuck.
pub(crate) const SHORTEST_STUCK: usize = 6;
/// Samples that stand for a longer log where the middle of many is asked for: their median scatters by a four-hundredth of a
/// sample's noise.
pub(crate) const WITNESSES: usize = 1 << 18;
/// Runs of fewer samples at the end of the range are no saturation.
pub(crate) const SATURATED_RUN: usize = 3;

/// How a finding was handled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Handling {
    /// The samples are used as they are.
    Kept,
    /// The samples are left out.
    Dropped,
    /// Samples of one time stamp are spread evenly up to the next one.
    Spread,
    /// Rows were put in the order of their times.
    Sorted,
}

/// The log's clockwork.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sampling {
    /// Reciprocal of the median step, Hz.
    pub rate_hz: f64,
    /// Median time between samples, s.
    pub median_step_s: f64,
    /// Standard deviation of the steps that are no gaps, s.
    pub step_std_s: f64,
    /// First percentile of the steps, s.
    pub step_p01_s: f64,
    /// 99th percentile of the steps, s.
    pub step_p99_s: f64,
    /// Whether the samples lie on an even lattice of time within rounding.
    pub uniform: bool,
}

/// Steps longer than 1.5 median steps.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gaps {
    /// How many.
    pub count: usize,
    /// Time in them beyond one step each, s.
    pub missing_s: f64,
    /// The longest, s.
    pub longest_s: f64,
    /// Where the longest begins, s.
    pub longest_at_s: Option<f64>,
    /// Nothing is filled in: the fit works on uneven time.
    pub handling: Handling,
}

/// Samples at the same time as the one before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Duplicates {
    /// How many.
    pub count: usize,
    /// Row of the first, counted from 1.
    pub first_row: Option<usize>,
    /// Dropped where they are rare or repeat the value; spread where the clock is coarser than the sampling.
    pub handling: Handling,
}

/// Times that go backwards.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutOfOrder {
    /// How many rows were earlier than the one before.
    pub count: usize,
    /// How they were handled; where sorting is not allowed, they are an error.
    pub handling: Handling,
}

/// Rows without a rate or a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Missing {
    /// How many.
    pub count: usize,
    /// Row of the first, counted from 1.
    pub first_row: Option<usize>,
    /// They carry nothing for the fit.
    pub handling: Handling,
}

/// Runs of samples at the largest or smallest value, far from rest: the sensor's range has ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Saturation {
    /// Samples in such runs.
    pub samples: usize,
    /// Value at which they stand, rad/s; the larger one if there are two.
    pub limit_rad_s: Option<f64>,
    /// When the first begins, s.
    pub first_at_s: Option<f64>,
    /// They move the level; they lie in a stretch that moves and go with it.
    pub handling: Handling,
}

/// Runs of the same value longer than noise and lattice explain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stuck {
    /// How many runs.
    pub runs: usize,
    /// Samples in them.
    pub samples: usize,
    /// The longest, s.
    pub longest_s: f64,
    /// Where the longest begins, s.
    pub longest_at_s: Option<f64>,
    /// Length from which a run counts, samples.
    pub threshold_samples: usize,
    /// Share of all samples that repeat the one before.
    pub repeated_fraction: f64,
    /// They are told, and used.
    pub handling: Handling,
}

impl Stuck {
    /// Share of the samples from which on those in stuck runs are a sensor that froze: it would be taken for the rest, and
    /// what lives for motion.
    pub(crate) const FROZEN: f64 = 0.05;

    /// Whether so many of a log's `samples` are stuck that the sensor froze.
    pub(crate) fn is_frozen(&self, samples: usize) -> bool {
        self.samples as f64 > Self::FROZEN * samples as f64
    }
}

/// The signal at rest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rest {
    /// Median rate, rad/s.
    pub median_rad_s: f64,
    /// Standard deviation of one sample's noise, by differences, rad/s.
    pub noise_std_rad_s: f64,
    /// Largest less smallest of the medians of twenty stretches, rad/s: how far the bias moved.
    pub drift_rad_s: f64,
    /// Step of the lattice of values, rad/s; none if there is none that matters.
    pub lattice_step_rad_s: Option<f64>,
}

/// All findings of a stationary log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Audit {
    /// Rows in the file.
    pub rows: usize,
    /// Samples that remain for the fit.
    pub samples: usize,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Time from first to last sample, s.
    pub span_s: f64,
    /// Sample rate and jitter.
    pub sampling: Sampling,
    /// Gaps.
    pub gaps: Gaps,
    /// Duplicated time stamps.
    pub duplicates: Duplicates,
    /// Times that go backwards.
    pub out_of_order: OutOfOrder,
    /// Missing values.
    pub missing: Missing,
    /// Saturation.
    pub saturation: Saturation,
    /// Stuck values.
    pub stuck: Stuck,
    /// Level, noise and lattice at rest.
    pub rest: Rest,
    /// Motion; kept until the caller asks for the log without it.
    pub motion: Motion,
}

/// Intervals between neighbours, all of them or those of [`stretches`].
pub(crate) fn intervals(time_s: &[f64]) -> Vec<f64> {
    // where two stretches meet, the interval is that of no neighbours: few enough for no percentile to move
    stretches(time_s, WITNESSES).windows(2).map(|w| w[1] - w[0]).collect()
}

/// Median step and all that hangs on the steps. `time_s` increases and has at least two entries.
pub(crate) fn steps(time_s: &[f64], uniform: bool) -> (Sampling, Gaps) {
    let mut some = intervals(time_s);
    let median_step_s = median(&mut some);
    let pieces = 0..(time_s.len() - 1).div_ceil(scan::PIECE);
    let piece = |k: usize| {
        let last = ((k + 1) * scan::PIECE).min(time_s.len() - 1);
        Intervals::of(&time_s[k * scan::PIECE..=last], median_step_s)
    };
    // summed in their order, so that the result is the same on any number of cores
    let all =
        pieces.into_par_iter().map(piece).collect::<Vec<_>>().into_iter().fold(Intervals::default(), Intervals::and);
    let n = all.inside.max(1) as f64;
    let sampling = Sampling {
        rate_hz: 1.0 / median_step_s,
        median_step_s,
        step_std_s: (all.squares / n - (all.sum / n).powi(2)).max(0.0).sqrt(),
        step_p01_s: quantile(&mut some, 0.01),
        step_p99_s: quantile(&mut some, 0.99),
        uniform,
    };
    let Intervals { gaps: count, missing_s, longest_s, longest_at_s, .. } = all;
    (sampling, Gaps { count, missing_s, longest_s, longest_at_s, handling: Handling::Kept })
}

/// Intervals between neighbours, and those of them that are gaps.
#[derive(Default)]
struct Intervals {
    gaps: usize,
    missing_s: f64,
    longest_s: f64,
    longest_at_s: Option<f64>,
    /// Number of intervals that are no gaps, sum of their deviations from the median, and sum of the squares.
    inside: usize,
    sum: f64,
    squares: f64,
}

impl Intervals {
    fn of(time_s: &[f64], median_step_s: f64) -> Self {
        let mut out = Self::default();
        for w in time_s.windows(2) {
            let d = w[1] - w[0];
            let off = d - median_step_s;
            if d > GAP_STEPS * median_step_s {
                out.gaps += 1;
                out.missing_s += off;
                if d > out.longest_s {
                    (out.longest_s, out.longest_at_s) = (d, Some(w[0]));
                }
            } else {
                out.inside += 1;
                out.sum += off;
                out.squares += off * off;
            }
        }
        out
    }

    /// These, and those of the time after them.
    fn and(self, later: Self) -> Self {
        let longer = later.longest_s > self.longest_s;
        Self {
            gaps: self.gaps + later.gaps,
            missing_s: self.missing_s + later.missing_s,
            longest_s: if longer { later.longest_s } else { self.longest_s },
            longest_at_s: if longer { later.longest_at_s } else { self.longest_at_s },
            inside: self.inside + later.inside,
            sum: self.sum + later.sum,
            squares: self.squares + later.squares,
        }
    }
}

/// Findings from before the samples were put in order.
pub(crate) struct Before {
    pub rows: usize,
    pub duplicates: Duplicates,
    pub out_of_order: OutOfOrder,
    pub missing: Missing,
}

/// Judges samples that are in order: `stamps_s` as in the file, `axis` as in the recording.
pub(crate) fn judge(before: Before, stamps_s: &[f64], axis: &TimeAxis, rate: &[f64]) -> Audit {
    let middle = || {
        let witnesses = stretches(rate, WITNESSES);
        (rate_unit::noise_std(&witnesses), median(&mut witnesses.into_owned()), drift(rate))
    };
    let (((sampling, gaps), lattice_step_rad_s), (runs, (noise_std_rad_s, median_rad_s, drift_rad_s))) = rayon::join(
        || rayon::join(|| steps(stamps_s, matches!(axis, TimeAxis::Uniform { .. })), || quantization::step(rate)),
        || rayon::join(|| Runs::of(rate), middle),
    );
    let step_s = sampling.median_step_s;
    let q = lattice_step_rad_s.unwrap_or(0.0);
    let mut noise_std_rad_s = noise_std_rad_s.max(q / 12f64.sqrt());
    let far = |noise_std: f64| (10.0 * noise_std).max(5.0 * q);
    let mut stuck = stuck(axis, rate, &runs, q, noise_std_rad_s);
    let live = stuck.is_frozen(rate.len()).then(|| {
        let (rows, values) = live(rate, stuck.threshold_samples, |v| (v - median_rad_s).abs() > far(noise_std_rad_s));
        (TimeAxis::Explicit(rows.into_iter().map(|row| axis.at(row)).collect()), values)
    });
    if let Some((_, values)) = &live {
        noise_std_rad_s = rate_unit::noise_std(&stretches(values, WITNESSES)).max(q / 12f64.sqrt());
        stuck = self::stuck(axis, rate, &runs, q, noise_std_rad_s);
    }
    let (moving, seen) = live.as_ref().map_or((axis, rate), |(time, values)| (time, values));
    Audit {
        rows: before.rows,
        samples: rate.len(),
        start_s: axis.at(0),
        span_s: axis.span_s(),
        sampling,
        gaps,
        duplicates: before.duplicates,
        out_of_order: before.out_of_order,
        missing: before.missing,
        saturation: saturation(axis, rate, &runs, median_rad_s, far(noise_std_rad_s)),
        stuck,
        rest: Rest { median_rad_s, noise_std_rad_s, drift_rad_s, lattice_step_rad_s },
        motion: motion::detect(moving, seen, step_s, noise_std_rad_s, lattice_step_rad_s),
    }
}

/// Rows and values outside runs of `threshold` samples or more; a run whose value is `saturated` stays.
fn live(rate: &[f64], threshold: usize, saturated: impl Fn(f64) -> bool) -> (Vec<usize>, Vec<f64>) {
    let kept = runs(rate).filter(|(first, length)| *length < threshold || saturated(rate[*first]));
    let rows: Vec<usize> = kept.flat_map(|(first, length)| first..first + length).collect();
    let values = rows.iter().map(|&row| rate[row]).collect();
    (rows, values)
}

pub(crate) fn drift(rate: &[f64]) -> f64 {
    let size = rate.len().div_ceil(20).max(1);
    let middle = |stretch: &[f64]| median(&mut stretches(stretch, WITNESSES / 4).into_owned());
    let medians: Vec<f64> = rate.par_chunks(size).map(middle).collect();
    medians.iter().copied().fold(f64::MIN, f64::max) - medians.iter().copied().fold(f64::MAX, f64::min)
}

/// Runs of equal values as (first, length).
fn runs(rate: &[f64]) -> impl Iterator<Item = (usize, usize)> {
    rate.chunk_by(|a, b| a == b).scan(0, |first, run| {
        let at = *first;
        *first += run.len();
        Some((at, run.len()))
    })
}

/// All runs of a log.
struct Runs {
    /// How many have 1, 2, 3 and 4 samples at least.
    at_least: [usize; 4],
    longest: usize,
    smallest: f64,
    largest: f64,
}

impl Runs {
    fn of(rate: &[f64]) -> Self {
        // cut where a run begins
        let begins = |at: &usize| *at == 0 || rate[*at] != rate[*at - 1];
        let mut cuts: Vec<usize> =
            (0..rate.len()).step_by(scan::PIECE).filter_map(|k| (k..rate.len()).find(begins)).collect();
        cuts.dedup();
        cuts.push(rate.len());
        cuts.par_windows(2).map(|w| Self::of_piece(&rate[w[0]..w[1]])).reduce(Self::none, Self::and)
    }

    fn none() -> Self {
        Self { at_least: [0; 4], longest: 0, smallest: f64::MAX, largest: f64::MIN }
    }

    fn and(self, other: Self) -> Self {
        Self {
            at_least: std::array::from_fn(|k| self.at_least[k] + other.at_least[k]),
            longest: self.longest.max(other.longest),
            smallest: self.smallest.min(other.smallest),
            largest: self.largest.max(other.largest),
        }
    }

    fn of_piece(rate: &[f64]) -> Self {
        let mut all = Self::none();
        for (first, length) in runs(rate) {
            all.at_least.iter_mut().enumerate().for_each(|(k, count)| *count += usize::from(length > k));
            all.longest = all.longest.max(length);
            all.smallest = all.smallest.min(rate[first]);
            all.largest = all.largest.max(rate[first]);
        }
        all
    }
}

fn saturation(time: &TimeAxis, rate: &[f64], all: &Runs, rest: f64, far: f64) -> Saturation {
    let mut found = Saturation { samples: 0, limit_rad_s: None, first_at_s: None, handling: Handling::Kept };
    if all.longest < SATURATED_RUN {
        return found;
    }
    for (first, length) in runs(rate).filter(|r| r.1 >= SATURATED_RUN) {
        let value = rate[first];
        if (value == all.largest || value == all.smallest) && (value - rest).abs() > far {
            found.samples += length;
            found.first_at_s.get_or_insert(time.at(first));
            if found.limit_rad_s.is_none_or(|l| value.abs() > l.abs()) {
                found.limit_rad_s = Some(value);
            }
        }
    }
    found
}

/// A run goes on with a chance of p at most, so one of L samples or more turns up in n runs with a chance below n p^(L-1).
/// p is the larger of what the lattice explains (the fullest level holds erf(q/(2√2σ))) and of what the runs themselves
/// show; a run counts once there, however long it is.
fn stuck(time: &TimeAxis, rate: &[f64], all: &Runs, q: f64, noise_std: f64) -> Stuck {
    let threshold = longest_by_chance(&all.at_least, q, noise_std);
    let repeated = rate.len() - all.at_least[0];
    let mut found = Stuck {
        runs: 0,
        samples: 0,
        longest_s: 0.0,
        longest_at_s: None,
        threshold_samples: threshold,
        repeated_fraction: repeated as f64 / rate.len() as f64,
        handling: Handling::Kept,
    };
    if all.longest < threshold {
        return found;
    }
    for (first, length) in runs(rate).filter(|r| r.1 >= threshold) {
        found.runs += 1;
        found.samples += length;
        let lasts = time.at(first + length - 1) - time.at(first);
        if lasts > found.longest_s {
            (found.longest_s, found.longest_at_s) = (lasts, Some(time.at(first)));
        }
    }
    found
}

/// Length from which a run is stuck, where so many runs have 1, 2, 3 and 4 samples at least.
pub(crate) fn longest_by_chance(at_least: &[usize; 4], q: f64, noise_std: f64) -> usize {
    const FALSE_ALARM: f64 = 1e-4;
    let goes_on = |k: usize| (at_least[k + 1] + 1) as f64 / (at_least[k] + 2) as f64;
    // the later ratios rest on fewer runs: only where there are enough of them
    let shown = (0..3).filter(|&k| k == 0 || at_least[k] >= 50).map(goes_on).fold(0.0, f64::max);
    let lattice = if q > 0.0 { statrs::function::erf::erf(q / (8f64.sqrt() * noise_std)) } else { 0.0 };
    let p: f64 = shown.max(lattice).min(0.999);
    (1.0 + (at_least[0] as f64 / FALSE_ALARM).ln() / -p.ln()).ceil().max(SHORTEST_STUCK as f64) as usize
}

#[cfg(test)]
mod tests;
