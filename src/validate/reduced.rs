//! The tests on a log of which one pass kept block means and raw stretches.
//!
//! Averages over eight blocks and more are averages over all samples. Shorter ones, and the samples themselves, are tested
//! on the raw stretches, set one after the other with a gap between them that no lag reaches across.

use super::{Options, Validation, block_sizes, judge};
use crate::bias::WarmUp;
use crate::math::spectra::quick_len;
use crate::signal::Reduced;
use crate::signal::slots::block_means;
use rayon::prelude::*;

/// Samples of the stretches that are tested: more show nothing that matters, and cost memory.
const TESTED: usize = 1 << 21;
/// Missing averages between stretches: more than the lags that are looked at.
const BETWEEN: usize = 64;

/// Residuals of a log under a model.
#[derive(Debug, Clone)]
pub struct Residuals<'a> {
    log: &'a Reduced,
    /// Block means less the model's.
    coarse: Vec<f64>,
    stretches: Vec<Vec<f64>>,
    /// Mean residual, rad/s.
    pub mean_rad_s: f64,
    /// Mean square about that mean, rad²/s².
    pub variance: f64,
}

impl<'a> Residuals<'a> {
    /// The residuals of `log`, whose times count from power-on, under `model`.
    #[must_use]
    pub fn new(log: &'a Reduced, model: &WarmUp) -> Self {
        Self::of(log, &|t_s| model.error_rad_s(t_s))
    }

    /// The residuals of `log` under an error (rad/s) that is a function of its time (s).
    #[must_use]
    pub fn of(log: &'a Reduced, error_rad_s: &(dyn Fn(f64) -> f64 + Sync)) -> Self {
        let c = &log.coarse;
        let coarse: Vec<f64> = c.means.par_iter().enumerate().map(|(i, y)| y - error_rad_s(c.middle_s(i))).collect();
        let most = (TESTED / log.stretches.len().max(1)).max(1);
        let less = |first_s: f64, values: &[f64]| {
            let at = |i: usize| error_rad_s(first_s + i as f64 * c.step_s);
            values[..values.len().min(most)].par_iter().enumerate().map(|(i, y)| y - at(i)).collect::<Vec<f64>>()
        };
        // with single slots the coarse series is all there is to know
        let fast = if c.block == 1 { &[][..] } else { &log.stretches };
        let (mut n, mut sum) = (0.0, 0.0);
        let there = || coarse.iter().zip(&c.counts).zip(&c.spreads).filter(|p| p.0.0.is_finite());
        for ((r, count), _) in there() {
            n += f64::from(*count);
            sum += f64::from(*count) * r;
        }
        let mean_rad_s = sum / n;
        let square = |((r, count), spread): ((&f64, &u32), &f64)| {
            f64::from(*count) * (r - mean_rad_s).powi(2) + f64::from(count.saturating_sub(1)) * spread.powi(2)
        };
        let variance = there().map(square).sum::<f64>() / (n - 1.0);
        let stretches = fast.iter().map(|s| less(s.first_s, &s.values)).collect();
        Self { log, coarse, stretches, mean_rad_s, variance }
    }

    /// Block means: the time of the middle of each, s, and its residual, rad/s; blocks without samples are left out.
    #[must_use]
    pub fn coarse(&self) -> (Vec<f64>, Vec<f64>) {
        let there = (0..self.coarse.len()).filter(|i| self.coarse[*i].is_finite());
        there.map(|i| (self.log.coarse.middle_s(i), self.coarse[i])).unzip()
    }

    /// Means over `size` slots; those over few are the stretches' alone.
    fn means(&self, size: usize) -> Vec<f64> {
        if size >= self.log.coarse_from() {
            return block_means(&self.coarse, size / self.log.coarse.block);
        }
        let mut joined = Vec::new();
        for stretch in &self.stretches {
            joined.extend(block_means(stretch, size));
            joined.extend([f64::NAN; BETWEEN]);
        }
        joined.truncate(quick_len(joined.len().saturating_sub(BETWEEN)));
        joined
    }
}

/// [`super::whiteness()`] of the residuals of a log of which one pass kept block means and raw stretches. `fitted` holds the
/// directions that the fit has taken out of them, as functions of time (s).
#[must_use]
pub fn whiteness_reduced(
    residuals: &Residuals,
    fitted: &[&(dyn Fn(f64) -> f64 + Sync)],
    options: &Options,
) -> Validation {
    let (log, c) = (residuals.log, &residuals.log.coarse);
    let whole = |size: usize| {
        if size < log.coarse_from() { size } else { ((size + c.block / 2) / c.block).max(1) * c.block }
    };
    let sizes: Vec<usize> = block_sizes(c.slots(), c.step_s).into_iter().map(whole).collect();
    // only averages over blocks are few enough to be permuted
    let columns = |size: usize| -> Vec<Vec<f64>> {
        let column = |f: &&(dyn Fn(f64) -> f64 + Sync)| {
            let fine: Vec<f64> = (0..c.means.len()).into_par_iter().map(|i| f(c.middle_s(i))).collect();
            block_means(&fine, (size / c.block).max(1))
        };
        fitted.iter().map(column).collect()
    };
    judge(c.slots(), c.step_s, &sizes, &|size| residuals.means(size), &columns, options)
}
