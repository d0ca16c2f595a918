//! u_j = Σ_{block j} w/√m: sums over m samples are normal too, unless rare events of about that length lie in them
//!
//! Free form: events at a scale, u ~ (1 - p) N(0, 1) + p N(0, 1 + A²). A Gaussian process of any spectrum has been whitened
//! away and shows none; pulses, bumps and relaxations do.

use crate::gap::rest::whittle::evidence::{ln_add, ln_mean_exp};
use std::f64::consts::TAU;

/// Rare events of some length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Events {
    /// Evidence in nats over none.
    pub ln_evidence: f64,
    /// Samples that an event lasts.
    pub samples: usize,
    /// Share of the blocks with one.
    pub share: f64,
}

/// Judges sums over 2, 4, … samples.
#[must_use]
pub(crate) fn judge(w: &[f64]) -> Events {
    let mut found = Vec::new();
    let mut sums = w.to_vec();
    let mut samples = 1;
    while sums.len() >= 128 {
        let next: Vec<f64> = sums.chunks_exact(2).map(|c| (c[0] + c[1]) * std::f64::consts::FRAC_1_SQRT_2).collect();
        sums = next;
        samples *= 2;
        if samples < 4 {
            continue;
        }
        // the level of this scale is free: what the spectrum misses is no event
        let level = sums.iter().map(|v| v * v).sum::<f64>() / sums.len() as f64;
        let ln_normal = |x2: f64, v: f64| -0.5 * (x2 / v + (TAU * v).ln());
        let normal: f64 = sums.iter().map(|v| ln_normal(v * v, level)).sum();
        let mut grid = Vec::new();
        for p in [0.001, 0.003, 0.01, 0.03, 0.1] {
            for a in [2.0_f64, 4.0, 8.0, 16.0] {
                // the core keeps what is left of the level, within reason
                let core = (level / (1.0 + p * a * a)).clamp(0.3 * level, level);
                let wide = core * (1.0 + a * a);
                let one =
                    |v: &f64| ln_add(f64::ln(1.0 - p) + ln_normal(v * v, core), f64::ln(p) + ln_normal(v * v, wide));
                grid.push((sums.iter().map(one).sum::<f64>(), p));
            }
        }
        let values: Vec<f64> = grid.iter().map(|g| g.0).collect();
        let share = grid.iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |g| g.1);
        found.push((ln_mean_exp(&values, values.len() as f64) - normal, samples, share));
    }
    let evidences: Vec<f64> = found.iter().map(|f| f.0).collect();
    let best = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied().unwrap_or((0.0, 0, 0.0));
    Events {
        ln_evidence: if found.is_empty() { 0.0 } else { ln_mean_exp(&evidences, found.len() as f64) },
        samples: best.1,
        share: best.2,
    }
}
