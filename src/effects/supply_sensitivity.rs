//! b = k u + m u²,  u = supply above its mean over the log
//!
//! The mean is known better than the first value where the supply is noisy; the constant between them lands in C2.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Column, Explanation, Signal};
use super::parts::{Bent, Checked, covariate, path, supply_deviation_v};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, Scene};
use crate::signal::names;

const SLOPE: &str = "coefficient_rad_s_per_v";
const BEND: &str = "bend_rad_s_per_v2";

static ABOUT: About = About {
    id: "gyro.supply_sensitivity",
    title: "supply sensitivity",
    equation: "b = k u + m u²: the bias follows the supply voltage, u counted from its mean",
    source: "IEEE Std 1554-2005, sensitivity to input power",
    channel: "gyro",
    deficient: "gyro bias: a term that follows the supply voltage",
    condition: Some("supply_v"),
    parameters: &[
        Parameter {
            name: SLOPE,
            meaning: "k, rad/s per V at the mean supply",
            bounds: [-RATE_BOUND_PER_V, RATE_BOUND_PER_V],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: BEND,
            meaning: "m, rad/s per V²",
            bounds: [-RATE_BOUND_PER_V, RATE_BOUND_PER_V],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Give the gyro a regulator of its own, or subtract k times the measured supply voltage.",
};

const RATE_BOUND_PER_V: f64 = 1.0;
/// Prior standard deviation of the bend beside the slope, both as root mean square.
const BEND_SCALE: f64 = 0.2;

/// The bias follows the supply.
pub(super) struct SupplySensitivity;

impl Effect for SupplySensitivity {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("coefficient_rad_s_per_v", 3e-3), ("bend_rad_s_per_v2", 2e-2)]).up_to_constant()
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some("a recording in which the supply is stepped by 50 mV or more")
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let (slope, bend) = (checked.value(SLOPE)?, checked.optional(BEND).unwrap_or(0.0));
        let supply = covariate(supply_deviation_v(scene), &ABOUT, names::SUPPLY, scene.supply_v.is_some())?;
        Ok(path(supply.into_iter().map(|u| slope * u + bend * u * u).collect()))
    }

    fn explanation(&self, scene: &Scene) -> Option<Explanation> {
        supply_deviation_v(scene).map(|_| Explanation::Signal(Box::new(Self) as Box<dyn Signal>))
    }
}

fn bent(scene: &Scene) -> Bent {
    Bent::new(supply_deviation_v(scene).unwrap_or_default())
}

impl Signal for SupplySensitivity {
    fn shapes(&self, _: &Scene) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn columns(&self, scene: &Scene, _: &[f64]) -> Vec<Column> {
        bent(scene).columns(1.0, BEND_SCALE)
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
