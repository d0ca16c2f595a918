//! min (ν̂ - ν(θ))ᵀ Ω (ν̂ - ν(θ)): generalised method of wavelet moments
//!
//! ν̂ are overlapping Allan variances at octaves (twice the Haar wavelet variances), ν(θ) those that the terms give the
//! samples, Ω the inverse of their covariance: 2/M ∫ S² |H_i|² |H_j|² df (Percival and Walden, *Wavelet Methods for Time
//! Series Analysis*, 2000, 8.3). At the minimum the criterion is χ² with as many degrees of freedom as there are more
//! moments than parameters. Guerrier, Skaloud, Stebler and Victoria-Feser, J. American Statistical Association 108 (2013) 1021.

use super::observed::EvenLog;
use super::term::{TermEstimate, estimate_of_ln};
use crate::noise::{Deviation, TermKind, allan};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;

/// The longest averaging time is this part of the log: beyond it a moment is known to half of itself.
const LONGEST_PART: usize = 8;
/// Nodes of the integral over frequency.
const NODES: usize = 3000;
const NORMAL: f64 = crate::math::NORMAL_975;

/// Estimate from the wavelet moments.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WaveletFit {
    /// The terms that were asked for.
    pub terms: Vec<TermEstimate>,
    /// Moments used.
    pub moments: usize,
    /// The criterion at its minimum.
    pub criterion: f64,
    /// Probability of a larger one if the terms are right; NaN without a moment to spare.
    pub p_value: f64,
}

/// Parameters: ln of each size, and after a Gauss-Markov size ln of its correlation time.
struct Moments<'a> {
    kinds: &'a [TermKind],
    averaged: Vec<usize>,
    variances: Vec<f64>,
    step_s: f64,
    samples: usize,
    /// Unit variances of the kinds that have no correlation time.
    units: Vec<Vec<f64>>,
}

impl Moments<'_> {
    fn places(&self) -> Vec<usize> {
        let mut next = 0;
        let place = |k: &TermKind| {
            let at = next;
            next += 1 + usize::from(*k == TermKind::GaussMarkov);
            at
        };
        self.kinds.iter().map(place).collect()
    }

    fn unit(&self, i: usize, time_s: f64) -> Vec<f64> {
        match self.kinds[i] {
            TermKind::GaussMarkov => {
                let at = |m: &usize| TermKind::GaussMarkov.sampled_allan_variance(*m, self.step_s, time_s);
                self.averaged.iter().map(at).collect()
            }
            _ => self.units[i].clone(),
        }
    }

    /// ν(θ) and its derivatives.
    fn at(&self, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.averaged.len();
        let (mut value, mut slopes) = (DVector::zeros(n), DMatrix::zeros(n, x.len()));
        for (i, at) in self.places().into_iter().enumerate() {
            let square = (2.0 * x[at]).exp();
            let time = |h: f64| if self.kinds[i] == TermKind::GaussMarkov { (x[at + 1] + h).exp() } else { 0.0 };
            let unit = self.unit(i, time(0.0));
            for (row, u) in unit.iter().enumerate() {
                value[row] += square * u;
                slopes[(row, at)] = 2.0 * square * u;
            }
            if self.kinds[i] == TermKind::GaussMarkov {
                let h = 1e-4;
                let (up, down) = (self.unit(i, time(h)), self.unit(i, time(-h)));
                (0..n).for_each(|row| slopes[(row, at + 1)] = square * (up[row] - down[row]) / (2.0 * h));
            }
        }
        (value, slopes)
    }

    /// Covariance of the moments under the terms at `x`.
    fn covariance(&self, x: &DVector<f64>) -> DMatrix<f64> {
        let n = self.averaged.len();
        let mut out = DMatrix::zeros(n, n);
        // even in ln ω from below the longest averaging time to Nyquist
        let low = 1e-3 * PI / self.averaged.last().copied().unwrap_or(1) as f64;
        let step = (PI / low).ln() / NODES as f64;
        for node in 0..NODES {
            let omega = low * ((node as f64 + 0.5) * step).exp();
            let mut spectrum = 0.0;
            for (i, at) in self.places().into_iter().enumerate() {
                let time = if self.kinds[i] == TermKind::GaussMarkov { x[at + 1].exp() } else { 0.0 };
                spectrum += (2.0 * x[at]).exp() * sampled_spectrum(self.kinds[i], omega, self.step_s, time);
            }
            let gain = |m: usize| {
                let n = m as f64;
                2.0 * (0.5 * n * omega).sin().powi(4) / (n * (0.5 * omega).sin()).powi(2)
            };
            let power: Vec<f64> = self.averaged.iter().map(|m| spectrum * gain(*m)).collect();
            for i in 0..n {
                for j in 0..=i {
                    out[(i, j)] += power[i] * power[j] * omega * step / PI;
                }
            }
        }
        // of two series of differences the geometric mean of their lengths: so scaled a covariance stays one
        let differences = |i: usize| (self.samples + 1).saturating_sub(2 * self.averaged[i]).max(1) as f64;
        for i in 0..n {
            for j in 0..=i {
                out[(i, j)] *= 2.0 / (differences(i) * differences(j)).sqrt();
                out[(j, i)] = out[(i, j)];
            }
        }
        out
    }

    /// The minimum from `start` under the weight `omega`, by damped Gauss-Newton.
    fn minimum(&self, start: &DVector<f64>, omega: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
        let observed = DVector::from_column_slice(&self.variances);
        let cost = |x: &DVector<f64>| {
            let r = &observed - self.at(x).0;
            (r.transpose() * omega * &r)[(0, 0)]
        };
        let (mut x, mut best, mut damping) = (start.clone(), cost(start), 1e-3);
        for _ in 0..100 {
            let (value, slopes) = self.at(&x);
            let (normal, right) =
                (slopes.transpose() * omega * &slopes, slopes.transpose() * omega * (&observed - value));
            let mut gained = false;
            for _ in 0..10 {
                let mut damped = normal.clone();
                (0..x.len()).for_each(|i| damped[(i, i)] = damped[(i, i)] * (1.0 + damping) + f64::MIN_POSITIVE);
                let next = damped.cholesky().map(|c| &x + c.solve(&right).map(|v| v.clamp(-1.0, 1.0)));
                if let Some(next) = next {
                    let there = cost(&next);
                    if there < best {
                        gained = best - there > 1e-10 * best;
                        (x, best, damping) = (next, there, damping * 0.2);
                        break;
                    }
                }
                damping = (damping * 8.0).max(1e-3);
            }
            if !gained {
                break;
            }
        }
        best.is_finite().then_some((x, best))
    }
}

