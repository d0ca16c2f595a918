//! reading_i(t) = wheel_i(t - τ) of both wheels

use super::change::{Constant, Law, TIMED_ROWS};
use super::contract::Touches;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument};

/// Wheels that are stamped late.
pub(super) struct WheelDelay;

impl Law for WheelDelay {
    const ITSELF: &'static Self = &WheelDelay;
    #[cfg(test)]
    const TRIED: Tried = Tried::wheels(&[("delay_s", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "sensor.wheel_delay",
        title: "late wheels",
        equation: "reading_i(t) = wheel_i(t - τ) of both wheels",
        source: "Furgale et al., Unified temporal and spatial calibration for multi-sensor systems (2013)",
        channel: "wheels",
        deficient: "wheel measurement: it is stamped late against everything else",
        condition: Some("acceleration"),
        parameters: &[Parameter {
            name: "delay_s",
            meaning: "τ, s",
            bounds: [0.0, 0.4],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Stamp the counts where they are taken, or shift the wheels by the delay.",
    };
}

impl Constant for WheelDelay {
    const SCALE: [f64; 2] = [1e-3, 0.05];
    const IS_POSITIVE: bool = true;
    const LAGS: Option<Instrument> = Some(Instrument::Wheels);
    const USUAL_ROWS: f64 = TIMED_ROWS;
    const SIZES: &'static str = "Furgale et al. (2013): some milliseconds on a bus, some tens where messages queue";
    const TOUCHES: Touches = Touches::WHEELS;

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn delay_s(&self, instrument: Instrument) -> f64 {
        if instrument == Instrument::Wheels { self.0 } else { 0.0 }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::WheelDelay(self.0)
    }
}
