//! db = K dW;  S(ω) = K² Δt / (2 - 2 cos ω) per coefficient of the cosine transform
//!
//! The walk starts at power-on. The cosine transform diagonalises it exactly (see [`crate::math::dct`]).

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, InDrives, Noise, NoiseState};
use super::parts::{Bias, Checked, LONGER, log_spaced, step_s, stream, white_std_rad_s};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const WALK: &str = "rate_random_walk_rad_s_sqrt_s";

static ABOUT: About = About {
    id: "gyro.rate_random_walk",
    title: "rate random walk",
    equation: "db = K dW: the bias performs a random walk, its variance grows by K² a second",
    source: "IEEE Std 952-1997, annex C; El-Sheimy, Hou, Niu, IEEE Trans. Instrum. Meas. 57 (2008) 140",
    channel: "gyro",
    deficient: "gyro bias: a term that wanders",
    condition: None,
    parameters: &[Parameter {
        name: WALK,
        meaning: "K, rad/s/√s",
        bounds: [0.0, 1.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Estimate the bias as a state of the filter with process noise K², and let it be corrected at every standstill.",
};

/// The bias performs a random walk.
pub(super) struct RateRandomWalk;

impl Effect for RateRandomWalk {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        // a walk is diagonal exactly
        let walk = [("rate_random_walk_rad_s_sqrt_s", 1e-3)];
        Tried::size(&walk).drawn(&walk).spectrum(&[3e-4], 1, 0.0)
    }

    fn in_drives(&self) -> Option<InDrives> {
        Some(InDrives::Walk)
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(LONGER)
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let walk = Checked::of(&ABOUT, parameters)?.value(WALK)?;
        let mut draw = stream(&ABOUT, seed);
        let mut bias = 0.0;
        Ok(Box::new(Bias(
            move |row, scene: &Scene| {
                let dt_s = if row == 0 { scene.time.at(0).max(0.0) } else { step_s(scene, row) };
                bias += walk * dt_s.sqrt() * draw.normal();
                bias
            },
            GyroInFilter::Walk(walk),
        )))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Noise(Box::new(Self)))
    }

    /// From zero to the frequency where its density equals that of the white noise, Hz.
    fn band_hz(&self, parameters: &Parameters, scene: &Scene) -> Option<[f64; 2]> {
        let density = white_std_rad_s(scene) * scene.step_s.sqrt();
        Some([0.0, parameters.get(WALK)? / (std::f64::consts::TAU * density)])
    }
}

impl Noise for RateRandomWalk {
    fn names(&self) -> Vec<&'static str> {
        vec![WALK]
    }

    /// K = √3 N/span is where the walk reaches the white noise N at the longest averaging time. A thirtieth of it changes
    /// the lowest coefficient by a thousandth. At the other end a step from row to row is ten times the white noise.
    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let (white, dt_s) = (white_std_rad_s(scene), scene.step_s);
        let density = white * dt_s.sqrt();
        let [low, high] = [0.05 * density / scene.span_s(), 10.0 * white / dt_s.sqrt()];
        vec![[low, high.max(10.0 * low)]]
    }

    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // meets the white noise at the whole span ... at a thousandth of it, or at four rows
        let density = white_std_rad_s(scene) * scene.step_s.sqrt();
        let meets = |part: f64| vec![3f64.sqrt() * density / (part * scene.span_s())];
        let shortest = (4.0 / scene.len().max(4) as f64).max(1e-3);
        log_spaced(1.0, shortest, 4).into_iter().map(meets).collect()
    }

    fn state(&self, theta: &[f64]) -> Option<NoiseState> {
        theta.first().map(|k| NoiseState::Walk(*k))
    }

    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64 {
        let walk = theta.first().copied().unwrap_or(0.0);
        let half = (0.5 * omega).sin();
        walk * walk * scene.step_s / (4.0 * half * half)
    }
}
