//! reading(t) = [x, y, θ](t - τ) of the external reference

use super::change::{Constant, Law, TIMED_ROWS};
use super::contract::{Needs, Touches};
use super::on_log::OnLog;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument};

/// A reference that is stamped late.
pub(super) struct PoseDelay;

impl Law for PoseDelay {
    const ITSELF: &'static Self = &PoseDelay;
    const ON_LOG: Option<OnLog> = Some(OnLog::late(Instrument::Pose));
    #[cfg(test)]
    const TRIED: Tried = Tried::pose(&[("delay_s", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "sensor.pose_delay",
        title: "late reference",
        equation: "reading(t) = [x, y, θ](t - τ)",
        source: "Furgale et al., Unified temporal and spatial calibration for multi-sensor systems (2013)",
        channel: "pose",
        deficient: "pose measurement: it is stamped late against everything else",
        condition: Some("speed"),
        parameters: &[Parameter {
            name: "delay_s",
            meaning: "τ, s",
            bounds: [0.0, 0.4],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Put both hosts on one clock, or shift the reference by the delay.",
    };
}

impl Constant for PoseDelay {
    const SCALE: [f64; 2] = [1e-3, 0.05];
    const IS_POSITIVE: bool = true;
    const LAGS: Option<Instrument> = Some(Instrument::Pose);
    const USUAL_ROWS: f64 = TIMED_ROWS;
    const SIZES: &'static str = "Furgale et al. (2013): a camera is some tens of milliseconds late";
    const TOUCHES: Touches = Touches::POSE;
    const NEEDS: Needs = Needs { pose: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn delay_s(&self, instrument: Instrument) -> f64 {
        if instrument == Instrument::Pose { self.0 } else { 0.0 }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::PoseDelay(self.0)
    }
}
