//! db = -b/τ dt + σ √(2/τ) dW;  S(ω) = σ² (1 - φ²) / (1 - 2 φ cos ω + φ²), φ = exp(-Δt/τ)

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, Noise, NoiseState};
use super::parts::{
    Bias, Checked, LONGER, OrnsteinUhlenbeck, RATE_BOUND_RAD_S, TIME_BOUNDS_S, exponential_spectrum, log_spaced,
    step_s, stream, white_std_rad_s,
};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const TIME: &str = "correlation_time_s";
const STD: &str = "std_rad_s";

static ABOUT: About = About {
    id: "gyro.gauss_markov",
    title: "exponentially correlated noise",
    equation: "db = -b/τ dt + σ √(2/τ) dW: first-order Gauss-Markov noise, autocorrelation σ² exp(-|Δ|/τ)",
    source: "IEEE Std 952-1997, annex C; Uhlenbeck and Ornstein, Phys. Rev. 36 (1930) 823",
    channel: "gyro",
    deficient: "gyro bias: a term that wanders and returns",
    condition: None,
    parameters: &[
        Parameter { name: TIME, meaning: "τ, s", bounds: TIME_BOUNDS_S, null: None, required: true },
        Parameter { name: STD, meaning: "σ, rad/s", bounds: [0.0, RATE_BOUND_RAD_S], null: Some(0.0), required: true },
    ],
    remedy: "Add a bias state to the filter that returns to zero with time constant τ and has the stationary variance σ².",
};

/// The bias has exponentially correlated noise.
pub(super) struct GaussMarkov;

impl Effect for GaussMarkov {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        // the ends of a stationary log leak into coefficients where there is little power
        let markov = [("correlation_time_s", 1.0), ("std_rad_s", 1e-3)];
        Tried::size(&markov).drawn(&markov).spectrum(&[1.0, 3e-4], 4, 0.03).spectrum(&[0.04, 3e-4], 4, 0.03)
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(LONGER)
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (std, time_s) = (checked.value(STD)?, checked.value(TIME)?);
        let mut process = OrnsteinUhlenbeck::new(std, time_s);
        let in_filter = GyroInFilter::Correlated(vec![[std, time_s]]);
        let mut draw = stream(&ABOUT, seed);
        Ok(Box::new(Bias(move |row, scene: &Scene| process.next(step_s(scene, row), &mut draw), in_filter)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Noise(Box::new(Self)))
    }

    fn band_hz(&self, parameters: &Parameters, _: &Scene) -> Option<[f64; 2]> {
        Some([0.0, 1.0 / (std::f64::consts::TAU * parameters.get(TIME)?)])
    }
}

impl Noise for GaussMarkov {
    fn names(&self) -> Vec<&'static str> {
        vec![TIME, STD]
    }

    /// τ: shorter than a row it is white, longer than the log a random walk. σ: with τ of the order of the span it acts on
    /// the lowest coefficients alone, where a twentieth of N/√span cannot be seen; ten times a sample's white noise
    /// drowns it at every τ.
    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let white = white_std_rad_s(scene);
        // what is correlated over more than a fifth of the recording cannot be told from a random walk, and is called one
        let time_s = [scene.step_s, (0.2 * scene.span_s()).max(10.0 * scene.step_s)];
        vec![time_s, [0.05 * white / (scene.len().max(1) as f64).sqrt(), 10.0 * white]]
    }

    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let (white, dt_s) = (white_std_rad_s(scene), scene.step_s);
        let longest_s = (0.15 * scene.span_s()).max(4.0 * dt_s);
        let times_s = log_spaced(3.0 * dt_s, longest_s, 4);
        let [low, high] = self.range(scene)[1];
        // low frequencies: 2 σ² τ/Δt beside the variance of the white noise
        let start = |tau: f64, ratio: f64| {
            let std = white * (ratio * dt_s / (2.0 * tau)).sqrt();
            vec![tau, std.clamp(low, high)]
        };
        times_s.into_iter().flat_map(|tau| [0.3, 30.0].map(|ratio| start(tau, ratio))).collect()
    }

    fn state(&self, theta: &[f64]) -> Option<NoiseState> {
        let &[time_s, std_rad_s] = theta else { return None };
        Some(NoiseState::Exponential { time_s, std_rad_s })
    }

    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64 {
        let &[time_s, std] = theta else { return 0.0 };
        std * std * exponential_spectrum(time_s, scene.step_s, omega)
    }
}
