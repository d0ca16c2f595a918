//! standard deviation of the white noise = g · nominal

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, Noise};
use super::parts::Checked;
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const LEVEL: &str = "noise_over_nominal";
/// From a tenth, below which the nominal noise would be another sensor's, to thirty times.
const BOUNDS: [f64; 2] = [0.1, 30.0];

static ABOUT: About = About {
    id: "gyro.noise_level",
    title: "another level of the white noise",
    equation: "standard deviation of the white noise = g · nominal, always",
    source: "IEEE Std 952-1997, angle random walk; data sheets state typical values, and units differ by tens of percent",
    channel: "gyro",
    deficient: "gyro white noise: it is larger or smaller than the nominal simulator states",
    condition: None,
    parameters: &[Parameter {
        name: LEVEL,
        meaning: "g: standard deviation of the white noise over the nominal one",
        bounds: BOUNDS,
        null: Some(1.0),
        required: true,
    }],
    remedy: "State the angle random walk of this unit (gyroid fit, gyroid noise) instead of the nominal one.",
};

/// The white noise is larger or smaller.
pub(super) struct NoiseLevel;

struct Scaled(f64);

impl GyroEffect for Scaled {
    fn white_scale(&mut self, _: usize, _: &Scene) -> f64 {
        self.0
    }

    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Known
    }
}

impl Effect for NoiseLevel {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("noise_over_nominal", 2.0)])
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        Ok(Box::new(Scaled(Checked::of(&ABOUT, parameters)?.value(LEVEL)?)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Level(Box::new(Self)))
    }

    fn deficient(&self, parameters: &Parameters) -> String {
        let side = if parameters.get(LEVEL).is_some_and(|g| *g < 1.0) { "smaller" } else { "larger" };
        format!("gyro white noise: it is {side} than the nominal simulator states")
    }
}

impl Noise for NoiseLevel {
    fn names(&self) -> Vec<&'static str> {
        vec![LEVEL]
    }

    fn range(&self, _: &Scene) -> Vec<[f64; 2]> {
        vec![BOUNDS]
    }

    fn starts(&self, _: &Scene) -> Vec<Vec<f64>> {
        [0.15, 0.4, 0.7, 0.9, 0.97, 1.03, 1.1, 1.4, 2.5, 6.0, 16.0].map(|g| vec![g]).to_vec()
    }

    fn spectrum(&self, _: &Scene, theta: &[f64], _: f64) -> f64 {
        theta.first().map_or(1.0, |g| g * g)
    }
}
