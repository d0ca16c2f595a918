//! S(f) = B²/(2πf), two-sided, rad²/s²/Hz: flicker noise, flat Allan deviation √(2 ln 2/π) B = 0.664 B
//!
//! Simulated as a sum of Ornstein-Uhlenbeck processes with time constants in a geometric series: their Lorentzians add up
//! to 1/f where they are equally strong. White noise averaged over two rows joins them: sampled processes level off
//! towards half the sample rate, and 1/f does not. The strengths are fitted to B²/(2πf) from 1/(10 span) to half the sample
//! rate, as the sampled processes have it, so that aliasing is allowed for: within four percent, in the last fifth below
//! half the sample rate eight. Below that band the spectrum is flat.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, Noise, NoiseState};
use super::parts::{
    Bias, Checked, LONGER, OrnsteinUhlenbeck, exponential_spectrum, log_spaced, step_s, stream, white_std_rad_s,
};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};
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

/// Parts whose spectra add up to 1/(2πf) for B = 1.
struct Parts {
    /// Time constant, s, and variance of each process.
    processes: Vec<(f64, f64)>,
    /// Variance of the white noise that is averaged over two rows.
    averaged: f64,
}

impl Parts {
    fn new(span_s: f64, dt_s: f64) -> Self {
        let low_hz = 1.0 / (BELOW_SPAN * span_s);
        let [longest_s, shortest_s] = [MARGIN / (2.0 * PI * low_hz), 0.3 * dt_s];
        let count = ((longest_s / shortest_s).ln() / RATIO.ln()).ceil().max(1.0) as usize + 1;
        let times_s = log_spaced(shortest_s, longest_s, count);
        let mut omegas = log_spaced(2.0 * PI * low_hz * dt_s, PI, 8 * count);
        omegas.extend((1..=60).map(|k| PI * f64::from(k) / 60.0));
        // rows: spectra over the target; wanted are strengths that make each row add up to one
        let row = |&omega: &f64| {
            let processes = times_s.iter().map(|&tau| exponential_spectrum(tau, dt_s, omega));
            processes.chain([averaged_spectrum(omega)]).map(|s| s * omega).collect()
        };
        let over_target: Vec<Vec<f64>> = omegas.iter().map(row).collect();
        let mut strength = vec![RATIO.ln() / PI; count + 1];
        let totals: Vec<f64> = (0..=count).map(|j| over_target.iter().map(|row| row[j]).sum()).collect();
        // multiplicative updates keep every strength positive (Richardson 1972, Lucy 1974)
        for _ in 0..ITERATIONS {
            let mut update = vec![0.0; count + 1];
            for row in &over_target {
                let sum: f64 = row.iter().zip(&strength).map(|(a, s)| a * s).sum();
                update.iter_mut().zip(row).for_each(|(u, a)| *u += a / sum);
            }
            strength.iter_mut().zip(update.iter().zip(&totals)).for_each(|(s, (u, t))| *s *= u / t);
        }
        let averaged = strength.pop().unwrap_or(0.0);
        Self { processes: times_s.into_iter().zip(strength).collect(), averaged }
    }
}

/// Spectrum of (w[k] + w[k-1])/2, w white of unit variance.
fn averaged_spectrum(omega: f64) -> f64 {
    (0.5 * omega).cos().powi(2)
}

impl Effect for BiasInstability {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        // 1/f noise is fitted within four percent, and the ends of a log leak
        let flicker = [("bias_instability_rad_s", 1e-3)];
        Tried::size(&flicker).drawn(&flicker).spectrum(&[2e-4], 4, 0.06)
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(LONGER)
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let instability = Checked::of(&ABOUT, parameters)?.value(INSTABILITY)?;
        let mut draw = stream(&ABOUT, seed);
        let parts = Parts::new(scene.span_s(), scene.step_s);
        let process = |&(tau, variance): &(f64, f64)| OrnsteinUhlenbeck::new(instability * variance.sqrt(), tau);
        let mut sum: Vec<OrnsteinUhlenbeck> = parts.processes.iter().map(process).collect();
        // what is averaged over two rows is a thousandth of it, and white to a filter
        let correlated = |&(tau, variance): &(f64, f64)| [instability * variance.sqrt(), tau];
        let in_filter: Vec<[f64; 2]> = parts.processes.iter().map(correlated).collect();
        let half = 0.5 * instability * parts.averaged.sqrt();
        let mut before = draw.normal();
        Ok(Box::new(Bias(
            move |row, scene: &Scene| {
                let dt_s = step_s(scene, row);
                let now = draw.normal();
                let averaged = half * (now + before);
                before = now;
                averaged + sum.iter_mut().map(|process| process.next(dt_s, &mut draw)).sum::<f64>()
            },
            GyroInFilter::Correlated(in_filter),
        )))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Noise(Box::new(Self)))
    }

    /// From zero to the frequency where its density equals that of the white noise, Hz.
    fn band_hz(&self, parameters: &Parameters, scene: &Scene) -> Option<[f64; 2]> {
        let power = parameters.get(INSTABILITY)?.powi(2);
        Some([0.0, power / (2.0 * PI * white_std_rad_s(scene).powi(2) * scene.step_s)])
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

    fn state(&self, theta: &[f64]) -> Option<NoiseState> {
        theta.first().map(|b| NoiseState::Flicker(*b))
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
    fn the_sum_of_processes_is_one_over_f_within_a_few_percent_in_the_whole_band() {
        for (span_s, dt_s) in [(200.0, 0.1), (1800.0, 0.01), (36_000.0, 0.005), (3.0, 1.0)] {
            let parts = Parts::new(span_s, dt_s);
            assert!(parts.processes.len() < 40, "{}", parts.processes.len());
            let low = 2.0 * PI * dt_s / (BELOW_SPAN * span_s);
            for omega in log_spaced(low, PI, 997) {
                let processes = parts.processes.iter().map(|(tau, v)| v * exponential_spectrum(*tau, dt_s, omega));
                let spectrum = processes.sum::<f64>() + parts.averaged * averaged_spectrum(omega);
                let bound = if omega < 0.8 * PI { 0.04 } else { 0.08 };
                assert!((spectrum * omega - 1.0).abs() < bound, "{span_s} s, ω = {omega}: {}", spectrum * omega);
            }
        }
    }
}
