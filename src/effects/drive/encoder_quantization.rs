//! reading = q · round(reading/q) of both wheels

use super::contract::{DriveExplanation, Driving};
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::effects::parts::Checked;
use crate::error::Result;
use crate::model::InFilter;
use crate::model::drive::{DriveEffect, Instrument, Reading};

const LSB: &str = "lsb_rad_s";

static ABOUT: About = About {
    id: "encoder.quantization",
    title: "quantized wheel speeds",
    equation: "reading = q · round(reading/q) of both wheels",
    source: "Widrow and Kollár, Quantization Noise (2008), chapter 3",
    channel: "wheels",
    deficient: "wheel measurement: the speeds are quantized",
    condition: None,
    parameters: &[Parameter { name: LSB, meaning: "q, rad/s", bounds: [0.0, 100.0], null: Some(0.0), required: true }],
    remedy: "Count ticks over a longer time, or time the edges: give ticks_per_revolution and log the counts.",
};

/// Wheel speeds on a lattice.
pub(super) struct EncoderQuantization;

impl Driving for EncoderQuantization {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::wheels(&[("lsb_rad_s", 0.1)])
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::WheelLattice
    }

    fn on_log(&self, _: &Parameters) -> std::result::Result<OnLog, &'static str> {
        Ok(OnLog::drawn(Stage::Recorder, channels(Instrument::Wheels), "lsb_rad_s * np.rint(value / lsb_rad_s)"))
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Ok(Box::new(Work(Checked::of(&ABOUT, parameters)?.value(LSB)?)))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn recorded(&mut self, reading: &mut Reading) {
        if self.0 > 0.0 {
            reading.wheels_rad_s = reading.wheels_rad_s.map(|w| self.0 * (w / self.0).round());
        }
    }

    fn in_filter(&self) -> InFilter {
        InFilter::WheelLattice(self.0)
    }
}
