//! ln S(ω) → ln S(ω) + Σ_m a_m h_m(ln ω), h_m hats over ln ω, a_m ~ N(0, 1/4): any smooth spectrum

use crate::effects::Noise;
use crate::model::Scene;
use std::f64::consts::PI;

/// Nodes of the hats, in octave steps down from the Nyquist frequency; the last one reaches down to zero.
const NODES: usize = 9;
/// Octaves between nodes.
const OCTAVES: f64 = 1.3;

/// A free spectrum.
pub(crate) struct FreeSpectrum;

impl Noise for FreeSpectrum {
    fn names(&self) -> Vec<&'static str> {
        ["a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8", "a9"].to_vec()
    }

    fn range(&self, _: &Scene) -> Vec<[f64; 2]> {
        vec![[(-0.5_f64).exp(), 0.5_f64.exp()]; NODES]
    }

    fn starts(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1.0; NODES]]
    }

    fn spectrum(&self, _: &Scene, theta: &[f64], omega: f64) -> f64 {
        let at = ((PI / omega).log2() / OCTAVES).clamp(0.0, (NODES - 1) as f64);
        let below = (at as usize).min(NODES - 2);
        let u = at - below as f64;
        (theta[below].ln() * (1.0 - u) + theta[below + 1].ln() * u).exp()
    }
}
