//! y = b(t) + path(t) + noise: telegraph (popcorn) noise beside a Gaussian part, by alternating (mean-field)
//! improvement
//!
//! ln evidence ≈ ln p(y - E path | Gaussian part) + [ln p(x | chain) - ln p(x | E path)], x = y - E b: the lower bound
//! of the factorised posterior, each factor given the mean of the other (Jordan et al., Machine Learning 37 (1999)
//! 183).

use super::two_levels;
use super::two_levels::{TwoLevels, fit};
use crate::gap::rest::whittle::basis::{ColumnId, Data, SpectralBasis};
use crate::gap::rest::whittle::evidence::{Fitted, Likelihood};
use crate::gap::rest::whittle::hypothesis::{Candidate, Hypothesis};
use std::f64::consts::TAU;

/// Telegraph noise and the Gaussian part fitted beside it.
#[derive(Debug, Clone)]
pub(crate) struct TelegraphFit {
    /// The Gaussian part, fitted to the recording less the path.
    pub fitted: Fitted,
    /// ln evidence of chain and Gaussian part together, nats.
    pub ln_evidence: f64,
    /// The two-state Markov chain; dwell times in samples of the recording.
    pub chain: TwoLevels,
    /// Expected path less its mean at each sample, rad/s.
    pub path: Vec<f64>,
    /// ln evidence of the chain alone, in `series`, nats.
    pub ln_chain: f64,
    /// The recording less the predicted Gaussian part, averaged over `step_s`, rad/s.
    pub series: Vec<f64>,
    /// Standard deviation of the white noise of a value of `series`, rad/s.
    pub std: f64,
    /// Time between values of `series`, s.
    pub step_s: f64,
}

/// Prediction of the recording by the Gaussian part without its white noise, given the recording, rad/s.
fn baseline(l: &Likelihood, h: &Hypothesis) -> Vec<f64> {
    let remainder = l.remainder(h);
    let mut z: Vec<f64> = l.data.z.iter().zip(&remainder).map(|(a, b)| a - b).collect();
    if !h.noises.is_empty() {
        z.iter_mut().zip(l.followed(h, &remainder)).for_each(|(z, f)| *z += f);
    }
    l.frame.series(&z)
}

/// Variance of means over `per` samples of noise with the spectrum `white` (rad²/s²), and covariance of neighbouring
/// means, both rad²/s².
fn mean_noise(frame: &SpectralBasis, white: &[f64], per: usize) -> [f64; 2] {
    /// Points of integration in a bin: the response to a mean over many samples is narrower than a bin.
    const POINTS: usize = 16;
    let (n, m) = (frame.len().max(1) as f64, per as f64);
    let mut sums = [0.0, 0.0];
    for ((band, count), s) in frame.bins.bands().zip(&frame.bins.count).zip(white) {
        for k in 0..POINTS {
            let omega = band[0] + (band[1] - band[0]) * (k as f64 + 0.5) / POINTS as f64;
            let half = (0.5 * omega).sin().max(1e-300);
            let response = ((0.5 * m * omega).sin() / (m * half)).powi(2);
            let power = s * count / n / POINTS as f64 * response;
            sums[0] += power;
            sums[1] += power * (m * omega).cos();
        }
    }
    sums
}

/// Largest correlation of neighbouring means that count as white.
const IN_COMMON: f64 = 0.1;

/// Smallest power of two of samples over which the means of noise with the spectrum `white` are white.
fn whitening(frame: &SpectralBasis, white: &[f64]) -> usize {
    let most = (frame.len() / 256).max(1);
    let mut per = 1;
    while 2 * per <= most {
        let [variance, covariance] = mean_noise(frame, white, per);
        if covariance.abs() < IN_COMMON * variance {
            break;
        }
        per *= 2;
    }
    per
}

/// Where the search for a path starts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    /// Distance of the levels, rad/s
    pub spacing_rad_s: f64,
    /// Mean time at a level, s
    pub mean_dwell_s: f64,
    /// Whether single samples are quantized too coarsely to be normal
    pub coarse: bool,
}

/// Telegraph noise beside `base`. `whole` is `base` with a noise in the place of the telegraph noise; the search starts
/// from its remainder, at `start`.
pub(crate) fn beside(
    frame: &SpectralBasis,
    data: &Data,
    candidates: &[Candidate],
    nuisance: &[(ColumnId, f64)],
    base: &Hypothesis,
    whole: &Hypothesis,
    start: Start,
) -> Option<TelegraphFit> {
    let n = frame.len();
    let dwell = start.mean_dwell_s / frame.scene.step_s;
    let white = base.white_spectrum(frame, candidates);
    // a mean that holds a jump fits neither level: it costs a mean of (spacing/σ)²/24, a sixth of a nat at most
    let jump_seen = (2.0 * mean_noise(frame, &white, 1)[0].sqrt() / start.spacing_rad_s).powi(2);
    let per = if start.coarse { dwell / 20.0 } else { (dwell / 20.0).min(jump_seen) };
    let per = (per as usize).clamp(1, 64).max(whitening(frame, &white));
    let std = mean_noise(frame, &white, per)[0].sqrt();
    let decimated = |b: &[f64]| -> Vec<f64> {
        let chunks = data.values_rad_s.chunks_exact(per).zip(b.chunks_exact(per));
        chunks.map(|(y, b)| y.iter().zip(b).map(|(y, b)| y - b).sum::<f64>() / per as f64).collect()
    };
    let first = Likelihood::new(frame, data, candidates, nuisance);
    // the start takes out only nuisances and signals: what a noise follows may be the path itself
    let remainder = first.remainder(whole);
    let z: Vec<f64> = data.z.iter().zip(&remainder).map(|(a, b)| a - b).collect();
    let mut x = decimated(&frame.series(&z));
    let mut chain = fit(&x, std, start.spacing_rad_s, dwell / per as f64, 30);
    let mut fitted = None;
    let mut path = Vec::new();
    for _ in 0..3 {
        let mean = chain.high.iter().sum::<f64>() / chain.high.len().max(1) as f64;
        path = (0..n)
            .map(|i| chain.spacing * (chain.high.get(i / per).copied().unwrap_or(mean) - mean))
            .collect::<Vec<f64>>();
        let left: Vec<f64> = data.values_rad_s.iter().zip(&path).map(|(y, p)| y - p).collect();
        let rest = frame.data_undithered(left);
        let likelihood = Likelihood::new(frame, &rest, candidates, nuisance);
        let found = likelihood.fit(base);
        x = decimated(&baseline(&likelihood, &found.hypothesis));
        chain = fit(&x, std, chain.spacing, 0.5 * (chain.dwell_low + chain.dwell_high), 12);
        fitted = Some(found);
    }
    let fitted = fitted?;
    let white = |residual: f64| -0.5 * ((residual / std).powi(2) + (TAU * std * std).ln());
    // at the end the chain is improved with the Gaussian part held fixed
    let (improved, ln_chain) = two_levels::evidence(&x, std, &chain);
    let mean_path: f64 = x.iter().zip(&chain.high).map(|(x, h)| white(x - chain.low - chain.spacing * h)).sum();
    chain = improved;
    let ln_evidence = fitted.ln_evidence + ln_chain - mean_path;
    let step_s = per as f64 * frame.scene.step_s;
    chain.dwell_low *= per as f64;
    chain.dwell_high *= per as f64;
    Some(TelegraphFit { fitted, ln_evidence, chain, path, ln_chain, series: x, std, step_s })
}
