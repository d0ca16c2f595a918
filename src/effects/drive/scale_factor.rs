//! reading = (1 + k) ω

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving};

static ABOUT: About = About {
    id: "gyro.scale_factor",
    title: "gyro scale factor",
    equation: "reading = (1 + k) ω",
    source: "IEEE Std 952-1997, scale factor error",
    channel: "gyro",
    deficient: "gyro measurement: its gain",
    condition: Some("yaw_rate"),
    parameters: &[Parameter { name: "relative", meaning: "k", bounds: [-0.9, 9.0], null: Some(0.0), required: true }],
    remedy: "Turn the robot by ten full turns against a mark and enter the gain.",
};

/// Gyro scale factor.
pub(super) struct ScaleFactor;

impl Driving for ScaleFactor {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&ScaleFactor)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for ScaleFactor {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [1e-3, 0.05], bounds: [-0.9, 9.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn touches(&self) -> Touches {
        Touches::GYRO
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

    fn needs(&self) -> Needs {
        Needs { gyro: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, _: &Moving, rate_rad_s: f64) -> f64 {
        rate_rad_s * (1.0 + self.0)
    }
}
