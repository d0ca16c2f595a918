//! y = b(t) + Δ s(t) + noise, s ∈ {0, 1} a Markov chain with mean dwell times d0 and d1: popcorn noise
//!
//! Baum's recursions at full rate (Rabiner, Proc. IEEE 77 (1989) 257), levels and dwell times by expectation and
//! maximisation. It has the spectrum of a Gauss-Markov process with 1/τ = 1/d0 + 1/d1; what tells them apart is that the
//! levels are two.

use crate::gap::rest::whittle::evidence::{damped, ln_det_and_std};
use crate::math::curvature::curvature;
use std::f64::consts::TAU;

/// The chain at its best parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TwoLevels {
    /// Level of state zero, in the unit of the series.
    pub low: f64,
    /// Δ, positive.
    pub spacing: f64,
    /// Mean time in state zero, samples.
    pub dwell_low: f64,
    /// Mean time in state one, samples.
    pub dwell_high: f64,
    /// ln p(series | parameters).
    pub ln_likelihood: f64,
    /// Probability of state one at each sample.
    pub high: Vec<f64>,
    /// Expected number of jumps.
    pub jumps: f64,
    /// Standard deviations of ln spacing and of the logarithms of both dwell times; known after [`evidence`].
    pub relative_std: [f64; 3],
}

/// One pass forwards and backwards with noise of standard deviation `std`.
fn pass(x: &[f64], std: f64, low: f64, spacing: f64, dwell: [f64; 2]) -> TwoLevels {
    let leave = dwell.map(|d| 1.0 - (-1.0 / d.max(1e-3)).exp());
    let stationary = dwell[1] / (dwell[0] + dwell[1]);
    // density ratio of state one over state zero; the common factor is added at the end
    let ratio = |v: f64| ((v - low) * spacing / (std * std) - 0.5 * (spacing / std).powi(2)).clamp(-600.0, 600.0).exp();
    let n = x.len();
    let (mut filtered, mut norm) = (Vec::with_capacity(n), Vec::with_capacity(n));
    let mut p = stationary;
    let mut ln_likelihood = 0.0;
    for (i, v) in x.iter().enumerate() {
        if i > 0 {
            p = p * (1.0 - leave[1]) + (1.0 - p) * leave[0];
        }
        let (a, b) = ((1.0 - p), p * ratio(*v));
        let c = a + b;
        p = b / c;
        ln_likelihood += c.ln() - 0.5 * ((v - low) / std).powi(2);
        filtered.push(p);
        norm.push(c);
    }
    ln_likelihood -= n as f64 * (std * std::f64::consts::TAU.sqrt()).ln();
    let mut high = filtered.clone();
    let mut jumps = [0.0, 0.0];
    for i in (0..n.saturating_sub(1)).rev() {
        // Rauch's form: smoothed from filtered and one-step prediction
        let f = filtered[i];
        let predicted = f * (1.0 - leave[1]) + (1.0 - f) * leave[0];
        let (up, down) = (high[i + 1] / predicted.max(1e-300), (1.0 - high[i + 1]) / (1.0 - predicted).max(1e-300));
        let (hh, hl) = (f * (1.0 - leave[1]) * up, f * leave[1] * down);
        let lh = (1.0 - f) * leave[0] * up;
        high[i] = (hh + hl).clamp(0.0, 1.0);
        jumps[0] += lh;
        jumps[1] += hl;
    }
    TwoLevels {
        low,
        spacing,
        dwell_low: dwell[0],
        dwell_high: dwell[1],
        ln_likelihood,
        high,
        jumps: jumps[0] + jumps[1],
        relative_std: [f64::INFINITY; 3],
    }
}

/// Fits the chain from a starting point: spacing in the unit of `x`, dwell time in samples.
#[must_use]
pub(crate) fn fit(x: &[f64], std: f64, spacing: f64, dwell: f64, rounds: usize) -> TwoLevels {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n.max(1.0);
    let mut now = pass(x, std, mean - 0.5 * spacing, spacing, [dwell, dwell]);
    for _ in 0..rounds {
        let on: f64 = now.high.iter().sum();
        let off = n - on;
        if on < 2.0 || off < 2.0 {
            return now;
        }
        let sum: f64 = x.iter().sum();
        let sum_on: f64 = x.iter().zip(&now.high).map(|(v, h)| v * h).sum();
        let (low, high) = ((sum - sum_on) / off, sum_on / on);
        let crossings = (0.5 * now.jumps).max(0.5);
        // levels keep their order
        let (low, high) = if high > low { (low, high) } else { (high, low) };
        let next = pass(x, std, low, high - low, [off / crossings, on / crossings]);
        let gained = next.ln_likelihood - now.ln_likelihood;
        let accept = gained > 0.0 || next.ln_likelihood.is_finite() && !now.ln_likelihood.is_finite();
        if accept {
            now = next;
        }
        if gained < 0.05 {
            break;
        }
    }
    now
}

