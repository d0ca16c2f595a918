//! The audit of a log that was read once and not held.

use super::audit;
use super::audit::{
    Audit, Before, Handling, Rest, SATURATED_RUN, SHORTEST_STUCK, Sampling, Saturation, Stuck, longest_by_chance,
};
use super::{motion, quantization};
use crate::ingest::columns::rate_unit;
use crate::math::robust::{median, quantile};
use crate::signal::Reduced;
use crate::signal::slots::GAP_STEPS;
use std::collections::BTreeMap;

/// Intervals between samples, gaps apart.
#[derive(Debug)]
pub(crate) struct Gaps {
    step_s: f64,
    count: usize,
    missing_s: f64,
    longest_s: f64,
    longest_at_s: Option<f64>,
    /// Intervals that are no gaps: count, sum and sum of squares of their deviations from the median of the first ones.
    inside: (f64, f64, f64),
}

impl Gaps {
    /// An empty account for steps of about `step_s`.
    pub(crate) fn new(step_s: f64) -> Self {
        Self { step_s, count: 0, missing_s: 0.0, longest_s: 0.0, longest_at_s: None, inside: (0.0, 0.0, 0.0) }
    }

    /// An interval.
    pub(crate) fn add(&mut self, from_s: f64, to_s: f64) {
        let interval = to_s - from_s;
        let off = interval - self.step_s;
        if interval > GAP_STEPS * self.step_s {
            self.count += 1;
            self.missing_s += off;
            if interval > self.longest_s {
                (self.longest_s, self.longest_at_s) = (interval, Some(from_s));
            }
        } else {
            self.inside = (self.inside.0 + 1.0, self.inside.1 + off, self.inside.2 + off * off);
        }
    }

    /// The same on a clock that is `offset_s` ahead.
    pub(crate) fn shifted(mut self, offset_s: f64) -> Self {
        self.longest_at_s = self.longest_at_s.map(|t| t + offset_s);
        self
    }

    fn std_s(&self) -> f64 {
        let (n, sum, squares) = self.inside;
        (squares / n.max(1.0) - (sum / n.max(1.0)).powi(2)).max(0.0).sqrt()
    }
}

/// A value that is the largest or the smallest so far, and its runs.
#[derive(Debug, Clone, Copy)]
struct End {
    value: f64,
    samples: usize,
    first_at_s: f64,
}

impl End {
    const NONE: Self = Self { value: f64::NAN, samples: 0, first_at_s: f64::NAN };

