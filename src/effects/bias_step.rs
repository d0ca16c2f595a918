//! b(t) = s for t ≥ t₁, else 0; t₁ is another in each run

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bias, Checked, POWERED_AGAIN, RATE_BOUND_RAD_S, single, stream};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

pub(super) const STEP: &str = "step_rad_s";
pub(super) const TIME: &str = "time_s";

pub(super) static ABOUT: About = About {
    id: "gyro.bias_step",
    title: "bias step",
    equation: "b(t) = s for t ≥ t₁: the bias jumps once, at another time in each run",
    source: "IEEE Std 1554-2005, bias repeatability; Basseville and Nikiforov, Detection of Abrupt Changes (1993)",
    channel: "gyro",
    deficient: "gyro bias: it jumps once",
    condition: None,
    parameters: &[
        Parameter {
            name: STEP,
            meaning: "s, rad/s",
            bounds: [-RATE_BOUND_RAD_S, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: TIME,
            meaning: "t₁ since power-on, s; without it, anywhere in the run",
            bounds: [0.0, 1e9],
            null: None,
            required: false,
        },
    ],
    remedy: "Look for a shock, a loose mount or a brown-out at that time; have the filter re-estimate the bias after a jump.",
};

/// Nodes of the time.
const NODES: usize = 192;
/// Part of the run at either end in which no step is looked for: it would be an outlier or a constant there.
const MARGIN: f64 = 0.005;

/// The bias jumps once.
pub(super) struct BiasStep;

/// From when to when a step may lie, s since power-on.
fn range_s(scene: &Scene) -> [f64; 2] {
    let (start, span) = if scene.is_empty() { (0.0, 0.0) } else { (scene.time.at(0), scene.time.span_s()) };
    [start + MARGIN * span, start + (1.0 - MARGIN) * span]
}

impl Effect for BiasStep {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("step_rad_s", -3e-4), ("time_s", 70.0)]).drawn(&[("step_rad_s", 1e-3)])
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some(POWERED_AGAIN)
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let step = checked.value(STEP)?;
        let [low, high] = range_s(scene);
        let in_filter = match checked.optional(TIME) {
            Some(_) => GyroInFilter::Known,
            None => GyroInFilter::Unrepresented("the time of the step is not stated (`time_s`)"),
        };
        let at = checked.optional(TIME).unwrap_or_else(|| low + (high - low) * stream(&ABOUT, seed).uniform());
        Ok(Box::new(Bias(move |row, scene: &Scene| if scene.time.at(row) >= at { step } else { 0.0 }, in_filter)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Signal(Box::new(Self)))
    }
}

impl Signal for BiasStep {
    fn is_event(&self) -> bool {
        true
    }

    fn shapes(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let [low, high] = range_s(scene);
        let at = |i: usize| vec![low + (high - low) * i as f64 / (NODES - 1) as f64];
        (0..NODES).map(at).collect()
    }

    fn columns(&self, scene: &Scene, shape: &[f64]) -> Vec<Column> {
        let at = shape.first().copied().unwrap_or(f64::INFINITY);
        let values = (0..scene.len()).map(|i| f64::from(u8::from(scene.time.at(i) >= at))).collect();
        vec![Column { values, relative_scale: 1.0 }]
    }

    /// The size alone. The time is the shape, which another run does not share.
    fn parameters(&self, _: &Scene, _: &[f64], coefficients: &[f64]) -> Parameters {
        single(STEP, coefficients.first().copied().unwrap_or(0.0))
    }

    fn shape(&self, _: &Scene, parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(TIME)?])
    }

    fn coefficients(&self, _: &Scene, _: &[f64], parameters: &Parameters) -> Option<Vec<f64>> {
        Some(vec![*parameters.get(STEP)?])
    }

    fn refine(&self, scene: &Scene) -> Option<Vec<[f64; 2]>> {
        Some(vec![range_s(scene)])
    }
}
