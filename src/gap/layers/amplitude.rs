//! w ~ (1 - p) N(0, 1) + p N(0, 1 + A²): rare large samples; or, as a free form, any symmetric heavy or light tail
//!
//! Evidence by a sum over the parameters' grid against w ~ N(0, s²), s near one.

use crate::gap::evidence::{ln_add, ln_mean_exp};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::{LN_2, PI, TAU};

/// Evidences in nats over normal samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amplitude {
    /// Rare large samples.
    pub outliers: f64,
    /// Their probability per sample (posterior mean) and its standard deviation.
    pub probability: [f64; 2],
    /// Their root mean square, in standard deviations of the noise.
    pub outlier_std: f64,
    /// Any other symmetric distribution: Student's t and the generalised normal.
    pub free: f64,
    /// Shape of the best free distribution: degrees of freedom, or minus the exponent.
    pub shape: f64,
}

/// |w| in bins that keep ln densities to a part in a thousand.
struct Histogram {
    centre: Vec<f64>,
    count: Vec<f64>,
}

impl Histogram {
    fn new(w: &[f64]) -> Self {
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

/// Holds the samples that are rather outliers than noise at three standard deviations, for what looks at energy.
pub fn limit(w: &mut [f64], a: &Amplitude) {
    let [p, _] = a.probability;
    let variance = 1.0 + a.outlier_std * a.outlier_std;
    for v in w {
        if p.ln() + ln_normal(*v, variance) > (1.0 - p).ln() + ln_normal(*v, 1.0) {
            *v = v.clamp(-3.0, 3.0);
        }
    }
}

/// Judges the amplitudes of a whitened series.
#[must_use]
pub fn judge(w: &[f64]) -> Amplitude {
    let h = Histogram::new(w);
    let n: f64 = h.count.iter().sum();
    // the level is known to about one part in a hundred
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
