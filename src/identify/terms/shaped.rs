//! Estimates of the shape near the sample rate: the low-pass and the bands at their mode, with intervals.

use super::interval;
use super::model::Likelihood;
use super::select::Candidate;
use super::term::{TermEstimate, estimate_of_ln};
use crate::noise::TermKind;
use nalgebra::DMatrix;

/// The low-pass and the bands at their mode, with intervals.
pub(super) fn shaped(
    likelihood: &Likelihood,
    best: &Candidate,
    covariance: Option<&DMatrix<f64>>,
) -> Vec<TermEstimate> {
    let peak = &best.peak;
    let std = |i: usize| covariance.map_or(f64::NAN, |c| c[(i, i)].sqrt());
    let of_ln = |i: usize| estimate_of_ln(peak.x[i].exp(), std(i), interval::interval(likelihood, peak, i, std(i)));
    let mut at = likelihood.model.base();
    let mut shapes = Vec::new();
    if let Some(form) = best.shape.low_pass {
        let cutoff = of_ln(at);
        let term = TermEstimate::new(TermKind::Bandwidth, cutoff.estimate, cutoff.std, cutoff.ci95, None);
        shapes.push(TermEstimate { low_pass: Some(form), ..term });
        at += 1;
    }
    for form in &best.shape.bands {
        let [center, width, size] = [at, at + 1, at + 2].map(of_ln);
        let term = TermEstimate::new(TermKind::NarrowBandNoise, size.estimate, size.std, size.ci95, None);
        shapes.push(TermEstimate { band: Some(*form), center_hz: Some(center), bandwidth_hz: Some(width), ..term });
        at += 3;
    }
    shapes
}
