//! z = C y: a log at rest in the cosine basis, its power by bins, and the columns that may be in it

mod reduced;

use crate::error::{Error, ErrorKind, Result};
use crate::math::binned::{Bins, BlockCosine};
use crate::math::dct::Cosine;
use crate::math::random::Stream;
use crate::math::robust::mad_std;
use crate::noise::TermKind;
use crate::signal::TimeAxis;
use crate::signal::slots::{fill, slots};
use serde::Serialize;

/// Blocks that stand for the slow part of a log.
const BLOCKS: usize = 2048;
/// Logs up to here are transformed whole, columns too.
const SHORT: usize = 1 << 16;
/// A column is smooth within blocks if it changes over at least so many of them.
const SMOOTH_BLOCKS: f64 = 20.0;
/// Fewest samples of which noise can be told.
pub(super) const FEWEST: usize = 128;
/// Bins are no wider than this part of half the sample rate: a band of vibration is to be seen ...
const FINE: usize = 512;
/// ... nor need they be narrower than so many coefficients, whose median the search for lines goes by.
const LEAST_IN_BIN: usize = 256;
/// Bins with so many coefficients are searched for lines.
const LINE_BIN: usize = 32;
/// Coefficients that are taken for a line by mistake, in a log of pure noise.
const FALSE_LINES: f64 = 1e-3;
/// Median of χ² with one degree of freedom.
const MEDIAN_CHI_SQUARED: f64 = 0.454_936;
/// Prior standard deviation of a column's coefficient over the root mean square of the log: no prior, but a finite one.
const WIDE: f64 = 1e3;

/// Samples on each side from whose means a gap is filled: as many as it is long, so that the line across it brings no more
/// noise than the log has over such a time.
pub(super) fn neighbours(gap: usize) -> usize {
    gap.max(16)
}

/// A log on an even lattice of time, gaps filled.
#[derive(Debug, Clone)]
pub(crate) struct EvenLog {
    /// Time of the first sample, s.
    pub first_s: f64,
    /// Sample time, s.
    pub step_s: f64,
    /// Rates, rad/s.
    pub values: Vec<f64>,
    /// How many of them are filled in.
    pub filled: usize,
}

impl EvenLog {
    /// Puts `values` on their lattice; missing slots get a straight line between their neighbours, and noise.
    ///
    /// # Errors
    /// [`ErrorKind::TooShort`] below 128 samples; [`ErrorKind::Column`] if lengths differ; [`ErrorKind::Value`] on a value that
    /// is not finite or a constant signal.
    pub(crate) fn new(time: &TimeAxis, values: &[f64]) -> Result<Self> {
        if values.len() != time.len() {
            let found = format!("{} values on {} times", values.len(), time.len());
            return Err(Error::new(ErrorKind::Column, "log", found));
        }
        if values.len() < FEWEST {
            let found = format!("{} samples", values.len());
            return Err(Error::new(ErrorKind::TooShort, "log", found)
                .hint(format!("noise terms need at least {FEWEST} samples, and hours of them to tell a random walk")));
        }
        if let Some(row) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::new(ErrorKind::Value, "log", format!("{} is not finite", values[row]))
                .at(format!("sample {}", row + 1))
                .hint("remove the sample"));
        }
        if values.iter().all(|v| *v == values[0]) {
            return Err(Error::new(ErrorKind::Value, "log", format!("all samples are {}", values[0]))
                .hint("a gyro at rest is never constant: check that the sensor is on, and the column"));
        }
        let mut even = slots(time, values);
        let missing: Vec<usize> = (0..even.len()).filter(|i| !even[*i].is_finite()).collect();
        if !missing.is_empty() {
            let mut differences: Vec<f64> = values.windows(2).map(|w| w[1] - w[0]).collect();
            fill(&mut even, &missing, mad_std(&mut differences, 0.0) / std::f64::consts::SQRT_2, neighbours);
        }
        let (median, mean) = (time.median_step_s(), time.span_s() / (even.len() - 1) as f64);
        // the mean step is the better one, unless a long gap was cut short
        let step_s = if (mean / median - 1.0).abs() < 0.01 { mean } else { median };
        Ok(Self { first_s: time.at(0), step_s, values: even, filled: missing.len() })
    }

    /// Length, s.
    #[must_use]
    pub(crate) fn span_s(&self) -> f64 {
        self.step_s * self.values.len() as f64
    }

    /// Another channel of the same log on the same lattice; its gaps are bridged by straight lines.
    #[must_use]
    pub(crate) fn beside(&self, time: &TimeAxis, values: &[f64]) -> Option<Vec<f64>> {
        let mut even = slots(time, values);
        if even.len() != self.values.len() || even.iter().filter(|v| v.is_finite()).count() < even.len() / 2 {
            return None;
        }
        let missing: Vec<usize> = (0..even.len()).filter(|i| !even[*i].is_finite()).collect();
        fill(&mut even, &missing, 0.0, neighbours);
        Some(even)
    }
}

