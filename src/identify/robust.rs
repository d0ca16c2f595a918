//! Huber's loss by modified residuals: y is replaced by f + ψ(r)/mean ψ', refitted, and so on.
//!
//! Huber and Ronchetti, Robust Statistics (2009), 7.8. At the end least squares on the replaced samples has the
//! robust estimate as its solution and (7.7) its covariance, so intervals and tests need nothing new.

use crate::bias::WarmUp;
use crate::math::robust::mad_std;
use crate::signal::TimeAxis;

/// ψ is linear up to this many standard deviations: 95 % efficient on normal noise.
pub(super) const TUNING: f64 = 1.345;

/// Residuals of `model`, and their scale by the median absolute deviation.
pub(super) fn residuals(time: &TimeAxis, values: &[f64], model: &WarmUp) -> (Vec<f64>, f64) {
    let r: Vec<f64> = values.iter().enumerate().map(|(i, y)| y - model.error_rad_s(time.at(i))).collect();
    let scale = mad_std(&mut r.clone(), 0.0);
    (r, scale)
}

/// The replaced samples for residuals `r` of scale `scale`.
pub(super) fn replaced(time: &TimeAxis, model: &WarmUp, r: &[f64], scale: f64) -> Vec<f64> {
    let bound = TUNING * scale;
    let inside = r.iter().filter(|x| x.abs() <= bound).count().max(1) as f64 / r.len() as f64;
    r.iter().enumerate().map(|(i, r)| model.error_rad_s(time.at(i)) + r.clamp(-bound, bound) / inside).collect()
}
