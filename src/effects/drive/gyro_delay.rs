//! reading(t) = ω(t - τ)

use super::change::{Constant, Law, TIMED_ROWS};
use super::contract::{Needs, Touches};
use super::on_log::OnLog;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument, Moving};

/// Late gyro.
pub(super) struct GyroDelay;

impl Law for GyroDelay {
    const ITSELF: &'static Self = &GyroDelay;
    const ON_LOG: Option<OnLog> = Some(OnLog::late(Instrument::Gyro));
    #[cfg(test)]
    const TRIED: Tried = Tried::gyro(&[("delay_s", 0.03)]);
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
    const IS_POSITIVE: bool = true;
    const LAGS: Option<Instrument> = Some(Instrument::Gyro);
    const USUAL_ROWS: f64 = TIMED_ROWS;
    const SIZES: &'static str = "Furgale et al. (2013): some milliseconds on a bus, some tens where messages queue";
    const TOUCHES: Touches = Touches::GYRO;
    const NEEDS: Needs = Needs { gyro: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        rate_rad_s + at.ago(self.0).yaw_rate_rad_s - at.yaw_rate_rad_s
    }

    fn delay_s(&self, instrument: Instrument) -> f64 {
        if instrument == Instrument::Gyro { self.0 } else { 0.0 }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::GyroDelay(self.0)
    }
}
