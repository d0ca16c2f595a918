//! g_r/g_l = 1 + γ, (g_l + g_r)/2 = 1

use super::change::{Constant, Law};
use super::contract::Needs;
use super::on_log::{OnLog, Stage};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};
use crate::signal::names;

/// Unequal motors.
pub(super) struct TorqueGain;

impl Law for TorqueGain {
    const ITSELF: &'static Self = &TorqueGain;
    const ON_LOG: Option<OnLog> = Some(OnLog::new(
        Stage::Command,
        &[names::TORQUE_LEFT, names::TORQUE_RIGHT],
        "value * 2 * (1 + right_over_left_minus_one * name.startswith(\"torque_right\")) / (2 + right_over_left_minus_one)",
    ));
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("right_over_left_minus_one", 0.05)]);
    const ABOUT: &'static About = &About {
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
}

impl Constant for TorqueGain {
    const SCALE: [f64; 2] = [0.01, 0.3];
    const SIZES: &'static str = "Pillay and Krishnan (1988): a magnet loses up to a fifth of its flux when it is hot";
    const NEEDS: Needs = Needs { torques: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        let left = 2.0 / (2.0 + self.0);
        robot.torque_gain = [robot.torque_gain[0] * left, robot.torque_gain[1] * left * (1.0 + self.0)];
    }
}
