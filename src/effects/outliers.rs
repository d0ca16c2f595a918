//! output = reading ± A with probability p, either sign alike; else the reading
//!
//! A is `amplitude_rad_s`, and 20 nominal standard deviations of the white noise where it is not stated: beyond doubt, and
//! far from what a transmission error would give. The engine fits its own distribution of the rare samples.

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::{Explanation, InDrives};
use super::parts::{Checked, RATE_BOUND_RAD_S, stream, white_std_rad_s};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::math::random::Stream;
use crate::model::{GyroEffect, GyroInFilter, Scene, Switch, Way};

const PROBABILITY: &str = "probability_per_sample";
const AMPLITUDE: &str = "amplitude_rad_s";

static ABOUT: About = About {
    id: "gyro.outliers",
    title: "outliers",
    equation: "output = reading ± A with probability p a sample: rare samples far from the others",
    source: "Tukey, A survey of sampling from contaminated distributions (1960); Huber, Robust Statistics (1981)",
    channel: "gyro",
    deficient: "gyro measurement: rare samples are false",
    condition: None,
    parameters: &[
        Parameter {
            name: PROBABILITY,
            meaning: "p, of a sample to be false",
            bounds: [0.0, 0.5],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: AMPLITUDE,
            meaning: "A, rad/s; without it, 20 standard deviations of the white noise",
            bounds: [0.0, RATE_BOUND_RAD_S],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Check bus, timing and supply of the sensor, and reject samples by a gate on the innovation.",
};

/// A where it is not stated, in standard deviations of the white noise.
const AMPLITUDE_IN_WHITE_STD: f64 = 20.0;

/// Rare samples are false.
pub(super) struct Outliers;

struct Contaminated {
    probability: f64,
    amplitude_rad_s: f64,
    draw: Stream,
}

impl GyroEffect for Contaminated {
    fn output(&mut self, _: usize, reading_rad_s: f64) -> f64 {
        // two numbers a sample, so that another p falls on a subset or superset of the same samples
        let (chance, sign) = (self.draw.uniform(), self.draw.uniform());
        match chance < self.probability {
            true if sign < 0.5 => reading_rad_s - self.amplitude_rad_s,
            true => reading_rad_s + self.amplitude_rad_s,
            false => reading_rad_s,
        }
    }

    fn in_filter(&self) -> GyroInFilter {
        let false_one = Way { variance: self.amplitude_rad_s * self.amplitude_rad_s, ..Way::PLAIN };
        let share = self.probability;
        let each = f64::INFINITY;
        GyroInFilter::Switching(Switch { ways: [Way::PLAIN, false_one], share, rate_per_s: each, start: share })
    }
}

impl Effect for Outliers {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("probability_per_sample", 0.01)])
    }

    fn simulated(&self, parameters: &Parameters, scene: &Scene, seed: u64) -> Result<Box<dyn GyroEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        let usual = AMPLITUDE_IN_WHITE_STD * white_std_rad_s(scene);
        Ok(Box::new(Contaminated {
            probability: checked.value(PROBABILITY)?,
            amplitude_rad_s: checked.optional(AMPLITUDE).unwrap_or(usual),
            draw: stream(&ABOUT, seed),
        }))
    }

    fn in_drives(&self) -> Option<InDrives> {
        Some(InDrives::Outliers)
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::Outliers { usual_size: AMPLITUDE_IN_WHITE_STD })
    }
}
