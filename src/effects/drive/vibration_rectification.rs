//! reading = ω + q v² + q₃ v² (|v| - 0.7 m/s) - p d(v²)/dt

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs, Touches};
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Instrument, Moving};

const COEFFICIENT: &str = "coefficient_rad_s_per_m2_s2";
const BEND: &str = "bend_rad_s_per_m3_s3";
const LATE: &str = "late_part_rad_per_m2_s2";
/// Speed at which the bend changes nothing: q is what the robot sees where it mostly drives, m/s.
const TYPICAL_M_S: f64 = 0.7;

static ABOUT: About = About {
    id: "gyro.vibration_rectification",
    title: "vibration rectification",
    equation: "reading = ω + q v² + q₃ v² (|v| - 0.7 m/s) - p d(v²)/dt: vibration grows with speed, not quite as its square, \
               and shifts the bias, a little late",
    source: "IEEE Std 1431-2004, vibration rectification error",
    channel: "gyro",
    deficient: "gyro measurement: its bias grows with speed squared",
    condition: Some("speed"),
    parameters: &[
        Parameter {
            name: COEFFICIENT,
            meaning: "q, rad/s per m²/s²",
            bounds: [-1.0, 1.0],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: BEND,
            meaning: "q₃, how growth departs from the square, rad/s per m³/s³",
            bounds: [-1.0, 1.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: LATE,
            meaning: "p, q times the time by which the bias is late, rad per m²/s²",
            bounds: [-1.0, 1.0],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Mount the gyro on damping foam, or sample it faster before it is filtered.",
};

/// Vibration rectification.
pub(super) struct VibrationRectification;

impl Law for VibrationRectification {
    const ITSELF: &'static Self = &VibrationRectification;
    const ON_LOG: Option<OnLog> = Some(OnLog::new(
        Stage::Bias,
        channels(Instrument::Gyro),
        "value + speed() ** 2 * (coefficient_rad_s_per_m2_s2 + bend_rad_s_per_m3_s3 * (np.abs(speed()) - 0.7)) \
         - late_part_rad_per_m2_s2 * np.gradient(speed() ** 2, t)",
    ));
    #[cfg(test)]
    const TRIED: Tried = Tried::gyro(&[("coefficient_rad_s_per_m2_s2", 0.01)]);
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for VibrationRectification {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [1e-4, 0.05], bounds: [-1.0, 1.0] },
            Coordinate { scale: [3e-5, 0.015], bounds: [-1.0, 1.0] },
            Coordinate { scale: [3e-5, 0.015], bounds: [-1.0, 1.0] },
        ]
    }

    fn sizes(&self) -> &'static str {
        "Weinberg, Gyro mechanical performance: the most important parameter, Analog Devices MS-2158 (2011)"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1], theta[2]]))
    }

    fn touches(&self) -> Touches {
        Touches::GYRO
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        [COEFFICIENT, BEND, LATE].into_iter().map(String::from).zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        [COEFFICIENT, BEND, LATE].map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn needs(&self) -> Needs {
        Needs { gyro: true, ..Needs::NOTHING }
    }
}

struct Work([f64; 3]);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        let [square, bend, late] = self.0;
        let speed = at.speed_m_s.abs();
        let changes = 2.0 * at.speed_m_s * at.acceleration_m_s2;
        rate_rad_s + speed * speed * (square + bend * (speed - TYPICAL_M_S)) - late * changes
    }
}
