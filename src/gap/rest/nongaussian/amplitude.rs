//! w ~ (1 - p) N(0, 1) + p N(0, 1 + A²): rare large samples; or, as a free form, any symmetric heavy or light tail
//!
//! Evidence by a sum over the parameters' grid against w ~ N(0, s²), s near one.

use crate::gap::rest::whittle::evidence::{ln_add, ln_mean_exp};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::{LN_2, PI, TAU};

/// ln evidences over normal samples, nats, with the parameters found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Amplitude {
    /// ln evidence of rare large samples.
    pub outliers: f64,
    /// Probability of a rare large sample: posterior mean and standard deviation.
    pub probability: [f64; 2],
    /// A, posterior mean: standard deviation of the excess of rare samples, in standard deviations of the noise.
    pub outlier_std: f64,
    /// ln evidence of any other symmetric distribution: Student's t and the generalised normal.
    pub free: f64,
    /// Shape of the best free distribution: degrees of freedom, or minus the exponent.
    pub shape: f64,
}

/// Histogram of |w| with bins that keep ln densities to a part in a thousand.
struct Histogram {
    centre: Vec<f64>,
    count: Vec<f64>,
}

impl Histogram {
    fn new(w: &[f64]) -> Self {
        /// Width of a bin, in standard deviations.
        const WIDTH: f64 = 0.02;
        let mut bins: std::collections::BTreeMap<i64, (f64, f64)> = std::collections::BTreeMap::new();
        for v in w.iter().filter(|v| v.is_finite()) {
            let a = v.abs();
            // linear at first, logarithmic above ten
            let key = if a < 10.0 { (a / WIDTH) as i64 } else { 500 + (50.0 * (a / 10.0).ln()) as i64 };
            let bin = bins.entry(key).or_default();
            bin.0 += 1.0;
            bin.1 += a * a;
        }
        let centre = bins.values().map(|b| (b.1 / b.0).sqrt()).collect();
        Self { centre, count: bins.values().map(|b| b.0).collect() }
    }

    fn ln_likelihood(&self, ln_density: impl Fn(f64) -> f64) -> f64 {
        self.centre.iter().zip(&self.count).map(|(x, n)| n * ln_density(*x)).sum()
    }
}

fn ln_normal(x: f64, variance: f64) -> f64 {
    -0.5 * (x * x / variance + (TAU * variance).ln())
}

/// Clips samples that are more probably outliers than noise at three standard deviations.
pub(crate) fn limit(w: &mut [f64], a: &Amplitude) {
    let [p, _] = a.probability;
    let variance = 1.0 + a.outlier_std * a.outlier_std;
    for v in w {
        if p.ln() + ln_normal(*v, variance) > (1.0 - p).ln() + ln_normal(*v, 1.0) {
            *v = v.clamp(-3.0, 3.0);
        }
    }
}

/// Fewest samples of a stretch over which the level is constant; most stretches.
const LEVEL_SAMPLES: usize = 1000;
const LEVELS: usize = 64;
/// Samples beyond this many standard deviations do not count in the level; variance of a normal sample within that
/// limit.
const WITHIN: f64 = 3.0;
const VARIANCE_WITHIN: f64 = 0.973_339;
/// Rounds in which the level is estimated anew.
const LEVEL_ROUNDS: usize = 8;

/// The series divided by its own slowly varying level, so that a changing level does not look like heavy tails.
#[must_use]
pub(crate) fn levelled(w: &[f64]) -> Vec<f64> {
    let n = w.len();
    let count = (n / LEVEL_SAMPLES).clamp(1, LEVELS);
    let level = |part: &[f64]| {
        let mut s = (part.iter().map(|v| v * v).sum::<f64>() / part.len().max(1) as f64).sqrt();
        for _ in 0..LEVEL_ROUNDS {
            let within = part.iter().filter(|v| v.abs() < WITHIN * s);
            let (sum, kept) = within.fold((0.0, 0.0_f64), |(a, b), v| (a + v * v, b + 1.0));
            s = (sum / kept.max(1.0) / VARIANCE_WITHIN).sqrt();
        }
        if s > 0.0 { s } else { 1.0 }
    };
    let edge = |k: usize| k * n / count;
    let ln: Vec<f64> = (0..count).map(|k| level(&w[edge(k)..edge(k + 1)]).ln()).collect();
    let at = |i: usize| {
        let x = ((i as f64 + 0.5) * count as f64 / n as f64 - 0.5).clamp(0.0, (count - 1) as f64);
        let k = (x as usize).min(count.saturating_sub(2));
        let next = ln.get(k + 1).copied().unwrap_or(ln[k]);
        (ln[k] + (x - k as f64) * (next - ln[k])).exp()
    };
    w.iter().enumerate().map(|(i, v)| v / at(i)).collect()
}

