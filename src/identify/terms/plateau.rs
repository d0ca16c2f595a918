//! The sensor's low-pass, its vibrations and N of the plateau below them, for a fit that asks for no other term
//!
//! The mean square of the residuals is that of the samples, and successive differences see their neighbours: behind a low-pass
//! both are less than the plateau, beside a vibration more. Where a part of the residuals is coloured, its spectrum says.

use super::kept::Evidence;
use super::model::{Likelihood, Model};
use super::observed::{Column, EvenLog, FEWEST};
use super::select::candidate;
use super::shape::Shape;
use super::shape_search::found;
use super::shaped::shaped;
use super::term::{TermEstimate, ordered};
use super::views::Views;
use crate::identify::types::Fit;
use crate::noise::TermKind;
use crate::signal::{Reduced, TimeAxis};

/// Samples that are looked at for colour, ...
const WINDOW: usize = 1 << 16;
/// ... and where there is some: N is then known to a part in 800.
const LONGEST: usize = 1 << 18;
/// Semivariances of white noise at lags from one to this are alike ...
const LAGS: usize = 8;
/// ... to so many standard deviations, each of them known to √(3/n) of itself at most.
const ALIKE: f64 = 4.0;

/// Whether `values` are coloured between one sample and the next few.
fn coloured(values: &[f64]) -> bool {
    let semivariance = |lag: usize| -> f64 {
        let pairs = values.iter().zip(&values[lag..]);
        0.5 * pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / (values.len() - lag) as f64
    };
    let first = semivariance(1);
    let bound = ALIKE * (3.0 / values.len() as f64).sqrt();
    (2..=LAGS).any(|lag| (semivariance(lag) / first - 1.0).abs() > bound)
}

/// N of the plateau, rad/s/√Hz, and what colours the noise above it.
pub(in crate::identify) struct Plateau {
    pub angle_random_walk_rad_sqrt_s: f64,
    pub colour: Vec<TermEstimate>,
}

/// The plateau in the last samples of a log; `None` where neither a low-pass nor a band shows there.
pub(in crate::identify) fn plateau(time: &TimeAxis, values: &[f64], fit: &Fit) -> Option<Plateau> {
    let model = fit.model();
    let left =
        |from: usize| -> Vec<f64> { (from..values.len()).map(|i| values[i] - model.error_rad_s(time.at(i))).collect() };
    let looked_at = left(values.len().saturating_sub(WINDOW));
    if looked_at.len() < FEWEST || !coloured(&looked_at) {
        return None;
    }
    let from = values.len().saturating_sub(LONGEST);
    let left = left(from);
    let times: Vec<f64> = (from..values.len()).map(|i| time.at(i)).collect();
    let log = EvenLog::new(&TimeAxis::Explicit(times), &left).ok()?;
    of(&Evidence::Whole(log))
}

/// The same of a log of which one pass kept raw stretches.
pub(in crate::identify) fn plateau_reduced(log: &Reduced, fit: &Fit) -> Option<Plateau> {
    let longest = log.stretches.iter().max_by_key(|s| s.values.len())?;
    let there: Vec<f64> = longest.values.iter().copied().filter(|v| v.is_finite()).collect();
    if there.len() < FEWEST || !coloured(&there) {
        return None;
    }
    of(&Evidence::of(log).ok()?.without(fit))
}

fn of(log: &Evidence) -> Option<Plateau> {
    // what the warm-up leaves is slow
    let ramp = || Column { at: Box::new(|t| t), changes_over_s: f64::INFINITY, std: None };
    let views = Views::new(log.observed(&[ramp(), ramp()]));
    let shape = found(&views, &TermKind::ALL).shape;
    if shape == Shape::default() {
        return None;
    }
    let base = [TermKind::AngleRandomWalk, TermKind::BiasInstability, TermKind::RateRandomWalk];
    let best = candidate(&views, &base, &shape)?;
    let likelihood = Likelihood::new(views.of(&best.kinds), Model::new(&best.kinds, &best.shape));
    let covariance = likelihood.covariance(&best.peak.point);
    let colour = ordered(shaped(&likelihood, &best, covariance.as_ref()));
    Some(Plateau { angle_random_walk_rad_sqrt_s: best.peak.x[0].exp(), colour })
}
