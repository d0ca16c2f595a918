//! g_r/g_l = 1 + γ, (g_l + g_r)/2 = 1

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "motor.torque_gain",
    title: "unequal motors",
    equation: "g_r/g_l = 1 + γ, their mean is 1",
    source: "Pillay and Krishnan, Modeling of permanent magnet motor drives (1988): the torque constant varies with magnet and temperature",
    channel: "torque",
    deficient: "equations of motion: right and left motors answer differently",
    condition: None,
    parameters: &[Parameter {
        name: "right_over_left_minus_one",
        meaning: "γ",
        bounds: [-0.9, 5.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Measure the current of each motor at the same command, and close the speed loop of each wheel.",
};

/// Unequal motors.
pub(super) struct TorqueGain;

impl Driving for TorqueGain {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&TorqueGain)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for TorqueGain {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [0.01, 0.3], bounds: [-0.9, 5.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("right_over_left_minus_one".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("right_over_left_minus_one").copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        let left = 2.0 / (2.0 + self.0);
        robot.torque_gain = [robot.torque_gain[0] * left, robot.torque_gain[1] * left * (1.0 + self.0)];
    }
}
