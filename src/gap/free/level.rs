//! S_white → g² S_white: the white noise is not what the nominal simulator states

use crate::effects::Noise;
use crate::model::Scene;

/// Another level of white noise.
pub struct WhiteLevel;

impl Noise for WhiteLevel {
    fn names(&self) -> Vec<&'static str> {
        vec!["white_level"]
    }

    fn range(&self, _: &Scene) -> Vec<[f64; 2]> {
        vec![[0.2, 5.0]]
    }

    fn starts(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.8], vec![1.25]]
    }

    fn spectrum(&self, _: &Scene, theta: &[f64], _: f64) -> f64 {
        theta[0] * theta[0]
    }
}
