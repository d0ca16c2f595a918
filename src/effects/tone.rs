//! b(t) = A cos(2π f t + φ), t from power-on; φ is another in each run

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bias, Checked, RATE_BOUND_RAD_S, stream};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};
use std::f64::consts::TAU;

const FREQUENCY: &str = "frequency_hz";
const AMPLITUDE: &str = "amplitude_rad_s";
const PHASE: &str = "phase_rad";

static ABOUT: About = About {
    id: "gyro.tone",
    title: "tone",
    equation: "b(t) = A cos(2π f t + φ): a sinusoid by vibration, mains or aliasing, its phase another in each run",
    source: "IEEE Std 952-1997, annex C, sinusoidal noise",
    channel: "gyro",
    deficient: "gyro measurement: a sinusoid is added",
    condition: None,
    parameters: &[
        Parameter {
            name: FREQUENCY,
            meaning: "f, Hz; above half the sample rate it is seen folded",
            bounds: [1e-7, 1e6],
            null: None,
            required: true,
        },
        Parameter {
            name: AMPLITUDE,
            meaning: "A, rad/s",
            bounds: [0.0, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: PHASE,
            meaning: "φ, rad; without it, drawn anew in each run",
            bounds: [-TAU, TAU],
            null: None,
            required: false,
        },
    ],
    remedy: "Find what vibrates or hums at this frequency (or folds to it), damp or shield it, or filter before sampling.",
};

/// A sinusoid is added.
pub(super) struct Tone;

impl Effect for Tone {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("frequency_hz", 1.37), ("amplitude_rad_s", 2e-4), ("phase_rad", 1.1)])
            .drawn(&[("frequency_hz", 1.0), ("amplitude_rad_s", 1e-3)])
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (frequency, amplitude) = (checked.value(FREQUENCY)?, checked.value(AMPLITUDE)?);
        let in_filter = match checked.optional(PHASE) {
            Some(_) => GyroInFilter::Known,
            None => GyroInFilter::Sinusoid { amplitude_rad_s: amplitude, angular_frequency_rad_s: TAU * frequency },
        };
        let phase = checked.optional(PHASE).unwrap_or_else(|| TAU * stream(&ABOUT, seed).uniform());
        Ok(Box::new(Bias(
            move |row, scene: &Scene| amplitude * (TAU * frequency * scene.time.at(row) + phase).cos(),
            in_filter,
        )))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Line(Box::new(Self)))
    }
}

impl Signal for Tone {
    /// One nominal frequency: a grid as fine as a line is would hold thousands, and a periodogram finds the line at once.
    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.125 / scene.step_s]]
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let frequency = shape.first().copied().unwrap_or(0.0);
        let angles: Vec<f64> = (0..scene.len()).map(|i| TAU * frequency * scene.time.at(i)).collect();
        let column = |f: fn(f64) -> f64| Column { values: angles.iter().map(|a| f(*a)).collect(), relative_scale: 1.0 };
        vec![column(f64::cos), column(f64::sin)]
    }

    fn parameters(&self, _: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let at = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
        let frequency = shape.first().copied().unwrap_or(0.0);
        Parameters::from([(FREQUENCY.to_string(), frequency), (AMPLITUDE.to_string(), at(0).hypot(at(1)))])
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(FREQUENCY)?])
    }

    fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        let (amplitude, phase) = (*parameters.get(AMPLITUDE)?, *parameters.get(PHASE)?);
        Some(vec![amplitude * phase.cos(), -amplitude * phase.sin()])
    }

    fn prior_std(&self, parameters: &Parameters) -> Option<Vec<f64>> {
        // a uniform phase: each coefficient has the variance A²/2
        Some(vec![parameters.get(AMPLITUDE)? * std::f64::consts::FRAC_1_SQRT_2; 2])
    }

    fn refine(&self, scene: &Scene) -> Option<Vec<[f64; 2]>> {
        let high = 0.5 / scene.step_s;
        Some(vec![[(1.0 / scene.span_s()).min(0.5 * high), high]])
    }
}