/// Variance per sample and angular frequency of the samples of a term of unit size.
fn sampled_spectrum(kind: TermKind, omega: f64, step_s: f64, time_s: f64) -> f64 {
    match kind {
        // by its moments alone: a ramp has no spectrum, and adds nothing to their covariance
        TermKind::RateRamp => 0.0,
        // the coefficients of an endless series
        _ => {
            const LONG: usize = 1 << 40;
            kind.cosine_variances(&[omega * LONG as f64 / PI], LONG, step_s, time_s)[0]
        }
    }
}

/// The terms of `kinds` by the Allan variances of `log`, from `start` (sizes and, for Gauss-Markov, correlation time).
/// `None` where there are fewer moments than parameters, or no minimum.
pub(super) fn wavelet_fit(log: &EvenLog, kinds: &[TermKind], start: &[(f64, Option<f64>)]) -> Option<WaveletFit> {
    let averaged = allan::octaves(log.values.len() / LONGEST_PART);
    let points = allan::deviations(&log.values, log.step_s, &averaged, Deviation::Overlapping);
    let unit = |kind: &TermKind| match kind {
        TermKind::GaussMarkov => Vec::new(),
        _ => averaged.iter().map(|m| kind.sampled_allan_variance(*m, log.step_s, 0.0)).collect(),
    };
    let moments = Moments {
        kinds,
        variances: points.iter().map(|p| p.deviation_rad_s.powi(2)).collect(),
        step_s: log.step_s,
        samples: log.values.len(),
        units: kinds.iter().map(unit).collect(),
        averaged: averaged.clone(),
    };
    let x0: Vec<f64> =
        start.iter().flat_map(|(size, time)| std::iter::once(size.ln()).chain(time.map(f64::ln))).collect();
    let mut x = DVector::from_vec(x0);
    if moments.variances.len() < x.len() {
        return None;
    }
    // relative weights first, then the covariance that the terms found give the moments, twice
    let mut omega = DMatrix::from_diagonal(&DVector::from_iterator(
        points.len(),
        points.iter().map(|p| p.degrees_of_freedom / p.deviation_rad_s.powi(4)),
    ));
    let mut criterion = f64::NAN;
    for round in 0..3 {
        (x, criterion) = moments.minimum(&x, &omega)?;
        if round < 2 {
            omega = inverse(&moments.covariance(&x))?;
        }
    }
    let slopes = moments.at(&x).1;
    let covariance = inverse(&(slopes.transpose() * &omega * &slopes))?;
    let terms = kinds.iter().zip(moments.places()).map(|(kind, at)| {
        let std = covariance[(at, at)].sqrt();
        let ends = |i: usize, s: f64| [(x[i] - NORMAL * s).exp(), (x[i] + NORMAL * s).exp()];
        let time = (*kind == TermKind::GaussMarkov).then(|| {
            let s = covariance[(at + 1, at + 1)].sqrt();
            estimate_of_ln(x[at + 1].exp(), s, ends(at + 1, s))
        });
        TermEstimate::new(*kind, x[at].exp(), x[at].exp() * std, ends(at, std), time)
    });
    let spare = moments.variances.len().saturating_sub(x.len());
    let p_value = match ChiSquared::new(spare as f64) {
        Ok(chi) if spare > 0 => chi.sf(criterion),
        _ => f64::NAN,
    };
    Some(WaveletFit { terms: terms.collect(), moments: averaged.len(), criterion, p_value })
}

/// Inverse of a symmetric positive definite matrix, scaled to unit diagonal first.
fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    crate::identify::noise::inverse(m)
}
