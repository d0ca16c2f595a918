//! One pass over the samples of a log: sums that grow no larger, however long it is.
//!
//! How long the log will be is not known. Blocks of slots begin as single slots and are joined in pairs whenever there are
//! too many of them, so that sums stay hierarchical; of the raw stretches every second one is then given up, so that those
//! that remain are evenly spread. Blocks of the moments are never wider than an eighth of the time gone by, as in
//! [`Moments`], and twice as long after each few hundred of them.

use super::moments::{LastTable, Moments};
use super::reduced::{Coarse, Reduced, Stretch};
use super::slots::GAP_STEPS;
use crate::error::{Error, ErrorKind, Result};

/// How much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Block means, a power of two.
    pub blocks: usize,
    /// Slots in a raw stretch, a power of two.
    pub stretch: usize,
    /// Raw stretches.
    pub stretches: usize,
}

impl Default for Limits {
    /// About 60 MB.
    fn default() -> Self {
        Self { blocks: 1 << 20, stretch: 1 << 18, stretches: 16 }
    }
}

/// Longest block of the moments at first, and at most.
const FIRST_CAP: usize = 1024;
const LARGEST_CAP: usize = 1 << 18;
/// Blocks of one length before they become twice as long.
const BLOCKS_AT_CAP: usize = 512;
/// Intervals that are kept.
const STEPS: usize = 1 << 16;
/// Slots that may be missing at once before anything is known of the log's length.
const FREE_SLOTS: usize = 1 << 22;

/// Takes the samples of a log in order of time, and keeps what [`Reduced`] holds.
#[derive(Debug)]
pub struct Reducer {
    step_s: f64,
    first_s: f64,
    last_s: f64,
    last: f64,
    /// Slot of the last sample.
    slot: usize,
    missing: usize,
    squares: LongSum,
    moments: MomentPass,
    blocks: BlockPass,
    beside: Option<BlockPass>,
    stretches: StretchPass,
    steps: Thinned,
}

impl Reducer {
    /// For a log with samples about `step_s` apart and rates about `reference` (sums of squares count from there), with a
    /// temperature where `beside` says so.
    #[must_use]
    pub fn new(step_s: f64, reference: f64, beside: bool, limits: Limits) -> Self {
        Self {
            step_s,
            first_s: f64::NAN,
            last_s: f64::NAN,
            last: f64::NAN,
            slot: 0,
            missing: 0,
            squares: LongSum::default(),
            moments: MomentPass::new(reference),
            blocks: BlockPass::new(limits.blocks, reference),
            beside: beside.then(|| BlockPass::new(limits.blocks, 0.0)),
            stretches: StretchPass::new(limits),
            steps: Thinned::default(),
        }
    }

    /// The next sample: a rate at a time later than the last one, and the temperature (NaN where it is missing).
    pub fn push(&mut self, time_s: f64, rate: f64, temperature: f64) {
        if self.moments.count() == 0 {
            self.first_s = time_s;
        } else {
            let interval = time_s - self.last_s;
            self.steps.push(interval);
            let difference = rate - self.last;
            self.squares.add(difference * difference);
            let steps = interval / self.step_s;
            let skipped = if steps > GAP_STEPS { (steps.round() - 1.0).max(0.0) as usize } else { 0 };
            let skipped = skipped.min((self.slot + 1).max(FREE_SLOTS));
            self.missing += skipped;
            self.slot += 1 + skipped;
        }
        (self.last_s, self.last) = (time_s, rate);
        self.moments.push(time_s, rate);
        self.blocks.add(self.slot, rate);
        if let Some(beside) = &mut self.beside
            && temperature.is_finite()
        {
            beside.add(self.slot, temperature);
        }
        self.stretches.add(self.slot, time_s, self.step_s, rate);
    }

    /// Samples so far.
    #[must_use]
    pub(crate) fn count(&self) -> usize {
        self.moments.count()
    }

