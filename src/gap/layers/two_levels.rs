//! y = b(t) + Δ s(t) + noise, s ∈ {0, 1} a Markov chain with mean dwell times d0 and d1: popcorn noise
//!
//! Baum's recursions at full rate (Rabiner, Proc. IEEE 77 (1989) 257), levels and dwell times by expectation and
//! maximisation. It has the spectrum of a Gauss-Markov process with 1/τ = 1/d0 + 1/d1; what tells them apart is that the
//! levels are two.

/// The chain at its best parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLevels {
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
    }
}

/// Fits the chain from a starting point: spacing in the unit of `x`, dwell time in samples.
#[must_use]
pub fn fit(x: &[f64], std: f64, spacing: f64, dwell: f64, rounds: usize) -> TwoLevels {
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
    }
}
