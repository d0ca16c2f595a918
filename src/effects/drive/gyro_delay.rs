//! reading(t) = ω(t - τ)

use super::change::{Constant, Law};
use super::{Needs, Touches};
use crate::effects::{About, Parameter};
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Moving};

/// Late gyro.
pub(super) struct GyroDelay;

impl Law for GyroDelay {
    const ITSELF: &'static Self = &GyroDelay;
    const ABOUT: &'static About = &About {
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
}

impl Constant for GyroDelay {
    const SCALE: [f64; 2] = [1e-3, 0.05];
    const TOUCHES: Touches = Touches::GYRO;
    const NEEDS: Needs = Needs { gyro: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
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
