//! V_j = Σ_{block j} w² ~ v χ²_m, v = 1, or 1 + g in a share p of the blocks: noise that comes in bursts; and ln v periodic
//!
//! The level between bursts is the one that the series was whitened by. Free forms of the noise's level where it follows neither time slowly nor a covariate.

use crate::gap::evidence::{ln_add, ln_mean_exp};
use crate::gap::lines::Lines;

/// Bursts and periodic changes of the noise's level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bursts {
    /// Evidence of bursts in nats over a constant level.
    pub ln_bursts: f64,
    /// Samples in the blocks that show them best.
    pub samples: usize,
    /// Share of the blocks with more noise.
    pub share: f64,
    /// Evidence of a periodic level.
    pub ln_periodic: f64,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
}

/// Judges a whitened series, sampled every `step_s`.
#[must_use]
pub fn judge(w: &[f64], step_s: f64) -> Bursts {
    let mut found = Vec::new();
    for samples in [8usize, 32, 128, 512, 2048] {
        let sums: Vec<f64> = w.chunks_exact(samples).map(|c| c.iter().map(|v| v * v).sum()).collect();
        if sums.len() < 24 {
            continue;
        }
        let m = samples as f64;
        // ln density of the sum up to what does not depend on v
        let ln_density = |s: f64, v: f64| -0.5 * (m * v.ln() + s / v);
        let constant: f64 = sums.iter().map(|s| ln_density(*s, 1.0)).sum();
        let mut grid = Vec::new();
        for p in [0.003_f64, 0.01, 0.03, 0.1, 0.3] {
            for g in [0.15, 0.4, 1.0, 3.0, 10.0] {
                let one = |s: &f64| ln_add((1.0 - p).ln() + ln_density(*s, 1.0), p.ln() + ln_density(*s, 1.0 + g));
                grid.push((sums.iter().map(one).sum::<f64>() - constant, p));
            }
        }
        let values: Vec<f64> = grid.iter().map(|g| g.0).collect();
        let share = grid.iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |g| g.1);
        found.push((ln_mean_exp(&values, values.len() as f64), samples, share));
    }
    let values: Vec<f64> = found.iter().map(|f| f.0).collect();
    let best = found.iter().max_by(|a, b| a.0.total_cmp(&b.0)).copied().unwrap_or((0.0, 0, 0.0));
    const PER: usize = 8;
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
    Bursts {
        ln_bursts: if values.is_empty() { 0.0 } else { ln_mean_exp(&values, values.len() as f64) },
        samples: best.1,
        share: best.2,
        ln_periodic,
        frequency_hz: line.map_or(0.0, |l| l.frequency_hz),
    }
}
