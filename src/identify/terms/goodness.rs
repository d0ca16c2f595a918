//! D = Σ n (r - 1 - ln r), r the power left in a band over what the model expects there: does the model fit the log?
//!
//! Where bands of vibration make more than a hundredth of the power nothing is judged: the form of their line is no property of
//! the gyro, and a hundredth is what even a form that is quite wrong would leave there.
//!
//! Its distribution is found from logs drawn from the fitted model, each fitted anew, so that the p value is uniform
//! under the model, whatever the number of parameters and however few coefficients the lowest band has.

use super::model::{Likelihood, Point, share_of_bands};
use super::observed::Observed;
use crate::math::random::Stream;
use rayon::prelude::*;
use serde::Serialize;

/// Bands are at least so wide ...
const RATIO: f64 = 1.26;
/// ... and hold so many coefficients.
const FEWEST: f64 = 8.0;

/// Power in a band of frequencies, over what the model expects there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// Lowest frequency, Hz.
    pub from_hz: f64,
    /// Highest frequency, Hz.
    pub to_hz: f64,
    /// Coefficients in it.
    pub coefficients: f64,
    /// Power over the model's: 1 ± √(2/coefficients).
    pub ratio: f64,
}

impl Band {
    /// Its share of the statistic.
    #[must_use]
    pub(crate) fn deviance(&self) -> f64 {
        if self.ratio > 0.0 { self.coefficients * (self.ratio - 1.0 - self.ratio.ln()) } else { f64::INFINITY }
    }
}

/// Whether the model fits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Goodness {
    /// Probability of a worse fit of a log that follows the model.
    pub p_value: f64,
    /// Logs that were drawn for it.
    pub draws: usize,
    /// The statistic.
    pub deviance: f64,
    /// The bands.
    pub bands: Vec<Band>,
    /// From and to where vibration hides the gyro, Hz: nothing was judged there.
    pub not_judged_hz: Vec<[f64; 2]>,
}

/// Share of the power from which on a vibration hides the gyro.
const HIDES: f64 = 0.01;

impl Goodness {
    /// The band that fits worst.
    #[must_use]
    pub fn worst(&self) -> Option<&Band> {
        self.bands.iter().max_by(|a, b| a.deviance().total_cmp(&b.deviance()))
    }
}

fn bands(log: &Observed, point: &Point, judged: &[bool]) -> Vec<Band> {
    let mut out: Vec<Band> = Vec::new();
    let (mut first, mut count, mut sum) = (0, 0.0, 0.0);
    let last = (0..log.k.len()).rev().find(|b| log.count[*b] > 0.0 && judged[*b]).unwrap_or(0);
    for (bin, judged) in judged.iter().enumerate().take(last + 1) {
        if *judged {
            count += log.count[bin];
            sum += point.left[bin] / point.spectrum[bin];
        }
        let wide = log.k[bin] > RATIO * log.k[first] && count >= FEWEST;
        if wide || bin == last {
            let [from_hz, to_hz] = [first, bin].map(|b| log.frequency_hz(b));
            out.push(Band { from_hz, to_hz, coefficients: count, ratio: sum / count.max(1.0) });
            (first, count, sum) = (bin + 1, 0.0, 0.0);
        }
    }
    // what is too little for a band of its own belongs to the one before
    if out.len() > 1 && out[out.len() - 1].coefficients < FEWEST {
        let rest = out.remove(out.len() - 1);
        if let Some(before) = out.last_mut() {
            let all = before.coefficients + rest.coefficients;
            before.ratio = (before.ratio * before.coefficients + rest.ratio * rest.coefficients) / all;
            (before.coefficients, before.to_hz) = (all, rest.to_hz);
        }
    }
    out
}

/// Ranges of frequency that are not judged, Hz.
fn hidden(log: &Observed, judged: &[bool]) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    for bin in (0..judged.len()).filter(|b| !judged[*b]) {
        let [from, to] = [-0.5, 0.5].map(|h| log.frequency_hz(bin) + h * log.bin_width_hz(bin));
        match out.last_mut() {
            Some(last) if bin > 0 && !judged[bin - 1] => last[1] = to,
            _ => out.push([from, to]),
        }
    }
    out
}

/// How well the model at its mode `x` fits, by `draws` drawn logs.
pub(super) fn goodness(likelihood: &Likelihood, x: &[f64], point: &Point, draws: usize, seed: u64) -> Goodness {
    let shares = share_of_bands(&likelihood.model, x, likelihood.log, &point.spectrum);
    let judged: Vec<bool> = shares.iter().map(|s| *s < HIDES).collect();
    let observed = bands(likelihood.log, point, &judged);
    let deviance: f64 = observed.iter().map(Band::deviance).sum();
    let free = vec![true; x.len()];
    let worse: usize = (0..draws)
        .into_par_iter()
        .filter(|i| {
            let log = likelihood.log.drawn(&point.spectrum, &mut Stream::new(seed, *i as u64));
            let Some(peak) = Likelihood::new(&log, likelihood.model.clone()).climb(x, &free) else { return false };
            bands(&log, &peak.point, &judged).iter().map(Band::deviance).sum::<f64>() >= deviance
        })
        .count();
    let not_judged_hz = hidden(likelihood.log, &judged);
    Goodness { p_value: (worse + 1) as f64 / (draws + 1) as f64, draws, deviance, bands: observed, not_judged_hz }
}
