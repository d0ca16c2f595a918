//! The cosine coefficients of a log of which one pass kept block means and raw stretches

use super::super::kept::Stretches;
use super::{
    BLOCKS, Bins, Column, Cosine, EvenLog, FALSE_LINES, FINE, LEAST_IN_BIN, LINE_BIN, Observed, SMOOTH_BLOCKS,
    SpectralLine,
};
use crate::math::spectra::quick_len;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

/// Coefficients that block means tell, as a part of their number: above them means of blocks hold less of what is slow,
/// and more of what is fast, than the samples (a thirtieth of a cycle a block: 0.3 %).
const TOLD_BY_MEANS: usize = 16;

impl Observed {
    /// The log that one pass kept: its slow coefficients from the block means `slow` of `block` samples each, its fast ones
    /// from raw stretches of equal length, at the same frequencies.
    ///
    /// Coefficient j of a stretch of l samples has the frequency of the coefficient j n/l of the log, and under noise that
    /// is stationary in its increments the same variance: the likelihood counts those that there are.
    pub(crate) fn of_kept(slow: &EvenLog, block: usize, stretches: &Stretches, columns: &[Column]) -> Self {
        // a hundredth of the log at most is left out at its end
        let blocks = quick_len(slow.values.len());
        let (len, step_s) = (blocks * block, slow.step_s / block as f64);
        let values = &slow.values[..blocks];
        let mean = values.iter().sum::<f64>() / blocks as f64;
        let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
        // orthonormal on both sides: √(len/blocks) = √block
        let scale = (block as f64).sqrt();
        let cosine = Cosine::new(blocks);
        let mut z = cosine.forward(&centred);
        z.truncate(blocks / TOLD_BY_MEANS);
        z.iter_mut().for_each(|v| *v *= scale);
        // a bin holds as many coefficients of the stretches
        let least = LEAST_IN_BIN.max(LEAST_IN_BIN * len / (stretches.len() * stretches.count()).max(1));
        let bins = Bins::no_wider(
            len,
            BLOCKS.min(z.len()),
            (len / FINE).max(least).max(2 * LINE_BIN * len / stretches.len().max(1)),
        );
        let told = bins.edges[1..].iter().take_while(|edge| **edge <= z.len()).count().saturating_sub(1);
        let bin_count = bins.len() - 1;
        let mut out = Self {
            step_s,
            len,
            k: bins.omega[1..].iter().map(|w| w * len as f64 / std::f64::consts::PI).collect(),
            count: vec![0.0; bin_count],
            power: vec![0.0; bin_count],
            lines: Vec::new(),
            bins,
            columns: Vec::new(),
            column_rms: Vec::new(),
            prior_std: Vec::new(),
            means: (block, told),
            gram: Vec::new(),
            with_data: Vec::new(),
        };
        for bin in 0..told {
            let range = out.bins.edges[bin + 1]..out.bins.edges[bin + 2];
            out.count[bin] = range.len() as f64;
            out.power[bin] = z[range].iter().map(|v| v * v).sum();
        }
        let mut found = out.lines_of(&z.iter().map(|v| v * v).collect::<Vec<_>>(), len, 1, 0..told);
        found.extend(out.fast_part(stretches, told));
        found.sort_by(|a, b| b.amplitude_rad_s.total_cmp(&a.amplitude_rad_s));
        out.lines = found;
        let per_bin = |b: usize| {
            let all = (out.bins.edges[b + 2] - out.bins.edges[b + 1]) as f64;
            if out.count[b] > 0.0 { all * out.power[b] / out.count[b] } else { 0.0 }
        };
        let rms = ((0..bin_count).map(per_bin).sum::<f64>() / len as f64).sqrt();
        for column in columns {
            let at: Vec<f64> = (0..blocks).map(|i| (column.at)(slow.first_s + i as f64 * slow.step_s)).collect();
            let mut low = cosine.forward(&at);
            let fast = column.changes_over_s < SMOOTH_BLOCKS * out.span_s() / BLOCKS as f64;
            low.truncate(if fast { z.len() } else { BLOCKS.min(z.len()) });
            low.iter_mut().for_each(|v| *v *= scale);
            low[0] = 0.0;
            out.push(low, &z, column.std, rms);
        }
        out
    }

