//! reading = ω + a |ω|/2

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving};

static ABOUT: About = About {
    id: "gyro.scale_asymmetry",
    title: "gyro scale asymmetry",
    equation: "reading = ω + a |ω|/2: the gain differs between left and right turns",
    source: "IEEE Std 952-1997, asymmetry error",
    channel: "gyro",
    deficient: "gyro measurement: its gain differs between left and right turns",
    condition: Some("yaw_rate"),
    parameters: &[Parameter {
        name: "relative",
        meaning: "a, gain at positive rate minus gain at negative rate",
        bounds: [-0.9, 0.9],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Turn the robot by ten full turns each way and enter both gains.",
};

/// Gyro scale asymmetry.
pub(super) struct ScaleAsymmetry;

impl Driving for ScaleAsymmetry {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&ScaleAsymmetry)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for ScaleAsymmetry {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [1e-3, 0.05], bounds: [-0.9, 0.9] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn touches(&self) -> Touches {
        Touches::GYRO
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
        rate_rad_s + 0.5 * self.0 * rate_rad_s.abs()
    }
}
