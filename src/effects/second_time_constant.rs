//! b(t) = C3 (1 - exp(-t/τ)), t from power-on, τ < T

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bias, Checked, POWERED_AGAIN, RATE_BOUND_RAD_S, TIME_BOUNDS_S, log_spaced};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const C3: &str = "c3_rad_s";
const TIME: &str = "time_constant_s";

static ABOUT: About = About {
    id: "gyro.second_time_constant",
    title: "second time constant",
    equation: "b(t) = C3 (1 - exp(-t/τ)): a second, faster exponential in the warm-up",
    source: "Barshan and Durrant-Whyte, IEEE Trans. Robotics and Automation 11 (1995) 328, for one exponential; chip and \
             package warm each at their own pace",
    channel: "gyro",
    deficient: "gyro bias: the warm-up has a second exponential",
    condition: Some("elapsed_time"),
    parameters: &[
        Parameter {
            name: C3,
            meaning: "C3, rad/s",
            bounds: [-RATE_BOUND_RAD_S, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: true,
        },
        Parameter { name: TIME, meaning: "τ, s", bounds: TIME_BOUNDS_S, null: None, required: true },
    ],
    remedy: "Fit the warm-up as a sum of two exponentials, or wait a few τ after power-on before driving.",
};

/// Nodes of the time constant.
const NODES: usize = 16;
/// τ is at least this many rows, and at least this long, s: below, only the first rows differ from a constant.
const FEWEST_ROWS: f64 = 4.0;
const SHORTEST_S: f64 = 2.0;
/// τ is at most this part of T: nearer to it both exponentials are one.
const LONGEST_OF_T: f64 = 0.7;

/// The warm-up has a second, faster exponential.
pub(super) struct SecondTimeConstant;

impl Effect for SecondTimeConstant {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("c3_rad_s", -4e-4), ("time_constant_s", 17.0)])
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(POWERED_AGAIN)
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (c3, tau) = (checked.value(C3)?, checked.value(TIME)?);
        Ok(Box::new(Bias(move |row, scene: &Scene| -c3 * (-scene.time.at(row) / tau).exp_m1(), GyroInFilter::Known)))
    }

    /// Beside a first one: where the nominal simulator has none, a single exponential is the warm-up itself.
    fn explanation(&self, scene: &Scene) -> Option<Explanation> {
        (scene.warm_up.c1_rad_s != 0.0).then(|| Explanation::Signal(Box::new(Self) as Box<dyn Signal>))
    }
}

fn range_s(scene: &Scene) -> [f64; 2] {
    let low = (FEWEST_ROWS * scene.step_s).max(SHORTEST_S);
    [low, (LONGEST_OF_T * scene.warm_up.time_constant_s).max(2.0 * low)]
}

impl Signal for SecondTimeConstant {
    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let [low, high] = range_s(scene);
        log_spaced(low, high, NODES).into_iter().map(|tau| vec![tau]).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let tau = shape.first().copied().unwrap_or(SHORTEST_S);
        let values = (0..scene.len()).map(|i| -(-scene.time.at(i) / tau).exp_m1()).collect();
        vec![Column { values, relative_scale: 1.0 }]
    }

    fn parameters(&self, _: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let first = |x: &[f64]| x.first().copied().unwrap_or(0.0);
        Parameters::from([(C3.to_string(), first(coefficients)), (TIME.to_string(), first(shape))])
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(TIME)?])
    }

    fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(C3)?])
    }

    fn refine(&self, scene: &Scene) -> Option<Vec<[f64; 2]>> {
        Some(vec![range_s(scene)])
    }
}
