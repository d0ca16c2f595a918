//! A log at rest in bounded memory: what one pass over its samples keeps ([`super::Reducer`] makes it).
//!
//! - Block moments ([`Moments`]): all that a fit of a smooth model asks of the samples, exactly.
//! - Means over blocks of slots of time, 2ʲ slots each: the slow part of the noise, exactly; averages over them are
//!   averages over the samples, taken every 2ʲ of them.
//! - Raw stretches, evenly spread over the log: the fast part of the noise, as far as they see it.

use super::moments::Moments;

/// Means over blocks of slots of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Coarse {
    /// Time of the first slot, s.
    pub first_s: f64,
    /// Time from one slot to the next, s.
    pub step_s: f64,
    /// Slots in a block, a power of two.
    pub block: usize,
    /// Mean of each whole block, rad/s; NaN where fewer than half of its slots hold a sample.
    pub means: Vec<f64>,
    /// Samples in each block.
    pub counts: Vec<u32>,
    /// Standard deviation of the samples of each block about their mean, rad/s.
    pub spreads: Vec<f64>,
    /// The same means of the temperature, °C, where it was logged.
    pub temperature_c: Option<Vec<f64>>,
    /// Slots without a sample, up to the last sample.
    pub missing: usize,
}

impl Coarse {
    /// Slots in whole blocks.
    #[must_use]
    pub(crate) fn slots(&self) -> usize {
        self.means.len() * self.block
    }

    /// Middle of block `i`, s.
    #[must_use]
    pub(crate) fn middle_s(&self, i: usize) -> f64 {
        self.first_s + self.step_s * ((i * self.block) as f64 + 0.5 * (self.block - 1) as f64)
    }

    /// Time from one block to the next, s.
    #[must_use]
    pub(crate) fn block_s(&self) -> f64 {
        self.step_s * self.block as f64
    }
}

/// Consecutive slots of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Time of the first slot, s.
    pub first_s: f64,
    /// Rates, rad/s; NaN in slots without a sample.
    pub values: Vec<f64>,
}

/// Summary of a log from one pass.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// Block moments of all samples.
    pub moments: Moments,
    /// Half the mean square of the differences of neighbouring samples, rad²/s².
    pub difference_variance: f64,
    /// Time of the last sample, s.
    pub last_s: f64,
    /// Means over blocks.
    pub coarse: Coarse,
    /// Raw stretches in order of time.
    pub stretches: Vec<Stretch>,
    /// Intervals between samples, evenly spread over the log, s.
    pub steps_s: Vec<f64>,
}

impl Reduced {
    /// Samples in the log.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.moments.count
    }

    /// Averaging times from here on rest on block means, shorter ones on the stretches, samples.
    #[must_use]
    pub(crate) fn coarse_from(&self) -> usize {
        if self.coarse.block == 1 { 1 } else { 8 * self.coarse.block }
    }

    /// The same log with `offset_s` added to every time.
    #[must_use]
    pub fn shifted(mut self, offset_s: f64) -> Self {
        self.moments.first_s += offset_s;
        self.last_s += offset_s;
        self.coarse.first_s += offset_s;
        self.stretches.iter_mut().for_each(|s| s.first_s += offset_s);
        self
    }

    /// The same log with every rate multiplied by `factor`.
    #[must_use]
    pub(crate) fn scaled(mut self, factor: f64) -> Self {
        self.moments.scale(factor);
        self.difference_variance *= factor * factor;
        self.coarse.means.iter_mut().for_each(|v| *v *= factor);
        self.coarse.spreads.iter_mut().for_each(|v| *v *= factor.abs());
        self.stretches.iter_mut().flat_map(|s| &mut s.values).for_each(|v| *v *= factor);
        self
    }

    /// The extent of the summary, in a sentence for a report.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let c = &self.coarse;
        if c.block == 1 {
            return format!("read in one pass; all of its {} slots are kept", c.means.len());
        }
        let longest = self.stretches.iter().map(|s| s.values.len()).max().unwrap_or(0);
        format!(
            "read in one pass: {} means over {} samples each, and {} raw stretches of up to {longest} samples, are kept; \
             averaging times from {:.4} s on are overlapped with a stride of {} samples, shorter ones rest on the stretches",
            c.means.len(),
            c.block,
            self.stretches.len(),
            c.step_s * self.coarse_from() as f64,
            c.block
        )
    }
}