    /// Ends the pass: the summary of all samples.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] with fewer than two samples; [`ErrorKind::Value`] if a rate was not finite.
    pub fn finish(self) -> Result<Reduced> {
        let count = self.moments.count();
        if count < 2 {
            return Err(Error::new(ErrorKind::TooShort, "log", format!("{count} samples")).hint("record a longer log"));
        }
        let slots = self.slot + 1;
        let mean = (self.last_s - self.first_s) / self.slot as f64;
        // the mean step is the better one, unless a long gap was cut short
        let step_s = if (mean / self.step_s - 1.0).abs() < 0.01 { mean } else { self.step_s };
        let moments = self.moments.finish(self.first_s, self.last_s, step_s);
        if !moments.square_sum.is_finite() {
            return Err(Error::new(ErrorKind::Value, "log", "a rate is not finite").hint("remove the sample"));
        }
        let block = self.blocks.block();
        let temperature_c = self.beside.map(|beside| beside.means_over(block, slots / block));
        let (means, counts, spreads) = self.blocks.finish(slots);
        let missing = self.missing;
        Ok(Reduced {
            moments,
            difference_variance: 0.5 * self.squares.total() / (count - 1) as f64,
            last_s: self.last_s,
            coarse: Coarse { first_s: self.first_s, step_s, block, means, counts, spreads, temperature_c, missing },
            stretches: self.stretches.kept.into_iter().map(|k| k.stretch).collect(),
            steps_s: self.steps.kept,
        })
    }
}

/// A sum of very many numbers: runs of them are added apart, so that it keeps its digits.
#[derive(Debug, Default)]
struct LongSum {
    total: f64,
    run: f64,
    in_run: u32,
}

impl LongSum {
    fn add(&mut self, x: f64) {
        self.run += x;
        self.in_run += 1;
        if self.in_run == 4096 {
            self.total += std::mem::take(&mut self.run);
            self.in_run = 0;
        }
    }

    fn total(&self) -> f64 {
        self.total + self.run
    }
}

/// Every n-th number, n doubling whenever there are too many.
#[derive(Debug)]
struct Thinned {
    kept: Vec<f64>,
    stride: usize,
    seen: usize,
}

impl Default for Thinned {
    fn default() -> Self {
        Self { kept: Vec::new(), stride: 1, seen: 0 }
    }
}

impl Thinned {
    fn push(&mut self, x: f64) {
        if self.seen.is_multiple_of(self.stride) {
            self.kept.push(x);
            if self.kept.len() == STEPS {
                let mut at = 0;
                self.kept.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
                self.stride *= 2;
            }
        }
        self.seen += 1;
    }
}

/// The block moments in the making.
#[derive(Debug)]
struct MomentPass {
    moments: Moments,
    first_s: f64,
    cap: usize,
    at_cap: usize,
    times: Vec<f64>,
    values: Vec<f64>,
    last: LastTable,
}

impl MomentPass {
    fn new(reference: f64) -> Self {
        Self {
            moments: Moments {
                first_s: f64::NAN,
                span_s: 0.0,
                step_s: f64::NAN,
                reference,
                count: 0,
                square_sum: 0.0,
                classes: Vec::new(),
                blocks: Vec::new(),
            },
            first_s: f64::NAN,
            cap: FIRST_CAP,
            at_cap: 0,
            times: Vec::new(),
            values: Vec::new(),
            last: LastTable::default(),
        }
    }

    fn count(&self) -> usize {
        self.moments.count
    }

    fn push(&mut self, t: f64, value: f64) {
        if self.moments.count == 0 {
            self.first_s = t;
        }
        if let Some(&start) = self.times.first()
            && (self.times.len() >= self.cap || t - start > (start - self.first_s) / 8.0)
        {
            self.close();
        }
        self.times.push(t);
        self.values.push(value);
        self.moments.count += 1;
    }

    fn close(&mut self) {
        self.moments.add_block(&self.times, &self.values, self.first_s, &mut self.last);
        self.at_cap += usize::from(self.times.len() == self.cap);
        if self.at_cap == BLOCKS_AT_CAP && self.cap < LARGEST_CAP {
            self.cap *= 2;
            self.at_cap = 0;
        }
        self.times.clear();
        self.values.clear();
    }

    fn finish(mut self, first_s: f64, last_s: f64, step_s: f64) -> Moments {
        if !self.times.is_empty() {
            self.close();
        }
        Moments { first_s, span_s: last_s - first_s, step_s, ..self.moments }
    }
}

/// Sums over blocks of slots.
#[derive(Debug)]
struct BlockPass {
    most: usize,
    /// Slots in a block are two to this power.
    shift: u32,
    reference: f64,
    sums: Vec<f64>,
    squares: Vec<f64>,
    counts: Vec<u32>,
}

