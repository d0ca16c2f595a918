//! ln p(z | terms) = ln p(z, mode) + ½ d ln 2π - ½ ln det H - Σ ln w: which terms a log supports
//!
//! By Laplace's method. A size is as probable in one decade as in another from what changes nothing to what drowns
//! everything (w, the width of that range in its logarithm), and so is a correlation time. A ramp, whose coefficient β is
//! integrated out with its covariance s², has the density 1/(2|β| w). Each term beside N is there with probability 0.13:
//! then nothing but white noise has one half. `bic` is there for those who expect it: it takes every coefficient for an
//! equal witness of every term, which a random walk, known from the lowest few alone, contradicts.

use super::interval::DROP;
use super::model::{Likelihood, Model, Peak};
use super::shape::Shape;
use super::views::Views;
use crate::noise::TermKind;
use std::f64::consts::TAU;

/// ln of the odds of a term before the log was seen: five of them are all absent with probability one half.
pub(super) const LN_ODDS: f64 = -1.908;

/// A set of terms at its mode.
pub(super) struct Candidate {
    pub kinds: Vec<TermKind>,
    pub shape: Shape,
    pub peak: Peak,
    /// ln of evidence times prior.
    pub ln_evidence: f64,
    pub bic: f64,
}

impl Candidate {
    /// Its shape, which begins where this mode is.
    pub(crate) fn shape_at_mode(&self) -> Shape {
        let start = self.peak.x[self.peak.x.len() - self.shape.parameters()..].to_vec();
        Shape { start, ..self.shape.clone() }
    }
}

/// The set `kinds` with `shape` at its mode. `None` if there is none, or if the mode says that it is another set: a
/// correlation time, a cutoff, a centre or a width at the end of its range.
pub(super) fn candidate(views: &Views, kinds: &[TermKind], shape: &Shape) -> Option<Candidate> {
    let log = views.of(kinds);
    let likelihood = Likelihood::new(log, Model::new(kinds, shape));
    let peak = likelihood.mode()?;
    let base = likelihood.model.base();
    let at_end = |i: usize| {
        let [low, high] = likelihood.bounds[i];
        peak.x[i] <= low + 1e-6 || peak.x[i] >= high - 1e-6
    };
    if (0..shape.parameters()).any(|i| !shape.is_size(i) && at_end(base + i)) {
        return None;
    }
    if likelihood.model.place(TermKind::GaussMarkov).is_some_and(|at| at_end(at + 1)) {
        return None;
    }
    let curvature = likelihood.curvature(&peak.point);
    let d = peak.x.len() as f64;
    let ln_det = 2.0 * curvature.cholesky()?.l().diagonal().iter().map(|v| v.ln()).sum::<f64>();
    let widths: f64 = likelihood.bounds.iter().map(|b| (b[1] - b[0]).ln()).sum();
    let mut ln_evidence = peak.point.value + 0.5 * (d * TAU.ln() - ln_det) - widths;
    let mut bic = -2.0 * peak.point.value;
    if kinds.contains(&TermKind::RateRamp) {
        let j = log.columns() - 1;
        let [slope, std] = views.slope(&peak);
        let [low, high] = log.range(TermKind::RateRamp);
        let density = 1.0 / (2.0 * slope.abs().max(std).max(low) * (high / low).ln());
        // the marginal likelihood holds a normal prior of the coefficient, flat here at 1/(√2π prior_std)
        ln_evidence += (TAU.sqrt() * log.prior_std[j] / log.column_rms[j] * density).ln();
        // and the maximum over the slope is √2π std above the mean over it
        bic -= 2.0 * (log.prior_std[j] / log.column_rms[j] / std).ln();
    }
    let optional = kinds.iter().filter(|k| **k != TermKind::AngleRandomWalk).count() + shape.kinds().count();
    ln_evidence += optional as f64 * LN_ODDS + shape.ln_prior();
    let coefficients: f64 = log.count.iter().sum();
    bic += (d + f64::from(u8::from(kinds.contains(&TermKind::RateRamp)))) * coefficients.ln();
    Some(Candidate { kinds: kinds.to_vec(), shape: shape.clone(), peak, ln_evidence, bic })
}

/// All sets of the terms in `among` beside N and `shape`, the most probable first.
pub(super) fn candidates(views: &Views, among: &[TermKind], shape: &Shape) -> Vec<Candidate> {
    let chosen = |k: &TermKind| *k != TermKind::AngleRandomWalk && !k.shapes();
    let optional: Vec<TermKind> = among.iter().copied().filter(chosen).collect();
    let sets = (0..1usize << optional.len()).map(|bits| {
        let chosen = (0..optional.len()).filter(|i| bits >> i & 1 == 1).map(|i| optional[i]);
        let mut kinds: Vec<TermKind> = std::iter::once(TermKind::AngleRandomWalk).chain(chosen).collect();
        kinds.sort_unstable();
        kinds
    });
    let all: Vec<Candidate> = sets.filter_map(|kinds| candidate(views, &kinds, shape)).collect();
    // a random walk is the limit of long correlation times: where it fits as well, the log knows no correlation time
    let is_limit = |c: &Candidate| {
        let walk = |k: &TermKind| if *k == TermKind::GaussMarkov { TermKind::RateRandomWalk } else { *k };
        let mut other: Vec<TermKind> = c.kinds.iter().map(walk).collect();
        other.sort_unstable();
        c.kinds.contains(&TermKind::GaussMarkov)
            && all.iter().any(|o| o.kinds == other && o.peak.point.value > c.peak.point.value - DROP)
    };
    let kept: Vec<bool> = all.iter().map(|c| !is_limit(c)).collect();
    let mut all: Vec<Candidate> = all.into_iter().zip(kept).filter_map(|(c, kept)| kept.then_some(c)).collect();
    all.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
    all
}

/// Probability of each term, and of each set in the order given.
pub(super) fn probabilities(all: &[Candidate]) -> Vec<f64> {
    let top = all.iter().map(|c| c.ln_evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = all.iter().map(|c| (c.ln_evidence - top).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}