/// A function of time that may be in the log, with an unknown coefficient.
pub(super) struct Column<'a> {
    /// Value at a time since power-on, s.
    pub at: Box<dyn Fn(f64) -> f64 + 'a>,
    /// Over what time it changes, s: infinite if it is slow throughout.
    pub changes_over_s: f64,
    /// Prior standard deviation of the coefficient of the column at unit root mean square, rad/s; wide where `None`.
    pub std: Option<f64>,
}

/// A line of the spectrum: a vibration, a mains hum or its alias.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SpectralLine {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude of the tone, rad/s.
    pub amplitude_rad_s: f64,
}

/// The log as the likelihood sees it.
#[derive(Clone)]
pub(super) struct Observed {
    pub step_s: f64,
    pub len: usize,
    bins: Bins,
    /// Number of the coefficient in each bin's middle; the bin of the mean is left out, here and below.
    pub k: Vec<f64>,
    pub count: Vec<f64>,
    pub power: Vec<f64>,
    /// Lines whose coefficients do not count, the strongest first.
    pub lines: Vec<SpectralLine>,
    /// Lowest coefficients of each column, scaled to unit root mean square.
    columns: Vec<Vec<f64>>,
    /// Root mean square by which a column was divided.
    pub column_rms: Vec<f64>,
    pub prior_std: Vec<f64>,
    /// Samples in a block, and bins that block means tell; no such bins where all samples are there.
    means: (usize, usize),
    /// Products of columns i >= j, row by row, by bins.
    pub gram: Vec<Vec<f64>>,
    /// Products of columns with the log, by bins.
    pub with_data: Vec<Vec<f64>>,
}

/// The largest size of a block, not below `least`, whose length the transform likes.
fn block_for(len: usize) -> usize {
    let smooth = |n: usize| {
        [2, 3, 5, 7].iter().fold(n, |mut n, p| {
            while n.is_multiple_of(*p) {
                n /= p;
            }
            n
        }) == 1
    };
    let least = len.div_ceil(BLOCKS).max(1);
    (least..).find(|b| smooth(*b)).unwrap_or(least)
}

