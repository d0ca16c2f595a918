//! reading = ω + |ω|/2 (a - Σ_i s_i exp(-|ω|/w_i)),  w = 0.02, 0.1 rad/s
//!
//! The gain may change gradually between left and right turns: s_i is the part of a that is missing at small rates.

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs, Touches};
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Instrument, Moving};

const RELATIVE: &str = "relative";
const SOFT: [&str; 2] = ["soft_part", "softer_part"];
/// Rates over which the gain may change, rad/s: 1 and 6 degrees a second.
const WIDTHS_RAD_S: [f64; 2] = [0.02, 0.1];

static ABOUT: About = About {
    id: "gyro.scale_asymmetry",
    title: "gyro scale asymmetry",
    equation: "reading = ω + |ω|/2 (a - s₁ exp(-|ω|/0.02) - s₂ exp(-|ω|/0.1)): the gain differs between left and right turns, and \
               may change gradually between them",
    source: "IEEE Std 952-1997, asymmetry error",
    channel: "gyro",
    deficient: "gyro measurement: its gain differs between left and right turns",
    condition: Some("yaw_rate"),
    parameters: &[
        Parameter {
            name: RELATIVE,
            meaning: "a, gain at positive rate minus gain at negative rate",
            bounds: [-0.9, 0.9],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: SOFT[0],
            meaning: "s₁, what of a is missing below about 0.02 rad/s",
            bounds: [-1.8, 1.8],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: SOFT[1],
            meaning: "s₂, what of a is missing below about 0.1 rad/s",
            bounds: [-1.8, 1.8],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Turn the robot by ten full turns each way and enter both gains.",
};

/// Gyro scale asymmetry.
pub(super) struct ScaleAsymmetry;

impl Law for ScaleAsymmetry {
    const ITSELF: &'static Self = &ScaleAsymmetry;
    const ON_LOG: Option<OnLog> = Some(OnLog::new(
        Stage::Gain,
        channels(Instrument::Gyro),
        "value + np.abs(value) / 2 * (relative - soft_part * np.exp(-np.abs(value) / 0.02) - softer_part * np.exp(-np.abs(value) / 0.1))",
    ));
    #[cfg(test)]
    const TRIED: Tried = Tried::gyro(&[("relative", 0.03)]);
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for ScaleAsymmetry {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [1e-3, 0.05], bounds: [-0.9, 0.9] },
            Coordinate { scale: [5e-4, 0.025], bounds: [-1.8, 1.8] },
            Coordinate { scale: [5e-4, 0.025], bounds: [-1.8, 1.8] },
        ]
    }

    fn sizes(&self) -> &'static str {
        "IEEE Std 952-1997: scale factor asymmetry, at most what the scale factor itself is off by"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1], theta[2]]))
    }

    fn touches(&self) -> Touches {
        Touches::GYRO
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        [RELATIVE, SOFT[0], SOFT[1]].into_iter().map(String::from).zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        [RELATIVE, SOFT[0], SOFT[1]].map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn needs(&self) -> Needs {
        Needs { gyro: true, ..Needs::NOTHING }
    }
}

struct Work([f64; 3]);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, _: &Moving, rate_rad_s: f64) -> f64 {
        let [relative, soft @ ..] = self.0;
        let rate = rate_rad_s.abs();
        // mostly both are zero, and the filter reads the gyro several times a row
        let part = |(s, width): (&f64, f64)| if *s == 0.0 { 0.0 } else { s * (-rate / width).exp() };
        let missing: f64 = soft.iter().zip(WIDTHS_RAD_S).map(part).sum();
        rate_rad_s + 0.5 * rate * (relative - missing)
    }
}
