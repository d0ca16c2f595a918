//! b(t) = a t, t from power-on

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bias, Checked, POWERED_AGAIN, single};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const RAMP: &str = "ramp_rad_s2";

static ABOUT: About = About {
    id: "gyro.rate_ramp",
    title: "rate ramp",
    equation: "b(t) = a t: the bias drifts linearly",
    source: "IEEE Std 952-1997, annex C; El-Sheimy, Hou, Niu, IEEE Trans. Instrum. Meas. 57 (2008) 140",
    channel: "gyro",
    deficient: "gyro bias: a term that grows with time",
    condition: Some("elapsed_time"),
    parameters: &[Parameter {
        name: RAMP, meaning: "a, rad/s²", bounds: [-0.1, 0.1], null: Some(0.0), required: true
    }],
    remedy: "Add the slope of the bias as a state of the filter, or record longer: a ramp is often the start of a slower \
             warm-up.",
};

/// The bias drifts linearly.
pub(super) struct RateRamp;

impl Effect for RateRamp {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("ramp_rad_s2", 2e-6)])
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(POWERED_AGAIN)
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let ramp = Checked::of(&ABOUT, parameters)?.value(RAMP)?;
        Ok(Box::new(Bias(move |row, scene: &Scene| ramp * scene.time.at(row), GyroInFilter::Known)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Signal(Box::new(Self)))
    }
}

impl Signal for RateRamp {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
        vec![Column { values: scene.time.to_vec(), relative_scale: 1.0 }]
    }

    fn parameters(&self, _: &Scene, _: &[f64], coefficients: &[f64]) -> Parameters {
        single(RAMP, coefficients.first().copied().unwrap_or(0.0))
    }

    fn shape(&self, _: &Scene, _: &Parameters) -> Option<Vec<f64>> {
        Some(Vec::new())
    }

    fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(RAMP)?])
    }
}