impl Observed {
    /// Transforms the log. Samples after the last whole block (a two-thousandth of the log at most) are left out.
    pub(crate) fn new(log: &EvenLog, columns: &[Column]) -> Self {
        let block = if log.values.len() <= SHORT { 1 } else { block_for(log.values.len()) };
        let blocks = log.values.len() / block;
        let len = blocks * block;
        let mean = log.values[..len].iter().sum::<f64>() / len as f64;
        let z = {
            let centred: Vec<f64> = log.values[..len].iter().map(|v| v - mean).collect();
            Cosine::new(len).forward(&centred)
        };
        let bins = Bins::no_wider(len, blocks.min(BLOCKS), (len / FINE).max(LEAST_IN_BIN));
        let rms = (z[1..].iter().map(|v| v * v).sum::<f64>() / len as f64).sqrt();
        let mut out = Self {
            step_s: log.step_s,
            len,
            k: bins.omega[1..].iter().map(|w| w * len as f64 / std::f64::consts::PI).collect(),
            count: bins.count[1..].to_vec(),
            power: bins.power(&z)[1..].to_vec(),
            lines: Vec::new(),
            bins,
            columns: Vec::new(),
            column_rms: Vec::new(),
            prior_std: Vec::new(),
            means: (1, 0),
            gram: Vec::new(),
            with_data: Vec::new(),
        };
        out.leave_lines_out(&z);
        let whole = Cosine::new(if block == 1 { len } else { 0 });
        let slow = BlockCosine::new(blocks, block);
        for column in columns {
            let at = |i: f64| (column.at)(log.first_s + i * log.step_s);
            let mut low = if block == 1 {
                whole.forward(&(0..len).map(|i| at(i as f64)).collect::<Vec<_>>())
            } else if column.changes_over_s < SMOOTH_BLOCKS * block as f64 * log.step_s {
                Cosine::new(len).forward(&(0..len).map(|i| at(i as f64)).collect::<Vec<_>>())
            } else {
                let middle = 0.5 * (block as f64 - 1.0);
                slow.forward(&(0..blocks).map(|b| at((b * block) as f64 + middle)).collect::<Vec<_>>())
            };
            low[0] = 0.0;
            out.push(low, &z, column.std, rms);
        }
        out
    }

    /// Takes coefficients that no noise explains out of their bins, with those that the line leaks into: a tone of amplitude
    /// A has the power A² n/2 at its own coefficient, and 1/(πj)² of that j further on.
    fn leave_lines_out(&mut self, z: &[f64]) {
        let most = 2.0 * (self.len as f64 / FALSE_LINES).ln();
        let mut left_out: Vec<(f64, usize, usize)> = Vec::new();
        for bin in 0..self.k.len() {
            let range = self.bins.edges[bin + 1]..self.bins.edges[bin + 2];
            if range.len() < LINE_BIN {
                continue;
            }
            let mut squares: Vec<f64> = z[range.clone()].iter().map(|v| v * v).collect();
            let middle = squares.len() / 2;
            let level = *squares.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN_CHI_SQUARED;
            for k in range.filter(|k| z[*k] * z[*k] > most * level) {
                let reach = 2 + ((z[k] * z[k] / level).sqrt() / std::f64::consts::PI).ceil() as usize;
                left_out.push((z[k] * z[k], k, reach));
            }
        }
        left_out.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut gone = vec![false; if left_out.is_empty() { 0 } else { self.len }];
        for (square, k, reach) in left_out {
            if !gone[k] {
                let frequency_hz = k as f64 / (2.0 * self.span_s());
                // the tone's power lies in two coefficients or so
                let amplitude_rad_s = (2.0 * square / self.len as f64).sqrt();
                self.lines.push(SpectralLine { frequency_hz, amplitude_rad_s });
            }
            let last = (k + reach).min(self.len - 1);
            gone[k.saturating_sub(reach).max(self.bins.edges[1])..=last].fill(true);
        }
        if gone.is_empty() {
            return;
        }
        for bin in 0..self.k.len() {
            let range = self.bins.edges[bin + 1]..self.bins.edges[bin + 2];
            if range.len() < LINE_BIN {
                continue;
            }
            let out = range.clone().filter(|k| gone[*k]).count();
            let kept = range.filter(|k| !gone[*k]);
            (self.count[bin], self.power[bin]) = if 4 * out > 3 * (self.count[bin] as usize) {
                (0.0, 0.0)
            } else {
                (self.count[bin] - out as f64, kept.map(|k| z[k] * z[k]).sum())
            };
        }
    }

    /// Adds a column that is there as coefficients. One that is all but constant is left at zero.
    fn push(&mut self, mut low: Vec<f64>, z: &[f64], std: Option<f64>, rms: f64) {
        let size = (low.iter().map(|v| v * v).sum::<f64>() / self.len as f64).sqrt();
        let scale = if size > 0.0 { size.recip() } else { 0.0 };
        low.iter_mut().for_each(|v| *v *= scale);
        for other in &self.columns {
            self.gram.push(self.products(&low, other));
        }
        self.gram.push(self.products(&low, &low));
        self.with_data.push(self.products(&low, z));
        self.columns.push(low);
        self.column_rms.push(size);
        self.prior_std.push(std.unwrap_or(WIDE * rms));
    }

