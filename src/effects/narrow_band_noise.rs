//! z[k+1] = exp((2πi f - π w) Δt) z[k] + noise, b = Re z, variance σ²: noise in a band w wide about f
//!
//! Autocovariance σ² exp(-π w |τ|) cos(2π f τ); w is the full width at half the height of the spectrum
//! S(ω) = σ² ½ [P(ω - ω₀) + P(ω + ω₀)], P(x) = (1 - φ²)/(1 - 2 φ cos x + φ²), φ = exp(-π w Δt).

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, Noise, NoiseState, Peak};
use super::parts::{Bias, Checked, RATE_BOUND_RAD_S, exponential_spectrum, step_s, stream, white_std_rad_s};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};
use std::f64::consts::{PI, TAU};

const CENTER: &str = "center_hz";
const WIDTH: &str = "bandwidth_hz";
const STD: &str = "std_rad_s";

static ABOUT: About = About {
    id: "gyro.narrow_band_noise",
    title: "narrow-band noise",
    equation: "b(t) has the autocovariance σ² exp(-π w |τ|) cos(2π f τ): a vibration whose frequency and size wander",
    source: "IEEE Std 1554-2005, vibration; Gillespie, Phys. Rev. E 54 (1996) 2084, for the exact step",
    channel: "gyro",
    deficient: "gyro measurement: noise in a band of frequencies is added",
    condition: None,
    parameters: &[
        Parameter {
            name: CENTER,
            meaning: "f, Hz; above half the sample rate it is seen folded",
            bounds: [1e-6, 1e6],
            null: None,
            required: true,
        },
        Parameter {
            name: WIDTH,
            meaning: "w, Hz: full width at half the height of the spectrum",
            bounds: [1e-7, 1e6],
            null: None,
            required: true,
        },
        Parameter {
            name: STD,
            meaning: "σ, rad/s: standard deviation of the whole band",
            bounds: [0.0, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: true,
        },
    ],
    remedy: "Find what vibrates at this frequency (or folds to it) and damp or mount it softly, or filter before sampling.",
};

/// Periods of the recording in the narrowest band.
const PERIODS: f64 = 2.0;
/// Widest band that is called narrow, relative to its middle: beyond, it is noise of low frequencies.
const WIDEST: f64 = 0.33;
/// Slowest vibration, Hz: what turns more slowly is the wander of the bias (IEEE Std 952-1997, C.1).
const SLOWEST_HZ: f64 = 0.02;
/// Smallest and largest σ in standard deviations of the white noise.
const STDS: [f64; 2] = [1e-3, 30.0];

/// Noise in a band is added.
pub(super) struct NarrowBandNoise;

impl Effect for NarrowBandNoise {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        // of a band little power lies far below it
        let band = [("center_hz", 3.0), ("bandwidth_hz", 0.4), ("std_rad_s", 1e-3)];
        let tried = Tried::size(&band).drawn(&band);
        tried.spectrum(&[3.3, 1.0, 3e-4], 512, 0.03).spectrum(&[7.0, 2.0, 3e-4], 1024, 0.03)
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (center_hz, width_hz, std) = (checked.value(CENTER)?, checked.value(WIDTH)?, checked.value(STD)?);
        let mut draw = stream(&ABOUT, seed);
        let mut state: Option<[f64; 2]> = None;
        let next = move |row: usize, scene: &Scene| {
            let z = match state {
                None => [std * draw.normal(), std * draw.normal()],
                Some([x, y]) => {
                    let dt = step_s(scene, row);
                    let decay = (-PI * width_hz * dt).exp();
                    let drive = std * (-(-TAU * width_hz * dt).exp_m1()).sqrt();
                    let (sin, cos) = (TAU * center_hz * dt).sin_cos();
                    [
                        decay * (cos * x - sin * y) + drive * draw.normal(),
                        decay * (sin * x + cos * y) + drive * draw.normal(),
                    ]
                }
            };
            state = Some(z);
            z[0]
        };
        let in_filter = GyroInFilter::Unrepresented("a filter with a state for every vibration would follow noise");
        Ok(Box::new(Bias(next, in_filter)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Noise(Box::new(Self)))
    }

    fn band_hz(&self, parameters: &Parameters, _: &Scene) -> Option<[f64; 2]> {
        let (f, w) = (parameters.get(CENTER)?, parameters.get(WIDTH)?);
        Some([(f - 0.5 * w).max(0.0), f + 0.5 * w])
    }
}

fn within(ranges: &[[f64; 2]], theta: [f64; 3]) -> Vec<f64> {
    theta.iter().zip(ranges).map(|(v, [low, high])| v.clamp(*low, *high)).collect()
}

/// Hz in a rad/sample.
fn hz(scene: &Scene) -> f64 {
    1.0 / (TAU * scene.step_s)
}

/// ω₀ and the rate of decay in rad/sample.
fn per_sample(scene: &Scene, theta: &[f64]) -> Option<[f64; 3]> {
    let &[center_hz, width_hz, std] = theta else { return None };
    let width_hz = width_hz.min(WIDEST * center_hz);
    Some([TAU * center_hz * scene.step_s, PI * width_hz * scene.step_s, std * std])
}

/// ∫ P from 0 to x, |x| up to π and beyond by the period.
fn integral(rate: f64, x: f64) -> f64 {
    let turns = (x / TAU).round();
    let rest = x - TAU * turns;
    // (1 + φ)/(1 - φ) = coth(rate/2)
    TAU * turns + 2.0 * ((0.5 * rest).tan() / (0.5 * rate).tanh()).atan()
}

impl Noise for NarrowBandNoise {
    fn names(&self) -> Vec<&'static str> {
        vec![CENTER, WIDTH, STD]
    }

    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let (nyquist, white) = (0.5 / scene.step_s, white_std_rad_s(scene));
        let line = PERIODS / scene.span_s();
        let slowest = SLOWEST_HZ.clamp(2.5 * line, 0.5 * nyquist.max(5.0 * line));
        vec![[slowest, nyquist.max(5.0 * line)], [line, (0.5 * nyquist).max(2.0 * line)], STDS.map(|s| s * white)]
    }

    /// Wide bands; narrow ones are found where they stand out.
    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let (nyquist, white) = (0.5 / scene.step_s, white_std_rad_s(scene));
        let ranges = self.range(scene);
        [0.15, 0.4, 0.7].map(|part| within(&ranges, [part * nyquist, 0.2 * part * nyquist, 0.3 * white])).to_vec()
    }

    fn starts_at(&self, scene: &Scene, peaks: &[Peak]) -> Vec<Vec<f64>> {
        let ranges = self.range(scene);
        let at = |peak: &Peak, factor: f64| {
            let width = (factor * peak.width).min(0.5 * WIDEST * peak.omega);
            let theta = [peak.omega * hz(scene), width * hz(scene), peak.variance.max(0.0).sqrt()];
            within(&ranges, theta)
        };
        let fast = peaks.iter().filter(|p| p.omega * hz(scene) >= ranges[0][0]);
        fast.flat_map(|p| [0.3, 1.0].map(|factor| at(p, factor))).collect()
    }

    /// The middle moves by a part of the width.
    fn steps(&self, theta: &[f64]) -> Vec<f64> {
        let &[center, width, _] = theta else { return Vec::new() };
        vec![(0.1 * width / center).min(0.03), 0.03, 0.03]
    }

    fn state(&self, theta: &[f64]) -> Option<NoiseState> {
        let &[center_hz, width_hz, std_rad_s] = theta else { return None };
        Some(NoiseState::Band { center_hz, width_hz, std_rad_s })
    }

    fn spectrum(&self, scene: &Scene, theta: &[f64], omega: f64) -> f64 {
        let Some([center, rate, variance]) = per_sample(scene, theta) else { return 0.0 };
        let p = |x: f64| exponential_spectrum(1.0 / rate, 1.0, x);
        0.5 * variance * (p(omega - center) + p(omega + center))
    }

    fn mean_spectrum(&self, scene: &Scene, theta: &[f64], omega: f64, [low, high]: [f64; 2]) -> f64 {
        let Some([center, rate, variance]) = per_sample(scene, theta) else { return 0.0 };
        if high - low < 0.1 * rate {
            return self.spectrum(scene, theta, omega);
        }
        let over = |shift: f64| (integral(rate, high + shift) - integral(rate, low + shift)) / (high - low);
        0.5 * variance * (over(-center) + over(center))
    }
}
