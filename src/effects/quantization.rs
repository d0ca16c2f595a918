//! output = lsb · round(reading / lsb)
//!
//! Where lsb is small beside the noise, it acts as white noise of standard deviation lsb/√12 beside it.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::Explanation;
use super::parts::{Checked, RATE_BOUND_RAD_S};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const LSB: &str = "lsb_rad_s";

static ABOUT: About = About {
    id: "gyro.quantization",
    title: "quantization",
    equation: "output = lsb · round(reading/lsb): the output is quantized",
    source: "Widrow and Kollár, Quantization Noise, Cambridge 2008",
    channel: "gyro",
    deficient: "gyro measurement: the readings are quantized",
    condition: None,
    parameters: &[Parameter {
        name: LSB,
        meaning: "quantization step, rad/s",
        bounds: [0.0, RATE_BOUND_RAD_S],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Choose a smaller full-scale range or a register with more bits; else add lsb²/12 to the measurement noise.",
};

/// The output lies on a lattice.
pub(super) struct Quantization;

struct Lattice {
    lsb_rad_s: f64,
}

impl GyroEffect for Lattice {
    fn output(&mut self, _: usize, reading_rad_s: f64) -> f64 {
        if self.lsb_rad_s > 0.0 { (reading_rad_s / self.lsb_rad_s).round() * self.lsb_rad_s } else { reading_rad_s }
    }

    fn in_filter(&self) -> GyroInFilter {
        GyroInFilter::White(self.lsb_rad_s * self.lsb_rad_s / 12.0)
    }
}

impl Effect for Quantization {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("lsb_rad_s", 0.25)])
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        Ok(Box::new(Lattice { lsb_rad_s: Checked::of(&ABOUT, parameters)?.value(LSB)? }))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Lattice)
    }
}
