//! standard deviation of the white noise = nominal · exp(k ΔT + m ΔT²), ΔT = temperature above its value at power-on
//!
//! log variance = 2 k ΔT + 2 m ΔT²: the columns hold twice ΔT, so that their coefficients are k and m.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bent, Checked, REHEATED, covariate, temperature_rise_c};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};
use crate::signal::names;

const SLOPE: &str = "relative_per_c";
const BEND: &str = "relative_bend_per_c2";

static ABOUT: About = About {
    id: "gyro.noise_growth",
    title: "noise grows with temperature",
    equation: "white noise · exp(k ΔT + m ΔT²), ΔT counted from power-on",
    source: "Gabrielson, IEEE Trans. Electron Devices 40 (1993) 903, thermomechanical noise; IEEE Std 1554-2005",
    channel: "gyro",
    deficient: "gyro white noise: its size follows the temperature",
    condition: Some("temperature_c"),
    parameters: &[
        Parameter {
            name: SLOPE,
            meaning: "k, relative growth of the standard deviation per °C at power-on",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: BEND,
            meaning: "m, relative growth per °C²",
            bounds: [-0.01, 0.01],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Make the measurement noise of the filter a function of temperature, or keep the sensor cooler.",
};

/// Prior standard deviation of the bend beside the slope, both as root mean square.
const BEND_SCALE: f64 = 0.3;
/// Noise larger or smaller by e to this is no model any more, and would overflow.
const LARGEST_LOG: f64 = 50.0;

/// The white noise follows the temperature.
pub(super) struct NoiseGrowth;

struct Growing {
    scale: Vec<f64>,
}

impl GyroEffect for Growing {
    fn white_scale(&mut self, row: usize, _: &Scene) -> f64 {
        self.scale.get(row).copied().unwrap_or(1.0)
    }

    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::Known
    }
}

impl Effect for NoiseGrowth {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("relative_per_c", 0.02), ("relative_bend_per_c2", 1e-3)])
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(REHEATED)
    }

    /// `relative_per_c` is needed here, though an answer may be without it.
    fn simulated(&self, parameters: &Parameters, scene: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (slope, bend) = (checked.value(SLOPE)?, checked.optional(BEND).unwrap_or(0.0));
        let rise = covariate(temperature_rise_c(scene), &ABOUT, names::TEMPERATURE, scene.temperature_c.is_some())?;
        let log = |x: f64| (slope * x + bend * x * x).clamp(-LARGEST_LOG, LARGEST_LOG);
        Ok(Box::new(Growing { scale: rise.into_iter().map(|x| log(x).exp()).collect() }))
    }

    fn explanation(&self, scene: &Scene) -> Option<Explanation> {
        temperature_rise_c(scene).map(|_| Explanation::Variance(Box::new(Self) as Box<dyn Signal>))
    }
}

/// No constant: at power-on the noise is the nominal one.
fn bent(scene: &Scene) -> Bent {
    Bent::through_origin(temperature_rise_c(scene).unwrap_or_default())
}

impl Signal for NoiseGrowth {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
        bent(scene).columns(2.0, BEND_SCALE)
    }

    fn parameters(&self, scene: &Scene, _: &[f64], coefficients: &[f64]) -> Parameters {
        bent(scene).parameters(SLOPE, BEND, coefficients)
    }

    fn shape(&self, _: &Scene, _: &Parameters) -> Option<Vec<f64>> {
        Some(Vec::new())
    }

    fn coefficients(&self, scene: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        bent(scene).coefficients(SLOPE, BEND, parameters)
    }
}