    fn add(&mut self, run: &Run, further: bool) {
        if further || self.value.is_nan() {
            *self = Self { value: run.value, ..Self::NONE };
        }
        if run.value == self.value && run.length >= SATURATED_RUN {
            if self.samples == 0 {
                self.first_at_s = run.first_s;
            }
            self.samples += run.length;
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Run {
    value: f64,
    length: usize,
    first_s: f64,
    last_s: f64,
}

/// Runs of equal values, in the file's unit.
#[derive(Debug)]
pub(crate) struct Runs {
    open: Option<Run>,
    at_least: [usize; 4],
    /// How many runs there are of each length that may be stuck, with the longest of them in time.
    long: BTreeMap<usize, (usize, f64, f64)>,
    high: End,
    low: End,
}

impl Default for Runs {
    fn default() -> Self {
        Self { open: None, at_least: [0; 4], long: BTreeMap::new(), high: End::NONE, low: End::NONE }
    }
}

impl Runs {
    /// The next sample.
    pub(crate) fn add(&mut self, time_s: f64, value: f64) {
        match &mut self.open {
            Some(run) if run.value == value => {
                run.length += 1;
                run.last_s = time_s;
            }
            _ => {
                self.close();
                self.open = Some(Run { value, length: 1, first_s: time_s, last_s: time_s });
            }
        }
    }

    fn close(&mut self) {
        let Some(run) = self.open.take() else { return };
        for (k, count) in self.at_least.iter_mut().enumerate() {
            *count += usize::from(run.length > k);
        }
        if run.length >= SHORTEST_STUCK {
            let lasts = run.last_s - run.first_s;
            let entry = self.long.entry(run.length).or_insert((0, 0.0, f64::NAN));
            entry.0 += 1;
            if lasts > entry.1 {
                (entry.1, entry.2) = (lasts, run.first_s);
            }
        }
        self.high.add(&run, run.value > self.high.value);
        self.low.add(&run, run.value < self.low.value);
    }

    /// The same on a clock that is `offset_s` ahead.
    pub(crate) fn shifted(mut self, offset_s: f64) -> Self {
        self.close();
        self.long.values_mut().for_each(|run| run.2 += offset_s);
        self.high.first_at_s += offset_s;
        self.low.first_at_s += offset_s;
        self
    }

    /// Runs at either end of the range, further than `far` from `rest`.
    fn saturation(&self, factor: f64, rest: f64, far: f64) -> Saturation {
        let mut found = Saturation { samples: 0, limit_rad_s: None, first_at_s: None, handling: Handling::Kept };
        for end in [self.high, self.low] {
            let value = end.value * factor;
            if end.samples == 0 || (value - rest).abs() <= far {
                continue;
            }
            found.samples += end.samples;
            found.first_at_s = Some(found.first_at_s.map_or(end.first_at_s, |t: f64| t.min(end.first_at_s)));
            if found.limit_rad_s.is_none_or(|l| value.abs() > l.abs()) {
                found.limit_rad_s = Some(value);
            }
        }
        found
    }

    fn stuck(&self, samples: usize, q: f64, noise_std: f64) -> Stuck {
        let threshold = longest_by_chance(&self.at_least, q, noise_std);
        let mut found = Stuck {
            runs: 0,
            samples: 0,
            longest_s: 0.0,
            longest_at_s: None,
            threshold_samples: threshold,
            repeated_fraction: (samples - self.at_least[0].min(samples)) as f64 / samples as f64,
            handling: Handling::Kept,
        };
        for (length, (count, lasts, at_s)) in self.long.range(threshold..) {
            found.runs += count;
            found.samples += count * length;
            if *lasts > found.longest_s {
                (found.longest_s, found.longest_at_s) = (*lasts, Some(*at_s));
            }
        }
        found
    }
}

/// Samples of the raw stretches, at most `most`, as many from each.
pub(crate) fn witnesses(log: &Reduced, most: usize) -> Vec<f64> {
    let each = most / log.stretches.len().max(1);
    let there = |values: &[f64]| values.iter().copied().filter(|v| v.is_finite()).take(each).collect::<Vec<f64>>();
    log.stretches.iter().flat_map(|s| there(&s.values)).collect()
}

/// Differences over the noise of a sample that are rounding.
const STILL: f64 = 1e-3;

/// Judges a log of which a pass kept `log` (in rad/s, `factor` for one of the file's unit), `runs` and `gaps`.
pub(crate) fn judge(before: Before, log: &Reduced, runs: Runs, gaps: Gaps, factor: f64) -> Audit {
    let c = &log.coarse;
    let mut steps = log.steps_s.clone();
    let median_step_s = median(&mut steps);
    let (low, high) = (quantile(&mut steps, 0.01), quantile(&mut steps, 0.99));
    let sampling = Sampling {
        rate_hz: 1.0 / median_step_s,
        median_step_s,
        step_std_s: gaps.std_s(),
        step_p01_s: low,
        step_p99_s: high,
        // intervals that are all the same within the rounding of their ends
        uniform: gaps.count == 0 && gaps.std_s() <= 1e-3 * median_step_s,
    };
    let rate = witnesses(log, audit::WITNESSES);
    let lattice_step_rad_s = quantization::step(&rate);
    let q = lattice_step_rad_s.unwrap_or(0.0);
    let noise_of = |rate: &[f64]| rate_unit::noise_std(rate).max(q / 12f64.sqrt());
    let mut noise_std_rad_s = noise_of(&rate);
    let frozen = runs.stuck(log.samples(), q, noise_std_rad_s).is_frozen(log.samples());
    if frozen {
        let mut live = rate.clone();
        live.dedup();
        noise_std_rad_s = noise_of(&live);
    }
    let near = |a: f64, b: f64| (a - b).abs() <= STILL * noise_std_rad_s;
    // blocks of a sensor that froze: without noise, and like a neighbour
    let still = |i: usize| {
        let beside = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|k| c.means.get(k));
        near(c.spreads[i], 0.0) && beside.into_iter().any(|mean| near(*mean, c.means[i]))
    };
    let lives = |i: usize| if frozen && still(i) { f64::NAN } else { c.means[i] };
    let means: Vec<f64> = (0..c.means.len()).map(lives).collect();
    let there: Vec<f64> = c.means.iter().copied().filter(|v| v.is_finite()).collect();
    let median_rad_s = median(&mut rate.clone());
    let starts: Vec<f64> = (0..c.means.len()).map(|i| c.first_s + i as f64 * c.block_s()).collect();
    let motion = motion::detect_blocks(&starts, &means, &c.spreads, c.block, c.block_s(), noise_std_rad_s);
    Audit {
        rows: before.rows,
        samples: log.samples(),
        start_s: log.moments.first_s,
        span_s: log.moments.span_s,
        sampling,
        gaps: audit::Gaps {
            count: gaps.count,
            missing_s: gaps.missing_s,
            longest_s: gaps.longest_s,
            longest_at_s: gaps.longest_at_s,
            handling: Handling::Kept,
        },
        duplicates: before.duplicates,
        out_of_order: before.out_of_order,
        missing: before.missing,
        saturation: runs.saturation(factor, median_rad_s, (10.0 * noise_std_rad_s).max(5.0 * q)),
        stuck: runs.stuck(log.samples(), q, noise_std_rad_s),
        rest: Rest { median_rad_s, noise_std_rad_s, drift_rad_s: audit::drift(&there), lattice_step_rad_s },
        motion,
    }
}
