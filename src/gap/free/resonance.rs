//! S(ω) += A² (2/π) (w/2)² / ((f - f0)² + (w/2)²) (…normalised to the variance A²): narrow-band noise around f0

use crate::effects::Noise;
use crate::model::Scene;
use std::f64::consts::PI;

/// Narrow-band noise.
pub struct Resonance;

impl Noise for Resonance {
    fn names(&self) -> Vec<&'static str> {
        vec!["std_rad_s", "frequency_hz", "width_hz"]
    }

    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let nyquist = 0.5 / scene.step_s;
        let white = scene.white_std_rad_s;
        vec![[1e-3 * white, 30.0 * white], [5.0 / scene.span_s(), nyquist], [2.0 / scene.span_s(), 0.5 * nyquist]]
    }

    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let (low, high) = (10.0 / scene.span_s(), 0.5 / scene.step_s);
        let count = 40;
        let frequency = |i: usize| low * (high / low).powf((i as f64 + 0.5) / f64::from(count));
        let widths = [0.03, 0.2];
        (0..count as usize)
            .flat_map(|i| {
                let f = frequency(i);
                widths.map(|w| {
                    vec![0.2 * scene.white_std_rad_s * (w * f / high).sqrt(), f, (w * f).max(2.5 / scene.span_s())]
                })
            })
            .collect()
    }

    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64 {
        let f = omega / (2.0 * PI * scene.step_s);
        let half = 0.5 * theta[2];
        let line = |d: f64| half / PI / (d * d + half * half);
        // two-sided density over the sample time, both signs of the frequency
        theta[0] * theta[0] * 0.5 * (line(f - theta[1]) + line(f + theta[1])) / scene.step_s
    }
}
