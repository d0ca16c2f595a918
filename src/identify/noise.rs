//! y = X β + w + ε on block means: ε white with variance σ²/n, w a random walk with increments K² Δt.
//!
//! Under plain least squares the noise decides the covariance alone, (XᵀX)⁻¹ Xᵀ V X (XᵀX)⁻¹ (where a walk is likely
//! `weighted` estimates, too). V is not known: K has half its prior mass at zero and the rest spread evenly over
//! ln K, and the covariance is a mixture over K weighted by the restricted likelihood (Patterson and Thompson,
//! Biometrika 58 (1971) 545), exact by the Kalman filter of the local level model (Harvey 1989, 3.4).
//! Short-range correlation needs no term of its own: block means see it as a larger σ².

use super::projection::{BlockSum, Projection, Sums};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Groups of blocks that the likelihood looks at.
pub(super) const GROUPS: usize = 512;
/// Prior probability that the bias does not walk at all. A choice: it sets the width of the intervals in white noise against their
/// coverage under a walk too weak to see, and no rule has both (`examples/calibration/limit.rs`; evidence, "The intervals of
/// a fit"). Without it (0) the intervals of C1 are 1.6 to 2.8 times as wide in white noise.
const NO_WALK: f64 = 0.7;
/// Decades of K² between neighbours in the mixture.
const DECADES: f64 = 0.25;

/// One member of the mixture.
#[derive(Debug, Clone)]
pub(super) struct Member {
    /// Posterior weight; the weights sum to 1.
    pub weight: f64,
    /// White variance of one sample as the block means see it, rad²/s².
    pub white_variance: f64,
    /// K², rad²/s³.
    pub walk_variance_rate: f64,
    /// Covariance of the least-squares estimates of the free columns.
    pub covariance: DMatrix<f64>,
}

/// The fitted noise, with the covariance that each of its members gives the estimates.
#[derive(Debug, Clone)]
pub(super) struct NoiseFit {
    pub members: Vec<Member>,
    /// (XᵀX)⁻¹ over the samples: times σ² the classical covariance.
    pub inverse_normal: DMatrix<f64>,
    pub degrees_of_freedom: f64,
}

/// One column of the linearised model: its groups' sums, and its inner products over the samples come apart.
pub(super) struct Columns {
    /// Sum of each column over each group.
    pub groups: Vec<Vec<f64>>,
    /// XᵀX over the samples.
    pub normal: DMatrix<f64>,
}

/// The columns g, 1 and ∂f/∂T = -c1 d/T, as far as they are free.
pub(super) fn columns(p: &Projection, s: &Sums, groups: &[BlockSum], c1: f64, free_t: Option<f64>) -> Columns {
    let mut sums: Vec<Vec<f64>> = Vec::new();
    // index into the full normal matrix of g, 1, d
    let full = [[s.gg, s.g, s.gd], [s.g, s.n, s.d], [s.gd, s.d, s.dd]];
    let mut used: Vec<(usize, f64)> = Vec::new();
    let [free_c1, free_c2] = p.free();
    if free_c1 {
        sums.push(groups.iter().map(|b| b.g).collect());
        used.push((0, 1.0));
    }
    if free_c2 {
        sums.push(groups.iter().map(|b| b.n).collect());
        used.push((1, 1.0));
    }
    if let Some(time_constant) = free_t {
        let scale = -c1 / time_constant;
        sums.push(groups.iter().map(|b| scale * b.d).collect());
        used.push((2, scale));
    }
    let k = used.len();
    let normal = DMatrix::from_fn(k, k, |i, j| full[used[i].0][used[j].0] * used[i].1 * used[j].1);
    Columns { groups: sums, normal }
}

/// Inverse of a symmetric positive definite matrix, scaled to unit diagonal first. `None` if it is not.
pub(super) fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let k = m.nrows();
    let scale: Vec<f64> = (0..k).map(|i| m[(i, i)].sqrt()).collect();
    if scale.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    let unit = DMatrix::from_fn(k, k, |i, j| m[(i, j)] / (scale[i] * scale[j]));
    let inv = nalgebra::Cholesky::new(unit)?.inverse();
    Some(DMatrix::from_fn(k, k, |i, j| inv[(i, j)] / (scale[i] * scale[j])))
}

/// Whitened columns, ln det V and V's scale at one ratio K²/σ² (1/s, for one sample).
pub(super) struct Whitened {
    pub columns: Vec<Vec<f64>>,
    pub ln_det: f64,
}

