//! y(t) += Σ_d β_d P_d(u(t)), u a covariate scaled to [-1, 1] (d = 1..5), or its smoothed rate r: r, |r|, sign r
//!
//! A covariate that only grew (a sensor that warms itself) is a clock: what follows it then follows time as well.

use crate::effects::{Column, Signal};
use crate::model::Scene;

/// The covariate that a form follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Follows {
    /// `temperature_c`
    Temperature,
    /// `supply_v`
    Supply,
}

impl Follows {
    /// The covariate's values, where it was logged.
    pub(crate) fn of(self, scene: &Scene) -> Option<&[f64]> {
        match self {
            Self::Temperature => scene.temperature_c.as_deref(),
            Self::Supply => scene.supply_v.as_deref(),
        }
    }
}

/// A free function of a covariate.
pub(crate) struct CovariateForm(pub Follows);

/// A free function of a covariate's rate, its sign included.
pub(crate) struct RateForm(pub Follows);

/// First-order low pass, forwards and backwards.
fn smooth(values: &[f64], steps: f64) -> Vec<f64> {
    let gain = 1.0 - (-1.0 / steps.max(1e-9)).exp();
    let mut out = values.to_vec();
    let mut pass = |order: &mut dyn Iterator<Item = usize>| {
        let mut state = None;
        for i in order {
            let s = state.unwrap_or(out[i]);
            let next: f64 = s + gain * (out[i] - s);
            out[i] = next;
            state = Some(next);
        }
    };
    pass(&mut (0..values.len()));
    pass(&mut (0..values.len()).rev());
    out
}

fn legendre(d: usize, x: f64) -> f64 {
    let (mut a, mut b) = (1.0, x);
    for k in 1..d {
        (a, b) = (b, ((2 * k + 1) as f64 * x * b - k as f64 * a) / (k + 1) as f64);
    }
    b
}

impl Signal for CovariateForm {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![]]
    }

    fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
        let Some(values) = self.0.of(scene) else { return Vec::new() };
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let scaled = |v: f64| if high > low { 2.0 * (v - low) / (high - low) - 1.0 } else { 0.0 };
        let column = |d: usize| Column {
            values: values.iter().map(|v| legendre(d, scaled(*v))).collect(),
            relative_scale: 1.0 / (d as f64).sqrt(),
        };
        (1..=6).map(column).collect()
    }
}

impl Signal for RateForm {
    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [20.0, 60.0, 180.0, 500.0].iter().filter(|s| **s > scene.step_s).map(|s| vec![*s]).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let (Some(values), Some(width_s)) = (self.0.of(scene), shape.first()) else { return Vec::new() };
        let smoothed = smooth(values, width_s / scene.step_s);
        let n = smoothed.len();
        let at = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
            (smoothed[b] - smoothed[a]) / ((b - a).max(1) as f64 * scene.step_s)
        };
        let rate: Vec<f64> = (0..n).map(at).collect();
        let mut sizes: Vec<f64> = rate.iter().map(|r| r.abs()).collect();
        let typical = crate::math::robust::median(&mut sizes).max(1e-300);
        let make = |f: &dyn Fn(f64) -> f64, relative_scale| Column {
            values: rate.iter().map(|r| f(*r)).collect(),
            relative_scale,
        };
        vec![make(&|r| r, 1.0), make(&|r| (r / (0.3 * typical)).tanh(), 1.0), make(&|r| r.abs(), 0.7)]
    }
}
