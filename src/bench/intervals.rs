//! rate = right / asked with Wilson's interval;  ECE = Σ_bins |Σ confidence - right| / cases;  ROC and its area
//!
//! ECE: Naeini et al., AAAI 2015, ten equal bins.

use crate::math::NORMAL_975;
use crate::math::distributions::wilson95;
use crate::math::random::Stream;
use crate::math::robust::quantile;
use serde::Serialize;

/// A rate with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Rate {
    /// Number of right answers.
    pub right: usize,
    /// Number of cases.
    pub of: usize,
    /// Their ratio; none where nothing was asked.
    pub rate: Option<f64>,
    /// Wilson's 95 % interval of it.
    pub ci95: Option<[f64; 2]>,
}

impl Rate {
    /// The rate of `right` in `of`.
    #[must_use]
    pub(crate) fn new(right: usize, of: usize) -> Self {
        let ci95 = wilson95(right, of);
        Self { right, of, rate: ci95.map(|_| right as f64 / of as f64), ci95 }
    }

    /// The rate of true values.
    pub(crate) fn count(all: impl IntoIterator<Item = bool>) -> Self {
        let (mut right, mut of) = (0, 0);
        for one in all {
            of += 1;
            right += usize::from(one);
        }
        Self::new(right, of)
    }
}

/// Bins of the confidence.
pub(super) const BINS: usize = 10;

/// The bin of a confidence.
pub(super) fn bin(confidence: f64) -> usize {
    ((confidence * BINS as f64).max(0.0) as usize).min(BINS - 1)
}

/// Expected calibration error of (confidence, right); NaN without cases.
#[must_use]
pub(crate) fn expected_calibration_error(judged: &[(f64, bool)]) -> f64 {
    let mut bins = [0.0; BINS];
    for (confidence, right) in judged {
        bins[bin(*confidence)] += confidence - f64::from(u8::from(*right));
    }
    bins.iter().map(|b| b.abs()).sum::<f64>() / judged.len() as f64
}

/// Simulated benches for [`perfect_calibration_p95`].
const BENCHES: usize = 2000;

/// 95th percentile of the ECE that a perfectly calibrated method scores with these confidences, by simulation.
#[must_use]
pub(crate) fn perfect_calibration_p95(confidences: &[f64], seed: u64) -> f64 {
    if confidences.is_empty() {
        return f64::NAN;
    }
    let mut s = Stream::new(seed, 0);
    let mut errors: Vec<f64> = (0..BENCHES)
        .map(|_| {
            let drawn: Vec<(f64, bool)> = confidences.iter().map(|c| (*c, s.uniform() < *c)).collect();
            expected_calibration_error(&drawn)
        })
        .collect();
    crate::math::robust::quantile(&mut errors, 0.95)
}

/// How well a score tells positives from negatives.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Roc {
    /// False and true positive rate at each threshold, from (0, 0) to (1, 1).
    pub points: Vec<[f64; 2]>,
    /// Area under it: the probability that a positive scores above a negative, ties half.
    pub area: f64,
    /// Its 95 % interval (Hanley and McNeil, Radiology 143 (1982) 29).
    pub area_ci95: [f64; 2],
}

/// The ROC of (score, positive); none unless there are both positives and negatives.
#[must_use]
pub(crate) fn roc(scored: &[(f64, bool)]) -> Option<Roc> {
    let positives = scored.iter().filter(|s| s.1).count() as f64;
    let negatives = scored.len() as f64 - positives;
    if positives == 0.0 || negatives == 0.0 {
        return None;
    }
    let mut sorted = scored.to_vec();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut points, mut hits, mut alarms, mut area) = (vec![[0.0, 0.0]], 0.0, 0.0, 0.0);
    for tied in sorted.chunk_by(|a, b| a.0 == b.0) {
        let [x, y] = [alarms, hits];
        hits += tied.iter().filter(|s| s.1).count() as f64;
        alarms += tied.iter().filter(|s| !s.1).count() as f64;
        area += (alarms - x) * 0.5 * (hits + y);
        points.push([alarms / negatives, hits / positives]);
    }
    let a = area / (positives * negatives);
    let (q1, q2) = (a / (2.0 - a), 2.0 * a * a / (1.0 + a));
    let variance =
        (a * (1.0 - a) + (positives - 1.0) * (q1 - a * a) + (negatives - 1.0) * (q2 - a * a)) / (positives * negatives);
    let half = NORMAL_975 * variance.max(0.0).sqrt();
    Some(Roc { points, area: a, area_ci95: [(a - half).max(0.0), (a + half).min(1.0)] })
}

/// Median and quartiles of a set of values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Middle {
    /// Median.
    pub median: f64,
    /// Lower and upper quartile.
    pub quartiles: [f64; 2],
    /// Number of values.
    pub of: usize,
}

impl Middle {
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut v: Vec<f64> = values.into_iter().collect();
        let of = v.len();
        (of > 0).then(|| Self {
            median: quantile(&mut v, 0.5),
            quartiles: [quantile(&mut v, 0.25), quantile(&mut v, 0.75)],
            of,
        })
    }
}
