//! w = N(0, v), v = 1 or 1 + g by a hidden Markov chain: noise that comes in bursts; and ln v periodic
//!
//! The level between bursts is the one that the series was whitened by, or what bursts leave of it. Free forms of the noise's
//! level where it follows neither time slowly nor a covariate. Forward recursion over sums of squares (Rabiner, Proc. IEEE
//! 77 (1989) 257).

use crate::gap::rest::whittle::evidence::ln_mean_exp;
use crate::gap::rest::whittle::lines::Lines;

/// Samples whose squares are summed before the recursion.
const PER: usize = 8;
/// Nats by which bursts have to be likelier than noise of another constant level.
const OVER_CONSTANT: f64 = 3.0;

/// ln p(sums | bursts) - ln p(sums | none), both levels relative to the series'.
fn ln_ratio(sums: &[f64], [quiet, loud]: [f64; 2], dwell: [f64; 2]) -> f64 {
    let leave = dwell.map(|d| 1.0 - (-1.0 / d).exp());
    let term = |v: f64| (-0.5 * PER as f64 * v.ln(), 0.5 * (1.0 - 1.0 / v));
    let ((a0, b0), (a1, b1)) = (term(quiet), term(loud));
    let mut p = dwell[1] / (dwell[0] + dwell[1]);
    let mut ln = 0.0;
    let mut product = 1.0;
    for (i, s) in sums.iter().enumerate() {
        if i > 0 {
            p = p * (1.0 - leave[1]) + (1.0 - p) * leave[0];
        }
        let common = a0 + b0 * s;
        let ratio = (a1 + b1 * s - common).min(600.0).exp();
        let c = (1.0 - p) + p * ratio;
        p = p * ratio / c;
        ln += common;
        product *= c;
        if !(1e-100..1e100).contains(&product) {
            ln += product.ln();
            product = 1.0;
        }
    }
    ln + product.ln()
}

/// ln p(sums | the most likely constant level) - ln p(sums | the series' own).
fn ln_constant(sums: &[f64]) -> f64 {
    let n = (PER * sums.len()) as f64;
    let mean = sums.iter().sum::<f64>() / n;
    if mean > 0.0 { 0.5 * n * (mean - 1.0 - mean.ln()) } else { 0.0 }
}

/// Bursts and periodic changes of the noise's level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bursts {
    /// Evidence of bursts in nats over a constant level.
    pub ln_bursts: f64,
    /// Mean length of a burst, samples.
    pub samples: usize,
    /// Share of the time with more noise.
    pub share: f64,
    /// Evidence of a periodic level.
    pub ln_periodic: f64,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
}

/// Judges a whitened series, sampled every `step_s`.
#[must_use]
pub(crate) fn judge(w: &[f64], step_s: f64) -> Bursts {
    let sums: Vec<f64> = w.chunks_exact(PER).map(|c| c.iter().map(|v| v * v).sum()).collect();
    let mut found: Vec<(f64, usize, f64)> = Vec::new();
    for burst in [1.0, 4.0, 16.0, 64.0, 256.0] {
        for pause in [3.0, 10.0, 30.0].map(|r| r * burst) {
            // at least a few bursts, else it is a slow course of the level
            if pause + burst > sums.len() as f64 / 3.0 {
                continue;
            }
            let share = burst / (pause + burst);
            for g in [0.06, 0.15, 0.4, 1.0, 3.0, 10.0] {
                for quiet in [1.0, 1.0 / (1.0 + share * g)] {
                    let v = ln_ratio(&sums, [quiet, quiet * (1.0 + g)], [pause, burst]);
                    found.push((v, burst as usize * PER, share));
                }
            }
        }
    }
    let values: Vec<f64> = found.iter().map(|f| f.0).collect();
    let best = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied().unwrap_or((0.0, 0, 0.0));
    let level: Vec<f64> = w
        .chunks_exact(PER)
        .map(|c| (c.iter().map(|v| v * v).sum::<f64>() / PER as f64 - 1.0) * (PER as f64 / 2.0).sqrt())
        .collect();
    let mean = level.iter().sum::<f64>() / level.len().max(1) as f64;
    let std = (level.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / level.len().max(1) as f64).sqrt().max(1e-300);
    let level: Vec<f64> = level.iter().map(|v| (v - mean) / std).collect();
    let lines = Lines::new(&level, step_s * PER as f64);
    let line = lines.comb(3.0, 3).filter(|_| level.len() >= 64);
    // six coefficients, each costs about what its own noise gains and its prior's width
    let ln_periodic = line.map_or(0.0, |l| l.gain + lines.ln_shape(&l, 3.0) - 6.0);
    // a burst that never ends is a level, and costs a chain little more
    let ln_bursts = if values.is_empty() { 0.0 } else { ln_mean_exp(&values, values.len() as f64) };
    let constant = ln_constant(&sums);
    Bursts {
        ln_bursts: if ln_bursts > constant + OVER_CONSTANT { ln_bursts } else { ln_bursts.min(0.0) },
        samples: best.1,
        share: best.2,
        ln_periodic,
        frequency_hz: line.map_or(0.0, |l| l.frequency_hz),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn bursts_that_no_single_block_shows_are_found_and_white_noise_has_none() {
        let mut draw = Stream::new(6, 0);
        let white: Vec<f64> = (0..40_000).map(|_| draw.normal()).collect();
        assert!(judge(&white, 0.1).ln_bursts < 2.0, "{:?}", judge(&white, 0.1));
        // nor has white noise of another level
        let louder: Vec<f64> = white.iter().map(|w| 1.2 * w).collect();
        assert!(judge(&louder, 0.1).ln_bursts <= 0.0, "{:?}", judge(&louder, 0.1));
        let mut on = false;
        let loud: Vec<f64> = white
            .iter()
            .map(|w| {
                if draw.uniform() < if on { 1.0 / 300.0 } else { 1.0 / 2000.0 } {
                    on = !on;
                }
                if on { 1.2 * w } else { *w }
            })
            .collect();
        // a burst of 300 samples gains about 300 · (1.44 - 1 - ln 1.44)/2 = 11 nats where its place is known, and there are 17
        let found = judge(&loud, 0.1);
        assert!(found.ln_bursts > 20.0, "{found:?}");
        assert!((60..1200).contains(&found.samples) && (0.02..0.4).contains(&found.share), "{found:?}");
    }
}