/// Runs the filter of a random walk that is zero where the first group begins over each series of group means.
///
/// A group's mean sees the walk averaged: of n samples over a length h the mean less the level at the begin has variance
/// K² h (n+1)(2n+1)/6n² and covariance K² h (n+1)/2n with the rise to the end.
pub(super) fn whiten(groups: &[BlockSum], series: &[Vec<f64>], ratio: f64) -> Whitened {
    let mut level = vec![0.0; series.len()];
    let mut out: Vec<Vec<f64>> = series.iter().map(|s| Vec::with_capacity(s.len())).collect();
    let (mut variance, mut ln_det) = (0.0, 0.0);
    let mut end_s = groups.first().map_or(0.0, |g| g.begin_s);
    for (i, group) in groups.iter().enumerate() {
        let n = group.n;
        variance += ratio * (group.begin_s - end_s).max(0.0);
        end_s = group.end_s;
        let rise = ratio * (group.end_s - group.begin_s);
        let total = variance + rise * (n + 1.0) * (2.0 * n + 1.0) / (6.0 * n * n) + 1.0 / n;
        let with_end = variance + rise * (n + 1.0) / (2.0 * n);
        let gain = with_end / total;
        let scale = total.sqrt().recip();
        ln_det += total.ln();
        for ((level, series), out) in level.iter_mut().zip(series).zip(&mut out) {
            let innovation = series[i] - *level;
            out.push(innovation * scale);
            *level += gain * innovation;
        }
        variance = (variance + rise - gain * with_end).max(0.0);
    }
    Whitened { columns: out, ln_det }
}

/// Generalised least squares on whitened columns.
pub(super) struct Regression {
    pub rss: f64,
    pub coefficients: Vec<f64>,
    /// XᵀV⁻¹X and the logarithm of its determinant.
    pub normal: DMatrix<f64>,
    pub ln_det: f64,
}

/// Regresses the first of the whitened columns on the others. `None` where these cannot be told apart.
pub(super) fn regress(columns: &[Vec<f64>]) -> Option<Regression> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let (y, x) = columns.split_first()?;
    let k = x.len();
    if k == 0 {
        let normal = DMatrix::zeros(0, 0);
        return Some(Regression { rss: dot(y, y), coefficients: Vec::new(), normal, ln_det: 0.0 });
    }
    let scale: Vec<f64> = x.iter().map(|c| dot(c, c).sqrt()).collect();
    let unit = DMatrix::from_fn(k, k, |i, j| dot(&x[i], &x[j]) / (scale[i] * scale[j]));
    let rhs = DVector::from_fn(k, |i, _| dot(&x[i], y) / scale[i]);
    let cholesky = nalgebra::Cholesky::new(unit.clone())?;
    let beta = cholesky.solve(&rhs);
    let coefficients: Vec<f64> = (0..k).map(|i| beta[i] / scale[i]).collect();
    let residual = |t: usize| y[t] - coefficients.iter().zip(x).map(|(b, x)| b * x[t]).sum::<f64>();
    let rss = (0..y.len()).map(|t| residual(t).powi(2)).sum();
    let ln_det = 2.0 * cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
        + 2.0 * scale.iter().map(|s| s.ln()).sum::<f64>();
    let normal = DMatrix::from_fn(k, k, |i, j| unit[(i, j)] * scale[i] * scale[j]);
    Some(Regression { rss, coefficients, normal, ln_det })
}

/// The ratios K²/σ² of the mixture with their prior weights: zero, and from 'adds to the mean's variance as much
/// as the white noise' to 'hides the white noise between two groups'.
pub(super) fn ratios(count: f64, span_s: f64, groups: usize) -> Vec<(f64, f64)> {
    let steps = ((groups as f64).powi(2).log10().max(1.0) / DECADES).ceil() as i32 + (1.0 / DECADES) as i32;
    let share = (1.0 - NO_WALK) / f64::from(steps + 1);
    let unit = 1.0 / (count * span_s);
    let walk = (0..=steps).map(|i| (unit * 10f64.powf(f64::from(i) * DECADES), share));
    if span_s > 0.0 { std::iter::once((0.0, NO_WALK)).chain(walk).collect() } else { vec![(0.0, 1.0)] }
}