    fn products(&self, a: &[f64], b: &[f64]) -> Vec<f64> {
        self.bins.products(a, b)[1..].to_vec()
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns.len()
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.step_s * self.len as f64
    }

    pub(crate) fn frequency_hz(&self, bin: usize) -> f64 {
        self.k[bin] / (2.0 * self.span_s())
    }

    /// Bins above `frequency_hz` count no more.
    pub(crate) fn cut_above(&mut self, frequency_hz: f64) {
        for bin in 0..self.k.len() {
            if self.frequency_hz(bin) > frequency_hz {
                (self.count[bin], self.power[bin]) = (0.0, 0.0);
                let zero = |v: &mut Vec<f64>| v.get_mut(bin).into_iter().for_each(|x| *x = 0.0);
                self.gram.iter_mut().for_each(zero);
                self.with_data.iter_mut().for_each(zero);
            }
        }
    }

    /// The same log without the column `j`, `coefficient` times which was taken out.
    pub(crate) fn without(&self, j: usize, coefficient: f64) -> Self {
        let at = |a: usize, b: usize| &self.gram[a.max(b) * (a.max(b) + 1) / 2 + a.min(b)];
        let mut out = self.clone();
        for (b, p) in out.power.iter_mut().enumerate() {
            let take = |v: &Vec<f64>| v.get(b).copied().unwrap_or(0.0);
            *p += coefficient * (coefficient * take(at(j, j)) - 2.0 * take(&self.with_data[j]));
        }
        for (i, d) in out.with_data.iter_mut().enumerate() {
            d.iter_mut().zip(at(i, j)).for_each(|(d, g)| *d -= coefficient * g);
        }
        let kept: Vec<usize> = (0..self.columns()).filter(|i| *i != j).collect();
        out.gram = kept
            .iter()
            .enumerate()
            .flat_map(|(n, a)| kept[..=n].iter().map(move |b| (*a, *b)))
            .map(|(a, b)| at(a, b).clone())
            .collect();
        out.with_data = kept.iter().map(|i| out.with_data[*i].clone()).collect();
        out.columns = kept.iter().map(|i| self.columns[*i].clone()).collect();
        out.column_rms = kept.iter().map(|i| self.column_rms[*i]).collect();
        out.prior_std = kept.iter().map(|i| self.prior_std[*i]).collect();
        out
    }

    /// A log drawn from the model with `spectrum` by bins, all columns zero: as good as any, for they are taken out again.
    pub(crate) fn drawn(&self, spectrum: &[f64], draw: &mut Stream) -> Self {
        let mut out = self.clone();
        let reach = self.columns.iter().map(Vec::len).max().unwrap_or(0);
        let mut z = vec![0.0; reach];
        for (bin, s) in spectrum.iter().enumerate() {
            let (from, to) = (self.bins.edges[bin + 1], self.bins.edges[bin + 2]);
            if self.count[bin] <= 0.0 {
                continue;
            }
            if to <= reach {
                z[from..to].iter_mut().for_each(|v| *v = s.sqrt() * draw.normal());
                // what lines took out of the bin is no longer there
                let share = self.count[bin] / (to - from) as f64;
                out.power[bin] = share * z[from..to].iter().map(|v| v * v).sum::<f64>();
            } else {
                out.power[bin] = s * chi_squared(self.count[bin], draw);
            }
        }
        out.with_data = self.columns.iter().map(|c| self.products(c, &z)).collect();
        for (d, known) in out.with_data.iter_mut().zip(&self.with_data) {
            d.truncate(known.len());
        }
        out
    }

