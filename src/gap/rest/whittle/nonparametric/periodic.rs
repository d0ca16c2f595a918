//! y(t) += Σ_h a_h cos(2πh f t) + b_h sin(2πh f t): something periodic of any shape

use crate::effects::{Column, Signal};
use crate::model::Scene;
use std::f64::consts::TAU;

/// Something periodic of so many harmonics: shape = [frequency, Hz].
pub(crate) struct Comb(pub usize);

fn pair(scene: &Scene, phase: impl Fn(f64) -> f64, relative_scale: f64) -> [Column; 2] {
    let (mut cos, mut sin) = (Vec::with_capacity(scene.len()), Vec::with_capacity(scene.len()));
    for i in 0..scene.len() {
        let (s, c) = phase(scene.time.at(i)).sin_cos();
        cos.push(c);
        sin.push(s);
    }
    [Column { values: cos, relative_scale }, Column { values: sin, relative_scale }]
}

impl Signal for Comb {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        Vec::new()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let Some(f) = shape.first() else { return Vec::new() };
        let nyquist = 0.5 / scene.step_s;
        (1..=self.0)
            .filter(|h| *h as f64 * f < nyquist)
            .flat_map(|h| pair(scene, |t| TAU * h as f64 * f * t, 1.0 / (h as f64).sqrt()))
            .collect()
    }
}
