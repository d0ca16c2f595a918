//! reading(t) = ω(t - τ)

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Moving};

static ABOUT: About = About {
    id: "sensor.gyro_delay",
    title: "late gyro",
    equation: "reading(t) = ω(t - τ)",
    source: "Furgale et al., Unified temporal and spatial calibration for multi-sensor systems (2013)",
    channel: "gyro",
    deficient: "gyro measurement: it lags the wheels",
    condition: Some("yaw_acceleration"),
    parameters: &[Parameter {
        name: "delay_s",
        meaning: "τ, s; negative where the gyro leads",
        bounds: [-0.4, 0.4],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Stamp the readings where they are taken, or shift the gyro by the delay.",
};

/// Late gyro.
pub(super) struct GyroDelay;

impl Driving for GyroDelay {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&GyroDelay)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for GyroDelay {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [1e-3, 0.05], bounds: [-0.4, 0.4] }]
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
        Parameters::from([("delay_s".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("delay_s").copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        Needs { gyro: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        let late = match at.past {
            Some(past) if self.0 > 0.0 => past.yaw_rate_rad_s(at.t_s - self.0, at.t_s, at.yaw_rate_rad_s),
            // ahead of its time, as far as the last acceleration tells
            _ => at.yaw_rate_rad_s - self.0 * at.yaw_acceleration_rad_s2,
        };
        rate_rad_s + late - at.yaw_rate_rad_s
    }

    fn in_filter(&self) -> InFilter {
        InFilter::GyroDelay(self.0)
    }
}
