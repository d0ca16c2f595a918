//! y(t) += Σ_k β_k cos(πkt/span), β_k ~ N(0, s²/k²), k = 1, 2, …: a smooth function of time

use crate::effects::{Column, Signal};
use crate::model::Scene;
use std::f64::consts::PI;

/// A smooth function of time, of so many terms.
pub struct SmoothTime(pub usize);

impl Signal for SmoothTime {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![]]
    }

    fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
        let n = scene.len();
        let column = |k: usize| Column {
            values: (0..n).map(|i| (PI * k as f64 * (i as f64 + 0.5) / n as f64).cos()).collect(),
            relative_scale: 1.0 / k as f64,
        };
        (1..=self.0).map(column).collect()
    }
}