impl BlockPass {
    fn new(most: usize, reference: f64) -> Self {
        Self { most: most.max(2), shift: 0, reference, sums: Vec::new(), squares: Vec::new(), counts: Vec::new() }
    }

    fn block(&self) -> usize {
        1 << self.shift
    }

    fn add(&mut self, slot: usize, value: f64) {
        while slot >> self.shift >= self.most {
            self.join_pairs();
        }
        let at = slot >> self.shift;
        if at >= self.sums.len() {
            self.sums.resize(at + 1, 0.0);
            self.squares.resize(at + 1, 0.0);
            self.counts.resize(at + 1, 0);
        }
        let value = value - self.reference;
        self.sums[at] += value;
        self.squares[at] += value * value;
        self.counts[at] += 1;
    }

    fn join_pairs(&mut self) {
        self.shift += 1;
        let joined = |v: &[f64]| -> Vec<f64> { v.chunks(2).map(|c| c.iter().sum()).collect() };
        self.sums = joined(&self.sums);
        self.squares = joined(&self.squares);
        self.counts = self.counts.chunks(2).map(|c| c.iter().sum()).collect();
    }

    /// Means of the whole blocks of `slots` slots, their counts, and the spread about the means.
    fn finish(mut self, slots: usize) -> (Vec<f64>, Vec<u32>, Vec<f64>) {
        let (block, blocks) = (self.block(), slots >> self.shift);
        self.counts.resize(blocks, 0);
        let enough = |n: u32| 2 * n as usize >= block;
        let mut means = vec![f64::NAN; blocks];
        let mut spreads = vec![f64::NAN; blocks];
        for (i, &n) in self.counts.iter().enumerate().filter(|(_, n)| enough(**n)) {
            let mean = self.sums[i] / f64::from(n);
            means[i] = self.reference + mean;
            let square = (self.squares[i] - f64::from(n) * mean * mean).max(0.0);
            spreads[i] = if n > 1 { (square / f64::from(n - 1)).sqrt() } else { 0.0 };
        }
        (means, self.counts, spreads)
    }

    /// Means over blocks of `block` slots, whatever the own size is by now; NaN where there are none.
    fn means_over(mut self, block: usize, blocks: usize) -> Vec<f64> {
        while self.block() < block {
            self.join_pairs();
        }
        self.sums.resize(blocks, 0.0);
        self.counts.resize(blocks, 0);
        let mean = |(s, n): (&f64, &u32)| if *n > 0 { s / f64::from(*n) } else { f64::NAN };
        self.sums.iter().zip(&self.counts).map(mean).collect()
    }
}

#[derive(Debug)]
struct Kept {
    /// Number of the stretch, counted from the beginning of the log.
    index: usize,
    stretch: Stretch,
}

/// Raw stretches.
#[derive(Debug)]
struct StretchPass {
    len: usize,
    most: usize,
    /// Every stride-th stretch is kept.
    stride: usize,
    kept: Vec<Kept>,
}

impl StretchPass {
    fn new(limits: Limits) -> Self {
        Self { len: limits.stretch.max(1), most: limits.stretches.max(2), stride: 1, kept: Vec::new() }
    }

