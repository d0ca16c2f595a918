//! y(t) += Σ_k β_k cos(πkt/span), β_k ~ N(0, s² exp(-k²/2κ²)), k = 1 … 2κ: a smooth function of time
//!
//! A Gaussian process of squared exponential covariance (Rasmussen and Williams 2006, §4.2) with the scale span/κ of its bends
//! open. A random walk's coefficients fall like 1/k and have no such scale: it is no smooth function.

use crate::effects::{Column, Signal};
use crate::model::Scene;
use std::f64::consts::PI;

/// A smooth function of time with at most so many bends: shape = [κ].
pub(crate) struct SmoothTime(pub usize);

impl Signal for SmoothTime {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        let most = self.0 as f64;
        [0.25 * most, 0.5 * most, most].map(|bends| vec![bends.max(2.0)]).to_vec()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let n = scene.len();
        let bends = shape.first().copied().unwrap_or(self.0 as f64);
        let column = |k: usize| Column {
            values: (0..n).map(|i| (PI * k as f64 * (i as f64 + 0.5) / n as f64).cos()).collect(),
            relative_scale: (-0.25 * (k as f64 / bends).powi(2)).exp(),
        };
        (1..=(2.0 * bends).ceil() as usize).map(column).collect()
    }
}