/// ln p(x | parameters) alone: [ln Δ, ln d0, ln d1] with the series' mean where the occupancy `on` puts it.
fn ln_likelihood(x: &[f64], std: f64, mean: f64, on: f64, u: &[f64; 3]) -> f64 {
    let [spacing, d0, d1] = u.map(f64::exp);
    let low = mean - spacing * on;
    let leave = [d0, d1].map(|d| 1.0 - (-1.0 / d.max(1e-3)).exp());
    let (slope, half) = (spacing / (std * std), 0.5 * (spacing / std).powi(2));
    let (mut p, mut squares, mut ln, mut product) = (d1 / (d0 + d1), 0.0, 0.0, 1.0);
    for (i, v) in x.iter().enumerate() {
        if i > 0 {
            p = p * (1.0 - leave[1]) + (1.0 - p) * leave[0];
        }
        let b = p * ((v - low) * slope - half).clamp(-600.0, 600.0).exp();
        let c = (1.0 - p) + b;
        p = b / c;
        product *= c;
        if !(1e-100..1e100).contains(&product) {
            ln += product.ln();
            product = 1.0;
        }
        squares += ((v - low) / std).powi(2);
    }
    ln + product.ln() - 0.5 * squares - x.len() as f64 * (std * TAU.sqrt()).ln()
}

/// Widths of the priors of ln Δ and of each ln d, uniform, for a series of so many samples.
fn widths(samples: usize) -> [f64; 3] {
    let dwell = (samples.max(3) as f64).ln();
    [7.0, dwell, dwell]
}

/// The chain at the mode of its likelihood, and ln ∫ p(x | parameters) p(parameters) by Laplace's method there: where the
/// noise hides the jumps its parameters are known far worse than the number of jumps alone would have it.
#[must_use]
pub(crate) fn evidence(x: &[f64], std: f64, start: &TwoLevels) -> (TwoLevels, f64) {
    /// Step of the differences, in ln of a parameter.
    const STEP: f64 = 0.04;
    let n = x.len().max(1) as f64;
    let (mean, on) = (x.iter().sum::<f64>() / n, start.high.iter().sum::<f64>() / n);
    let f = |u: &[f64; 3]| ln_likelihood(x, std, mean, on, u);
    let longest = n.ln();
    let mut u = [start.spacing.max(1e-300).ln(), start.dwell_low.max(0.3).ln(), start.dwell_high.max(0.3).ln()];
    let mut best = f(&u);
    let (mut damping, mut hessian) = (1e-2, vec![0.0; 9]);
    for round in 0..6 {
        let gradient;
        (gradient, hessian) = curvature(|v| f(&[v[0], v[1], v[2]]), &u, best, &[STEP; 3]);
        let mut gained = 0.0;
        for _ in 0..if round == 5 { 0 } else { 6 } {
            let delta = damped(&hessian, &gradient, damping);
            let next = delta.map(|d| {
                let mut v = u;
                v.iter_mut().zip(&d).for_each(|(v, d)| *v += d.clamp(-1.0, 1.0));
                v[1..].iter_mut().for_each(|v| *v = v.clamp(-1.0, longest));
                v
            });
            let value = next.as_ref().map_or(f64::NEG_INFINITY, &f);
            if let Some(next) = next.filter(|_| value > best) {
                (gained, best, u) = (value - best, value, next);
                damping *= 0.2;
                break;
            }
            damping = (damping * 8.0).max(1e-2);
        }
        if gained < 0.02 {
            break;
        }
    }
    let widths = widths(x.len());
    (0..3).for_each(|i| hessian[4 * i] = hessian[4 * i].max(0.0) + 12.0 / (widths[i] * widths[i]));
    let (ln_det, relative_std) = ln_det_and_std(&hessian, 3);
    let ln_volume = 0.5 * (3.0 * TAU.ln() - ln_det) - widths.iter().map(|w| w.ln()).sum::<f64>();
    let [spacing, d0, d1] = u.map(f64::exp);
    let mut chain = pass(x, std, mean - spacing * on, spacing, [d0, d1]);
    chain.relative_std = [relative_std[0], relative_std[1], relative_std[2]];
    let evidence = chain.ln_likelihood + ln_volume.min(0.0);
    (chain, evidence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn levels_and_dwell_times_are_recovered() {
        let mut draw = Stream::new(5, 0);
        let (mut s, mut x) = (0.0, Vec::new());
        let dwell = [400.0, 900.0];
        for _ in 0..60_000 {
            let d: f64 = if s > 0.5 { dwell[1] } else { dwell[0] };
            if draw.uniform() < 1.0 - (-1.0 / d).exp() {
                s = 1.0 - s;
            }
            x.push(0.3 * s + draw.normal());
        }
        let found = fit(&x, 1.0, 0.2, 300.0, 60);
        // about 46 sojourns of each kind: dwell times to 15 %, three standard errors 45 %
        assert!((found.spacing - 0.3).abs() < 0.03, "{}", found.spacing);
        assert!((found.dwell_low / dwell[0]).ln().abs() < 0.45, "{}", found.dwell_low);
        assert!((found.dwell_high / dwell[1]).ln().abs() < 0.45, "{}", found.dwell_high);
        let (refined, ln_evidence) = evidence(&x, 1.0, &found);
        assert!(refined.ln_likelihood >= found.ln_likelihood - 0.5);
        // each parameter is known to a share of its prior's width: it costs between one nat and the width over its spread
        let cost = refined.ln_likelihood - ln_evidence;
        assert!((3.0..25.0).contains(&cost), "{cost}");
        let [spacing, low, high] = refined.relative_std;
        // 46 sojourns: at least one in seven, and no more than twice that while the noise hides no jump
        assert!(spacing < 0.05 && [low, high].iter().all(|s| (0.12..0.4).contains(s)), "{:?}", refined.relative_std);
    }
}
