//! b(t) = C1' (1 - exp(-t/T')) - C1 (1 - exp(-t/T)), t from power-on: another warm-up in the place of the nominal one

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bias, Checked, RATE_BOUND_RAD_S, TIME_BOUNDS_S, log_spaced};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const C1: &str = "c1_rad_s";
const TIME: &str = "time_constant_s";

static ABOUT: About = About {
    id: "gyro.warm_up",
    title: "another warm-up",
    equation: "e(t) = C1' (1 - exp(-t/T')) + C2: size or time constant lie outside their stated repeatability, or the nominal \
               simulator has no warm-up",
    source: "Barshan and Durrant-Whyte, IEEE Trans. Robotics and Automation 11 (1995) 328",
    channel: "gyro",
    deficient: "gyro bias: the warm-up is another",
    condition: Some("elapsed_time"),
    parameters: &[
        Parameter {
            name: C1,
            meaning: "C1', rad/s: the real one, in the place of the nominal",
            bounds: [-RATE_BOUND_RAD_S, RATE_BOUND_RAD_S],
            null: None,
            required: true,
        },
        Parameter {
            name: TIME,
            meaning: "T', s: the real one, in the place of the nominal",
            bounds: TIME_BOUNDS_S,
            null: None,
            required: true,
        },
    ],
    remedy: "Fit the warm-up of this unit (gyroid fit) and use its C1 and T.",
};

/// Nodes of the time constant.
const NODES: usize = 24;
/// T' is at least this many rows, and at least this long, s: below, only the first rows differ from a constant.
const FEWEST_ROWS: f64 = 4.0;
const SHORTEST_S: f64 = 2.0;

/// Another warm-up in the place of the nominal one.
pub(super) struct AnotherWarmUp;

fn rise(t_s: f64, time_constant_s: f64) -> f64 {
    -(-t_s / time_constant_s).exp_m1()
}

impl Effect for AnotherWarmUp {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("c1_rad_s", 3e-3), ("time_constant_s", 41.0)])
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (c1, time_s) = (checked.value(C1)?, checked.value(TIME)?);
        let bias = move |row, scene: &Scene| {
            let (t, nominal) = (scene.time.at(row), &scene.warm_up);
            c1 * rise(t, time_s) - nominal.c1_rad_s * rise(t, nominal.time_constant_s)
        };
        Ok(Box::new(Bias(bias, GyroInFilter::Known)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Signal(Box::new(Self)))
    }

    fn nominal(&self, scene: &Scene) -> Parameters {
        let nominal = &scene.warm_up;
        Parameters::from([(C1.to_string(), nominal.c1_rad_s), (TIME.to_string(), nominal.time_constant_s)])
    }
}

/// Longer than the recording it is a ramp.
fn range_s(scene: &Scene) -> [f64; 2] {
    let low = (FEWEST_ROWS * scene.step_s).max(SHORTEST_S);
    [low, scene.span_s().max(2.0 * low)]
}

/// The coefficient is C1' - C1: with the nominal size the nominal curve is exchanged for that of T'.
impl Signal for AnotherWarmUp {
    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let [low, high] = range_s(scene);
        log_spaced(low, high, NODES).into_iter().map(|time| vec![time]).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let time_s = shape.first().copied().unwrap_or(SHORTEST_S);
        let values = (0..scene.len()).map(|i| rise(scene.time.at(i), time_s)).collect();
        vec![Column { values, relative_scale: 1.0 }]
    }

    fn offset(&self, scene: &Scene, shape: &[f64]) -> Option<Vec<f64>> {
        let nominal = &scene.warm_up;
        let time_s = *shape.first()?;
        let at = |t: f64| nominal.c1_rad_s * (rise(t, time_s) - rise(t, nominal.time_constant_s));
        (nominal.c1_rad_s != 0.0).then(|| (0..scene.len()).map(|i| at(scene.time.at(i))).collect())
    }

    fn parameters(&self, scene: &Scene, shape: &[f64], coefficients: &[f64]) -> Parameters {
        let first = |x: &[f64]| x.first().copied().unwrap_or(0.0);
        let c1 = scene.warm_up.c1_rad_s + first(coefficients);
        Parameters::from([(C1.to_string(), c1), (TIME.to_string(), first(shape))])
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(TIME)?])
    }

    fn coefficients(&self, scene: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(C1)? - scene.warm_up.c1_rad_s])
    }

    fn refine(&self, scene: &Scene) -> Option<Vec<[f64; 2]>> {
        Some(vec![range_s(scene)])
    }
}