/// Judges the amplitudes of a whitened series.
#[must_use]
pub(crate) fn judge(w: &[f64]) -> Amplitude {
    let h = Histogram::new(w);
    let n: f64 = h.count.iter().sum();
    // the level is known to about one percent
    let scales: Vec<f64> = (-3..=3).map(|i| (1.0 + 0.01 * f64::from(i)).powi(2)).collect();
    let normal: Vec<f64> = scales.iter().map(|s| h.ln_likelihood(|x| ln_normal(x, *s))).collect();
    let normal = ln_mean_exp(&normal, scales.len() as f64);
    let mut rare = Vec::new();
    let mut grid = Vec::new();
    let least = (0.5 / n.max(1.0)).max(1e-7);
    for i in 0..24 {
        let p = least * (0.03 / least).powf((f64::from(i) + 0.5) / 24.0);
        for a in [3.0, 5.0, 8.0, 13.0, 22.0, 40.0, 80.0, 200.0] {
            let variance = 1.0 + a * a;
            let v = h.ln_likelihood(|x| ln_add((1.0 - p).ln() + ln_normal(x, 1.0), p.ln() + ln_normal(x, variance)));
            rare.push(v);
            grid.push((p, a));
        }
    }
    let outliers = ln_mean_exp(&rare, rare.len() as f64) - normal;
    let top = rare.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weight: Vec<f64> = rare.iter().map(|v| (v - top).exp()).collect();
    let total: f64 = weight.iter().sum();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| grid.iter().zip(&weight).map(|(g, w)| w * f(g)).sum::<f64>() / total;
    let p = mean(&|g| g.0);
    let p_std = (mean(&|g| g.0 * g.0) - p * p).max(0.0).sqrt();
    let mut free = Vec::new();
    let mut shapes = Vec::new();
    // dense around one, where a distribution close to the normal one lies
    let mut levels: Vec<f64> = (0..20).map(|i| 0.4 * (0.92_f64 / 0.4).powf(f64::from(i) / 19.0)).collect();
    levels.extend((0..18).map(|i| 0.925 + 0.007 * f64::from(i)));
    for nu in [2.2, 2.6, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 25.0, 50.0, 120.0] {
        let constant = ln_gamma(0.5 * (nu + 1.0)) - ln_gamma(0.5 * nu) - 0.5 * (nu * PI).ln();
        for s in &levels {
            let density = |x: f64| constant - s.ln() - 0.5 * (nu + 1.0) * (1.0 + (x / s).powi(2) / nu).ln();
            free.push(h.ln_likelihood(density));
            shapes.push(nu);
        }
    }
    for beta in [0.8, 1.0, 1.3, 1.6, 1.8, 1.92, 2.08, 2.3, 2.8, 4.0, 8.0] {
        for s in &levels {
            // levels are standard deviations; this law's scale is smaller by a factor of gamma functions
            let alpha = s * (0.5 * (ln_gamma(1.0 / beta) - ln_gamma(3.0 / beta))).exp();
            let constant = f64::ln(beta) - LN_2 - alpha.ln() - ln_gamma(1.0 / beta);
            free.push(h.ln_likelihood(|x| constant - (x / alpha).powf(beta)));
            shapes.push(-beta);
        }
    }
    let best = (0..free.len()).max_by(|a, b| free[*a].total_cmp(&free[*b])).unwrap_or(0);
    Amplitude {
        outliers,
        probability: [p, p_std],
        outlier_std: mean(&|g| g.1),
        free: ln_mean_exp(&free, free.len() as f64) - normal,
        shape: shapes.get(best).copied().unwrap_or(f64::INFINITY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    #[test]
    fn a_level_that_grows_has_no_tails_and_rare_samples_on_it_do() {
        let mut draw = Stream::new(4, 0);
        let n = 60_000;
        let grown: Vec<f64> = (0..n).map(|i| draw.normal() * (0.9 * f64::from(i) / f64::from(n)).exp()).collect();
        assert!(judge(&grown).outliers > 100.0);
        let found = judge(&levelled(&grown));
        assert!(found.outliers < 1.0 && found.free < 1.0, "{found:?}");
        let mut rare = grown;
        (0..60).for_each(|k| rare[997 * k] += 9.0 * (0.9 * 997.0 * k as f64 / f64::from(n)).exp());
        let found = judge(&levelled(&rare));
        // each outlier is worth 9²/2 - ln(1/p) and more; a normal distribution of sizes expects small ones that cannot
        // be seen
        assert!(found.outliers > 1200.0 && (found.probability[0] * f64::from(n) / 60.0).ln().abs() < 0.7, "{found:?}");
    }
}
