//! How long to record: the information on ln size as a function of the log's length
//!
//! I_ij = ½ Σ_k ∂_i ln S_k ∂_j ln S_k over the cosine coefficients of a log of that length, the lowest ones left out that the
//! warm-up's columns take.

use super::model::Model;
use crate::math::binned::Bins;
use crate::noise::TermKind;
use nalgebra::DMatrix;
use serde::Serialize;
use std::f64::consts::PI;

/// Half width of the 95 % interval that counts as known, relative to the size.
const WANTED: f64 = 0.20;
/// Longer logs than so many times this one are no advice.
const LONGEST: f64 = 1e4;

/// Length of the log that would give the size of a term to a wanted precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RecordingAdvice {
    /// The size that is assumed, SI: the estimate, or the upper bound where there is none.
    pub if_size: f64,
    /// Half width of the 95 % interval that is wanted, relative to the size.
    pub wanted_relative: f64,
    /// Length of the log that knows the size so well, s; `None` where none up to 10 000 times this one does.
    pub length_s: Option<f64>,
    /// How much longer than this log that is, s.
    pub longer_by_s: Option<f64>,
}

/// Standard deviation of ln size of `kind` in a log of `len` samples, terms as in `model` at `x`.
fn relative_std(model: &Model, x: &[f64], kind: TermKind, len: usize, step_s: f64, columns: usize) -> f64 {
    let Some(target) = model.place(kind) else { return f64::INFINITY };
    let bins = Bins::new(len, len.min(2048));
    let first = 1 + columns;
    let kept: Vec<usize> = (0..bins.len()).filter(|b| bins.edges[*b] >= first).collect();
    let k: Vec<f64> = kept.iter().map(|b| bins.omega[*b] * len as f64 / PI).collect();
    let omega: Vec<f64> = kept.iter().map(|b| bins.omega[*b]).collect();
    let (spectrum, slopes) =
        model.spectrum(x, step_s, &omega, |_, kind, ln_time| kind.cosine_variances(&k, len, step_s, ln_time.exp()));
    let d = x.len();
    let information = DMatrix::from_fn(d, d, |i, j| {
        let term = |(n, b): (usize, &usize)| bins.count[*b] * slopes[i][n] * slopes[j][n] / spectrum[n].powi(2);
        0.5 * kept.iter().enumerate().map(term).sum::<f64>() + if i == j { 1e-12 } else { 0.0 }
    });
    information.cholesky().map_or(f64::INFINITY, |c| c.inverse()[(target, target)].sqrt())
}

/// How long to record for `kind` to ±20 %; the recorded log has `len` samples.
pub(super) fn advise(
    model: &Model,
    x: &[f64],
    kind: TermKind,
    len: usize,
    step_s: f64,
    columns: usize,
) -> RecordingAdvice {
    let if_size = model.place(kind).map_or(f64::NAN, |i| x[i].exp());
    let width = |samples: f64| 1.96 * relative_std(model, x, kind, samples.round() as usize, step_s, columns);
    let (mut low, mut high) = (0.0, len as f64);
    while width(high) > WANTED && high < LONGEST * len as f64 {
        low = high;
        high *= 1.5;
    }
    let length_s = (high < LONGEST * len as f64).then(|| {
        if low > 0.0 {
            for _ in 0..12 {
                let middle = 0.5 * (low + high);
                if width(middle) > WANTED {
                    low = middle;
                } else {
                    high = middle;
                }
            }
        }
        high * step_s
    });
    let longer_by_s = length_s.map(|l| (l - len as f64 * step_s).max(0.0));
    RecordingAdvice { if_size, wanted_relative: WANTED, length_s, longer_by_s }
}