    /// Power of the bins from `first` on, by the stretches; returns the lines that were left out.
    fn fast_part(&mut self, stretches: &Stretches, first: usize) -> Vec<SpectralLine> {
        let (len, count) = (stretches.len(), stretches.count());
        let cosine = Cosine::new(len);
        let mut squares = vec![0.0; len];
        for stretch in stretches.iter() {
            let mean = stretch.values.iter().sum::<f64>() / len as f64;
            let centred: Vec<f64> = stretch.values.iter().map(|v| v - mean).collect();
            squares.iter_mut().zip(cosine.forward(&centred)).for_each(|(s, z)| *s += z * z);
        }
        let per_log = self.len as f64 / len as f64;
        for bin in first..self.k.len() {
            let range = self.within(bin, len);
            if range.is_empty() {
                continue;
            }
            self.k[bin] = per_log * 0.5 * (range.start + range.end - 1) as f64;
            self.count[bin] = (range.len() * count) as f64;
            self.power[bin] = squares[range].iter().sum();
        }
        self.lines_of(&squares, len, count, first..self.k.len())
    }

    /// Coefficients of a series of `len` samples that lie in a bin.
    fn within(&self, bin: usize, len: usize) -> Range<usize> {
        let at = |edge: usize| ((edge as f64 * len as f64 / self.len as f64).ceil() as usize).clamp(1, len);
        at(self.bins.edges[bin + 1])..at(self.bins.edges[bin + 2])
    }

    /// Leaves coefficients that no noise explains out of `bins`: `squares` are sums over `series` series of `len` samples.
    fn lines_of(&mut self, squares: &[f64], len: usize, series: usize, bins: Range<usize>) -> Vec<SpectralLine> {
        let n = series as f64;
        let Ok(law) = ChiSquared::new(n) else { return Vec::new() };
        let most = law.inverse_cdf(1.0 - FALSE_LINES / len as f64);
        let median = law.inverse_cdf(0.5);
        let mut gone = vec![false; squares.len()];
        let mut strong: Vec<(f64, usize, usize)> = Vec::new();
        for bin in bins.clone() {
            let range = self.within(bin, len);
            if range.len() < LINE_BIN {
                continue;
            }
            let mut sorted = squares[range.clone()].to_vec();
            let middle = sorted.len() / 2;
            let level = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1 / median;
            for k in range.filter(|k| squares[*k] > most * level) {
                let reach = 2 + ((squares[k] / level).sqrt() / std::f64::consts::PI).ceil() as usize;
                strong.push((squares[k], k, reach));
            }
        }
        strong.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut lines = Vec::new();
        for (square, k, reach) in strong {
            if !gone[k] {
                let frequency_hz = k as f64 / (2.0 * self.step_s * len as f64);
                let amplitude_rad_s = (2.0 * square / (n * len as f64)).sqrt();
                lines.push(SpectralLine { frequency_hz, amplitude_rad_s });
            }
            let last = (k + reach).min(squares.len() - 1);
            gone[k.saturating_sub(reach).max(1)..=last].fill(true);
        }
        for bin in bins {
            let range = self.within(bin, len);
            let out = range.clone().filter(|k| gone[*k]).count();
            if out == 0 || range.len() < LINE_BIN {
                continue;
            }
            let kept: f64 = range.clone().filter(|k| !gone[*k]).map(|k| squares[k]).sum();
            (self.count[bin], self.power[bin]) =
                if 4 * out > 3 * range.len() { (0.0, 0.0) } else { ((range.len() - out) as f64 * n, kept) };
        }
        lines
    }
}
