//! reading = (1 + k) ω

use super::change::{Constant, Law};
use super::contract::{Equivalent, Needs, Touches};
use super::equivalent::{Map, Within};
use super::on_log::{OnLog, Stage, channels};
use super::radius_scale::RadiusScale;
use super::track_width::TrackWidth;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Instrument, Moving};

/// Gyro scale factor.
pub(super) struct ScaleFactor;

impl Law for ScaleFactor {
    const ITSELF: &'static Self = &ScaleFactor;
    const ON_LOG: Option<OnLog> = Some(OnLog::new(Stage::Gain, channels(Instrument::Gyro), "value * (1 + relative)"));
    #[cfg(test)]
    const TRIED: Tried = Tried::gyro(&[("relative", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "gyro.scale_factor",
        title: "gyro scale factor",
        equation: "reading = (1 + k) ω",
        source: "IEEE Std 952-1997, scale factor error",
        channel: "gyro",
        deficient: "gyro measurement: its gain",
        condition: Some("yaw_rate"),
        parameters: &[Parameter {
            name: "relative",
            meaning: "k",
            bounds: [-0.9, 9.0],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Turn the robot by ten full turns against a mark and enter the gain.",
    };
}

impl Constant for ScaleFactor {
    const SCALE: [f64; 2] = [1e-3, 0.03];
    const SIZES: &'static str =
        "MPU-6000 data sheet, revision 3.4 (2013): sensitivity within 3 %, and 2 % more over temperature";
    const TOUCHES: Touches = Touches::GYRO;
    const NEEDS: Needs = Needs { gyro: true, ..Needs::NOTHING };
    const EQUIVALENTS: &'static [Equivalent] = &[
        Equivalent { effect: &TrackWidth, map: Map::Inverse, side: 0, within: Within::GyroAndWheels },
        Equivalent { effect: &RadiusScale, map: Map::Same, side: 0, within: Within::GyroAndWheels },
    ];

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, _: &Moving, rate_rad_s: f64) -> f64 {
        rate_rad_s * (1.0 + self.0)
    }
}
