//! r_l, r_r: both (1 + s) times their nominal value

use super::{Coordinate, DriveExplanation, Driving, ModelChange};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "wheel.radius_scale",
    title: "wheel radius off nominal",
    equation: "r = (1 + s) r_nominal of both wheels",
    source: "Borenstein and Feng (1996), E_s",
    channel: "wheels",
    deficient: "wheel kinematics: both radii differ from nominal",
    condition: None,
    parameters: &[Parameter { name: "relative", meaning: "s", bounds: [-0.5, 0.5], null: Some(0.0), required: true }],
    remedy: "Measure the distance of a straight drive of ten metres against the wheel turns.",
};

/// Wheel radius off nominal.
pub(super) struct RadiusScale;

impl Driving for RadiusScale {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&RadiusScale)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for RadiusScale {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("relative".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("relative").copied().unwrap_or(0.0)]
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.radius_m = robot.radius_m.map(|r| r * (1.0 + self.0));
    }
}