/// Fits the noise of the residuals `y - X β̂` and the covariance that it gives β̂. `None` if X is singular.
pub(super) fn fit(groups: &[BlockSum], columns: &Columns, residual_sums: &[f64], span_s: f64) -> Option<NoiseFit> {
    let inverse_normal = inverse(&columns.normal)?;
    let k = inverse_normal.nrows();
    let m = groups.len();
    let freedom = m as f64 - k as f64;
    if freedom < 1.0 {
        return None;
    }
    let means = |sums: &[f64]| -> Vec<f64> { sums.iter().zip(groups).map(|(s, b)| s / b.n).collect() };
    let mut series = vec![means(residual_sums)];
    series.extend(columns.groups.iter().map(|c| means(c)));
    let count: f64 = groups.iter().map(|b| b.n).sum();
    let walk = walk_normal(groups, columns);
    let mut members = Vec::new();
    let mut ln_weights = Vec::new();
    for (ratio, prior) in ratios(count, span_s, m) {
        let white = whiten(groups, &series, ratio);
        let Some(found) = regress(&white.columns) else { continue };
        let variance = (found.rss / freedom).max(f64::MIN_POSITIVE);
        ln_weights.push(prior.ln() - 0.5 * (freedom * variance.ln() + white.ln_det + found.ln_det));
        let spread = &inverse_normal + ratio * (&inverse_normal * &walk * &inverse_normal);
        members.push(Member {
            weight: 0.0,
            white_variance: variance,
            walk_variance_rate: ratio * variance,
            covariance: spread * variance,
        });
    }
    NoiseFit::weigh(members, &ln_weights, inverse_normal, freedom)
}

/// Xᵀ V X of a random walk with unit K²: Σ Δt S Sᵀ, S the column sums from each time to the end.
fn walk_normal(groups: &[BlockSum], columns: &Columns) -> DMatrix<f64> {
    let k = columns.groups.len();
    let mut out = DMatrix::<f64>::zeros(k, k);
    let mut tail = DVector::<f64>::zeros(k);
    for i in (1..groups.len()).rev() {
        for (j, column) in columns.groups.iter().enumerate() {
            tail[j] += column[i];
        }
        let step = groups[i].mid_s - groups[i - 1].mid_s;
        out += (&tail * tail.transpose()) * step;
    }
    out
}

impl NoiseFit {
    /// The mixture of `members` with these logarithms of weights. `None` without any.
    pub(crate) fn weigh(
        mut members: Vec<Member>,
        ln_weights: &[f64],
        inverse_normal: DMatrix<f64>,
        degrees_of_freedom: f64,
    ) -> Option<Self> {
        let top = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let total: f64 = ln_weights.iter().map(|w| (w - top).exp()).sum();
        for (member, w) in members.iter_mut().zip(ln_weights) {
            member.weight = (w - top).exp() / total;
        }
        (total.is_finite() && !members.is_empty()).then_some(Self { members, inverse_normal, degrees_of_freedom })
    }

    /// Probability that the bias walks.
    pub(crate) fn walk_probability(&self) -> f64 {
        self.mean(|m| f64::from(u8::from(m.walk_variance_rate > 0.0)))
    }

    /// Mean of f over the mixture.
    pub(crate) fn mean(&self, f: impl Fn(&Member) -> f64) -> f64 {
        self.members.iter().map(|m| m.weight * f(m)).sum()
    }

    /// Probability that an error with the variance that each member gives it is as large as `value`: its sign does not matter.
    pub(crate) fn p_value(&self, value: f64, variances: &[f64]) -> f64 {
        let Ok(t) = StudentsT::new(0.0, 1.0, self.degrees_of_freedom) else { return f64::NAN };
        self.members.iter().zip(variances).map(|(m, v)| m.weight * 2.0 * t.cdf(-value.abs() / v.max(0.0).sqrt())).sum()
    }

    /// Half width x with P(|error| > x) = 1 - level, for an error that is Student's t with
    /// the variance that each member gives it.
    pub(crate) fn half_width(&self, variances: &[f64], level: f64) -> f64 {
        let parts: Vec<(f64, f64)> =
            self.members.iter().zip(variances).map(|(m, v)| (m.weight, v.max(0.0).sqrt())).collect();
        // what is this improbable moves no digit of a 95 % interval
        let parts: Vec<(f64, f64)> = parts.into_iter().filter(|p| p.0 > 1e-6).collect();
        let widest = parts.iter().map(|p| p.1).fold(0.0, f64::max);
        if !(widest.is_finite() && widest > 0.0) {
            return widest;
        }
        let Ok(t) = StudentsT::new(0.0, 1.0, self.degrees_of_freedom) else { return f64::NAN };
        let outside = |x: f64| -> f64 {
            parts.iter().filter(|p| p.1 > 0.0).map(|(w, s)| w * 2.0 * t.cdf(-x / s)).sum::<f64>() - (1.0 - level)
        };
        let quantile = -t.inverse_cdf(0.5 * (1.0 - level));
        let narrowest = parts.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        let (mut low, mut high) = (narrowest * quantile * 0.99, widest * quantile * 1.01);
        for _ in 0..60 {
            let mid = 0.5 * (low + high);
            if outside(mid) > 0.0 {
                low = mid;
            } else {
                high = mid;
            }
            if high - low < 1e-6 * high {
                break;
            }
        }
        0.5 * (low + high)
    }
}
