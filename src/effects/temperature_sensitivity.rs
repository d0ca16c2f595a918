//! b = k z + m z²,  dz/dt = (ΔT - z)/lag,  ΔT = temperature above its value at power-on
//!
//! The lag is that between the temperature sensor and what makes the bias. ΔT counts from the mean of the log's first
//! second; a constant error of it lands in C2. k is the slope at power-on.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bent, Checked, REHEATED, covariate, lagged, log_spaced, path, temperature_rise_c};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, Scene};
use crate::signal::names;

const SLOPE: &str = "coefficient_rad_s_per_c";
const BEND: &str = "bend_rad_s_per_c2";
const LAG: &str = "lag_s";

static ABOUT: About = About {
    id: "gyro.temperature_sensitivity",
    title: "temperature sensitivity",
    equation: "b = k z + m z², dz/dt = (ΔT - z)/lag: the bias follows the temperature, counted from power-on",
    source: "IEEE Std 1554-2005; Aggarwal, Syed, Niu, El-Sheimy, J. Navigation 61 (2008) 323",
    channel: "gyro",
    deficient: "gyro bias: a term that follows the temperature",
    condition: Some("temperature_c"),
    parameters: &[
        Parameter {
            name: SLOPE,
            meaning: "k, rad/s per °C at power-on",
            bounds: [-0.1, 0.1],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: BEND, meaning: "m, rad/s per °C²", bounds: [-0.01, 0.01], null: Some(0.0), required: false
        },
        Parameter {
            name: LAG,
            meaning: "thermal lag behind the temperature sensor, s",
            bounds: [0.0, 1e5],
            null: None,
            required: false,
        },
    ],
    remedy: "Calibrate the bias over temperature and subtract it, with the lag between the temperature sensor and the gyro.",
};

/// Prior standard deviation of the bend beside the slope, both as root mean square.
const BEND_SCALE: f64 = 0.3;
/// Nodes of the lag beside zero, s: from a chip to a housing.
const LAGS_S: [f64; 2] = [10.0, 1500.0];
const LAG_NODES: usize = 6;

/// The bias follows the temperature.
pub(super) struct TemperatureSensitivity;

impl Effect for TemperatureSensitivity {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("coefficient_rad_s_per_c", 3e-5), ("bend_rad_s_per_c2", -4e-6), ("lag_s", 31.0)])
            .or_size(&[("coefficient_rad_s_per_c", 3e-5)])
            .up_to_constant()
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(REHEATED)
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (slope, bend) = (checked.value(SLOPE)?, checked.optional(BEND).unwrap_or(0.0));
        let rise = covariate(temperature_rise_c(scene), &ABOUT, names::TEMPERATURE, scene.temperature_c.is_some())?;
        let rise = lagged(scene, &rise, checked.optional(LAG).unwrap_or(0.0));
        Ok(path(rise.into_iter().map(|z| slope * z + bend * z * z).collect()))
    }

    fn explanation(&self, scene: &Scene) -> Option<Explanation> {
        temperature_rise_c(scene).map(|_| Explanation::Signal(Box::new(Self) as Box<dyn Signal>))
    }
}

/// The lagged temperature with its bend.
fn bent(scene: &Scene, shape: &[f64]) -> Bent {
    let lag_s = shape.first().copied().unwrap_or(0.0);
    Bent::new(lagged(scene, &temperature_rise_c(scene).unwrap_or_default(), lag_s))
}

impl Signal for TemperatureSensitivity {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        let lags = log_spaced(LAGS_S[0], LAGS_S[1], LAG_NODES);
        std::iter::once(0.0).chain(lags).map(|lag| vec![lag]).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        bent(scene, shape).columns(1.0, BEND_SCALE)
    }

    fn parameters(&self, scene: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let mut parameters = bent(scene, shape).parameters(SLOPE, BEND, coefficients);
        parameters.insert(LAG.to_string(), shape.first().copied().unwrap_or(0.0));
        parameters
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![parameters.get(LAG).copied().unwrap_or(0.0)])
    }

    fn coefficients(&self, scene: &Scene, shape: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        bent(scene, shape).coefficients(SLOPE, BEND, parameters)
    }

    fn refine(&self, _: &Scene) -> Option<Vec<[f64; 2]>> {
        Some(vec![[0.0, LAGS_S[1]]])
    }
}
