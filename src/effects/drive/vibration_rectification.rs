//! reading = ω + q v²

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving};

const COEFFICIENT: &str = "coefficient_rad_s_per_m2_s2";

static ABOUT: About = About {
    id: "gyro.vibration_rectification",
    title: "vibration rectification",
    equation: "reading = ω + q v²: vibration grows with speed and shifts the bias",
    source: "IEEE Std 1431-2004, vibration rectification error",
    channel: "gyro",
    deficient: "gyro measurement: its bias grows with speed squared",
    condition: Some("speed"),
    parameters: &[Parameter {
        name: COEFFICIENT,
        meaning: "q, rad/s per m²/s²",
        bounds: [-1.0, 1.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Mount the gyro on damping foam, or sample it faster before it is filtered.",
};

/// Vibration rectification.
pub(super) struct VibrationRectification;

impl Driving for VibrationRectification {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&VibrationRectification)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for VibrationRectification {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [1e-4, 0.01], bounds: [-1.0, 1.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn touches(&self) -> Touches {
        Touches::GYRO
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([(COEFFICIENT.into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get(COEFFICIENT).copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        Needs { gyro: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        rate_rad_s + self.0 * at.speed_m_s * at.speed_m_s
    }
}