    /// Standard deviation of a sample's white noise, about: from the median of the coefficients' power.
    pub(crate) fn white_std(&self) -> f64 {
        let mut level: Vec<(f64, f64)> = (0..self.k.len())
            .filter(|b| self.count[*b] > 0.0)
            .map(|b| (self.power[b] / self.count[b], self.count[b]))
            .collect();
        level.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = level.iter().map(|l| l.1).sum();
        let mut below = 0.0;
        for (value, count) in level {
            below += count;
            if below >= 0.5 * total {
                return value.sqrt().max(f64::MIN_POSITIVE);
            }
        }
        f64::MIN_POSITIVE
    }

    /// Expected power per squared size, by bins.
    pub(crate) fn unit(&self, kind: TermKind, time_s: f64) -> Vec<f64> {
        let mut unit = kind.cosine_variances(&self.k, self.len, self.step_s, time_s);
        let (block, bins) = self.means;
        if kind == TermKind::Quantization && bins > 0 {
            // a mean over a block is the angle's rounding at its two ends, as a sample of that length is: most of its power
            // is folded down from above
            let (step_s, factor) = (self.step_s * block as f64, block as f64);
            let folded = kind.cosine_variances(&self.k[..bins], self.len / block, step_s, time_s);
            unit.iter_mut().zip(folded).for_each(|(u, f)| *u = factor * f);
        }
        unit
    }

    /// Range of the size of a term in which it can be told: from what changes nothing that could be seen to what drowns
    /// everything else.
    pub(crate) fn range(&self, kind: TermKind) -> [f64; 2] {
        let (white, dt, n) = (self.white_std(), self.step_s, self.len as f64);
        let span = self.span_s();
        match kind {
            TermKind::Quantization => [0.05 * white * dt * n.powf(-0.25), 10.0 * white * dt],
            TermKind::AngleRandomWalk => [1e-3 * white * dt.sqrt(), 1e3 * white * dt.sqrt()],
            TermKind::BiasInstability | TermKind::GaussMarkov | TermKind::NarrowBandNoise => {
                [0.05 * white / n.sqrt(), 10.0 * white]
            }
            TermKind::Bandwidth => [0.01 / dt, 1.5 / dt],
            TermKind::RateRandomWalk => [0.05 * white * dt.sqrt() / span, 10.0 * white / dt.sqrt()],
            TermKind::RateRamp => [0.05 * white * dt.sqrt() * 12f64.sqrt() / span.powf(1.5), 10.0 * white / span],
        }
    }

    /// Angular frequency of each bin's middle, rad/sample.
    pub(crate) fn omega(&self) -> Vec<f64> {
        self.k.iter().map(|k| std::f64::consts::PI * k / self.len as f64).collect()
    }

    /// Width of a bin, Hz.
    pub(crate) fn bin_width_hz(&self, bin: usize) -> f64 {
        (self.bins.edges[bin + 2] - self.bins.edges[bin + 1]) as f64 / (2.0 * self.span_s())
    }

    /// Range of the centre of a band: below a hundredth of the sample rate it would be a Gauss-Markov term.
    pub(crate) fn center_range_hz(&self) -> [f64; 2] {
        [(0.01 / self.step_s).max(50.0 / self.span_s()), 0.5 / self.step_s]
    }

    /// Range of the width of a band: from two of the widest bins to an eighth of the sample rate.
    pub(crate) fn width_range_hz(&self) -> [f64; 2] {
        let widest = (0..self.k.len()).map(|b| self.bin_width_hz(b)).fold(0.0, f64::max);
        [2.0 * widest, (0.125 / self.step_s).max(4.0 * widest)]
    }

    /// Range of correlation times: shorter is white, longer a random walk.
    pub(crate) fn time_range(&self) -> [f64; 2] {
        [2.0 * self.step_s, (0.2 * self.span_s()).max(20.0 * self.step_s)]
    }
}

/// χ² with `count` degrees of freedom; beyond 60 by Wilson and Hilferty's cube.
fn chi_squared(count: f64, draw: &mut Stream) -> f64 {
    if count <= 60.0 {
        return (0..count as usize).map(|_| draw.normal().powi(2)).sum();
    }
    let spread = 2.0 / (9.0 * count);
    count * (1.0 - spread + spread.sqrt() * draw.normal()).powi(3)
}
