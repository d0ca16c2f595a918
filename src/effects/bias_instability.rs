//! S(f) = B²/(2πf), two-sided, rad²/s²/Hz: flicker noise, flat Allan deviation √(2 ln 2/π) B = 0.664 B
//!
//! Simulated as a sum of Ornstein-Uhlenbeck processes with time constants in a geometric series: their Lorentzians add up
//! to 1/f where they are equally strong. The strengths are fitted to B²/(2πf) from 1/(10 span) to half the sample rate, as
//! the sampled processes have it, so that aliasing is allowed for: within four percent, the worst of it in the last
//! octave. Below that band the spectrum is flat.

use super::parts::{
    Bias, Checked, OrnsteinUhlenbeck, exponential_spectrum, log_spaced, step_s, stream, white_std_rad_s,
};
use super::{About, Effect, Explanation, Noise, Parameter, Parameters};
use crate::error::Result;
use crate::model::{GyroEffect, Scene};
use std::f64::consts::PI;

const INSTABILITY: &str = "bias_instability_rad_s";

static ABOUT: About = About {
    id: "gyro.bias_instability",
    title: "bias instability",
    equation: "S(f) = B²/(2πf), two-sided: flicker noise of the bias, flat Allan deviation 0.664 B",
    source: "IEEE Std 952-1997, annex C; Keshner, Proc. IEEE 70 (1982) 212",
    channel: "gyro",
    deficient: "gyro bias: a term with equal power in every octave",
    condition: None,
    parameters: &[Parameter {
        name: INSTABILITY,
        meaning: "B, rad/s",
        bounds: [0.0, 1.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Add two or three Gauss-Markov states that cover the time between corrections; averaging longer at rest does \
             not help below 0.664 B.",
};

/// The bias has flicker noise.
pub(super) struct BiasInstability;

/// Below the slowest wave of the log by this factor the spectrum may level off.
const BELOW_SPAN: f64 = 10.0;
/// Ratio of neighbouring time constants: the ripple of the sum is 4 exp(-π²/ln 3), half a thousandth.
const RATIO: f64 = 3.0;
/// Time constants reach beyond the band by this factor, in time; shorter than a row they are white.
const MARGIN: f64 = 10.0;
const ITERATIONS: usize = 400;

/// Time constants, s, and variances of processes whose spectra add up to 1/(2πf) for B = 1.
fn processes(span_s: f64, dt_s: f64) -> Vec<(f64, f64)> {
    let low_hz = 1.0 / (BELOW_SPAN * span_s);
    let [longest_s, shortest_s] = [MARGIN / (2.0 * PI * low_hz), 0.2 * dt_s];
    let count = ((longest_s / shortest_s).ln() / RATIO.ln()).ceil().max(1.0) as usize + 1;
    let times_s = log_spaced(shortest_s, longest_s, count);
    let omegas = log_spaced(2.0 * PI * low_hz * dt_s, PI, 8 * count);
    // rows: spectra over the target; wanted are strengths that make each row add up to one
    let over_target: Vec<Vec<f64>> =
        omegas.iter().map(|&w| times_s.iter().map(|&tau| exponential_spectrum(tau, dt_s, w) * w).collect()).collect();
    let totals: Vec<f64> = (0..count).map(|j| over_target.iter().map(|row| row[j]).sum()).collect();
    let mut strength = vec![RATIO.ln() / PI; count];
    // multiplicative updates keep every strength positive (Richardson 1972, Lucy 1974)
    for _ in 0..ITERATIONS {
        let mut update = vec![0.0; count];
        for row in &over_target {
            let sum: f64 = row.iter().zip(&strength).map(|(a, s)| a * s).sum();
            update.iter_mut().zip(row).for_each(|(u, a)| *u += a / sum);
        }
        strength.iter_mut().zip(update.iter().zip(&totals)).for_each(|(s, (u, t))| *s *= u / t);
    }
    times_s.into_iter().zip(strength).collect()
}

impl Effect for BiasInstability {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let instability = Checked::of(&ABOUT, parameters)?.value(INSTABILITY)?;
        let mut draw = stream(&ABOUT, seed);
        let mut sum: Vec<OrnsteinUhlenbeck> = processes(scene.span_s(), scene.step_s)
            .into_iter()
            .map(|(tau, variance)| OrnsteinUhlenbeck::new(instability * variance.sqrt(), tau))
            .collect();
        Ok(Box::new(Bias(move |row, scene: &Scene| {
            let dt_s = step_s(scene, row);
            sum.iter_mut().map(|process| process.next(dt_s, &mut draw)).sum()
        })))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Noise(Box::new(Self)))
    }
}

impl Noise for BiasInstability {
    fn names(&self) -> Vec<&'static str> {
        vec![INSTABILITY]
    }

    /// The white noise N averages down to N/√span: a twentieth of it in B cannot be seen. At ten times a sample's white
    /// noise there is nothing but flicker noise.
    fn range(&self, scene: &Scene) -> Vec<[f64; 2]> {
        let white = white_std_rad_s(scene);
        vec![[0.05 * white / (scene.len().max(1) as f64).sqrt(), 10.0 * white]]
    }

    fn starts(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let white = white_std_rad_s(scene);
        let quiet = white / (scene.len().max(1) as f64).sqrt();
        log_spaced(2.0 * quiet, white.max(4.0 * quiet), 4).into_iter().map(|b| vec![b]).collect()
    }

    fn spectrum(&self, _: &Scene, theta: &[f64], omega: f64) -> f64 {
        // B²/(2πf)/Δt with f = ω/(2πΔt)
        let instability = theta.first().copied().unwrap_or(0.0);
        instability * instability / omega
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_processes_is_one_over_f_within_four_percent_in_the_whole_band() {
        for (span_s, dt_s) in [(200.0, 0.1), (1800.0, 0.01), (36_000.0, 0.005), (3.0, 1.0)] {
            let sum = processes(span_s, dt_s);
            assert!(sum.len() < 40, "{}", sum.len());
            let low = 2.0 * PI * dt_s / (BELOW_SPAN * span_s);
            for omega in log_spaced(low, PI, 997) {
                let spectrum: f64 = sum.iter().map(|(tau, v)| v * exponential_spectrum(*tau, dt_s, omega)).sum();
                assert!((spectrum * omega - 1.0).abs() < 0.04, "{span_s} s, ω = {omega}: {}", spectrum * omega);
            }
        }
    }
}