    fn add(&mut self, slot: usize, time_s: f64, step_s: f64, value: f64) {
        let (index, at) = (slot / self.len, slot % self.len);
        if !index.is_multiple_of(self.stride) {
            return;
        }
        if self.kept.last().is_none_or(|k| k.index != index) {
            if self.kept.len() == self.most {
                self.stride *= 2;
                let stride = self.stride;
                self.kept.retain(|k| k.index.is_multiple_of(stride));
                if !index.is_multiple_of(stride) {
                    return;
                }
            }
            let first_s = time_s - at as f64 * step_s;
            self.kept.push(Kept { index, stretch: Stretch { first_s, values: Vec::with_capacity(self.len) } });
        }
        if let Some(Kept { stretch, .. }) = self.kept.last_mut() {
            stretch.values.resize(at, f64::NAN);
            stretch.values.push(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use crate::signal::TimeAxis;
    use crate::signal::slots::{block_means, slots};

    const SMALL: Limits = Limits { blocks: 64, stretch: 128, stretches: 4 };

    fn log(n: usize, gap: Option<(usize, f64)>) -> (Vec<f64>, Vec<f64>) {
        let mut draw = Stream::new(7, n as u64);
        let late = |i: usize| gap.map_or(0.0, |(at, s)| if i >= at { s } else { 0.0 });
        let t: Vec<f64> = (0..n).map(|i| 3.0 + 0.01 * i as f64 + late(i)).collect();
        let y = t.iter().map(|t| 0.02 - 1e-3 * (-t / 5.0).exp() + 1e-3 * draw.normal()).collect();
        (t, y)
    }

    fn reduced(t: &[f64], y: &[f64], limits: Limits) -> Reduced {
        let mut pass = Reducer::new(0.01, y[0], false, limits);
        t.iter().zip(y).for_each(|(t, y)| pass.push(*t, *y, f64::NAN));
        pass.finish().unwrap()
    }

    #[test]
    fn block_means_are_those_of_the_samples_gaps_and_all() {
        for gap in [None, Some((700, 0.35)), Some((40, 12.0))] {
            let (t, y) = log(5000, gap);
            let kept = reduced(&t, &y, SMALL);
            let c = &kept.coarse;
            assert!(c.means.len() > 32 && c.means.len() <= 64 && c.block.is_power_of_two());
            let known = block_means(&slots(&TimeAxis::Explicit(t.clone()), &y), c.block);
            assert_eq!(c.means.len(), known.len());
            for (a, b) in c.means.iter().zip(&known) {
                assert!((a - b).abs() < 1e-14 || (a.is_nan() && b.is_nan()), "{gap:?}: {a} {b}");
            }
            assert!((c.step_s / 0.01 - 1.0).abs() < 1e-9, "{}", c.step_s);
        }
    }

    #[test]
    fn stretches_are_the_samples_and_lie_evenly_over_the_log() {
        let (t, y) = log(5000, None);
        let kept = reduced(&t, &y, SMALL);
        let stretches = &kept.stretches;
        assert!(stretches.len() > 2 && stretches.len() <= 4);
        let apart = stretches[1].first_s - stretches[0].first_s;
        for pair in stretches.windows(2) {
            assert!((pair[1].first_s - pair[0].first_s - apart).abs() < 1e-9);
        }
        for s in stretches {
            let first = ((s.first_s - 3.0) / 0.01).round() as usize;
            assert_eq!(s.values[..], y[first..first + s.values.len()]);
        }
        let squares: f64 = y.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        assert!((kept.difference_variance / (0.5 * squares / 4999.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn moments_sum_what_the_samples_sum() {
        let (t, y) = log(30_000, Some((900, 2.0)));
        let kept = reduced(&t, &y, SMALL);
        let m = &kept.moments;
        assert_eq!((m.count, m.first_s, m.span_s), (30_000, t[0], t[29_999] - t[0]));
        let square: f64 = y.iter().map(|v| (v - m.reference).powi(2)).sum();
        assert!((m.square_sum / square - 1.0).abs() < 1e-12);
        let sum: f64 = m.blocks.iter().map(|b| b.moments[0]).sum();
        assert!((sum - y.iter().map(|v| v - m.reference).sum::<f64>()).abs() < 1e-10);
        for b in &m.blocks {
            let half = m.classes[b.class].half_s;
            assert!(half <= (b.mid_s - half) / 16.0 + 1e-12, "{} at {}", half, b.mid_s);
        }
    }

    #[test]
    fn another_unit_is_another_factor() {
        let (t, y) = log(2000, None);
        let twice: Vec<f64> = y.iter().map(|v| -2.0 * v).collect();
        let (a, b) = (reduced(&t, &y, SMALL).scaled(-2.0), reduced(&t, &twice, SMALL));
        assert!((a.moments.square_sum / b.moments.square_sum - 1.0).abs() < 1e-12);
        assert_eq!((a.difference_variance, a.stretches), (b.difference_variance, b.stretches));
        assert!(a.coarse.spreads.iter().zip(&b.coarse.spreads).all(|(x, y)| (x - y).abs() < 1e-15));
    }

    #[test]
    fn a_pause_of_years_takes_no_more_than_a_second() {
        let kept = reduced(&[0.0, 0.01, 1e9, 1e9 + 0.01], &[1.0, 2.0, 3.0, 4.0], Limits::default());
        assert!(kept.coarse.means.len() <= 1 << 20);
    }
}
