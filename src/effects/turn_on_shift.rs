//! C2 := C2 + s, s far beyond the stated repeatability

use super::about::{About, Parameter, Parameters};
use super::effect::Effect;
use super::explanation::Explanation;
use super::parts::{Bias, Checked, RATE_BOUND_RAD_S};
#[cfg(test)]
use super::tried::Tried;
use crate::error::Result;
use crate::model::{GyroEffect, GyroInFilter, Scene};

const SHIFT: &str = "shift_rad_s";

static ABOUT: About = About {
    id: "gyro.turn_on_shift",
    title: "turn-on shift",
    equation: "e(t) + s: C2 lies outside its stated repeatability",
    source: "IEEE Std 1554-2005, turn-on to turn-on bias repeatability",
    channel: "gyro",
    deficient: "gyro bias: C2 is another",
    condition: None,
    parameters: &[Parameter {
        name: SHIFT,
        meaning: "s, mean of C2 above the nominal one, rad/s",
        bounds: [-RATE_BOUND_RAD_S, RATE_BOUND_RAD_S],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Fit C2 anew and state a wider turn_on_bias_std_rad_s, or measure the bias at rest before each drive.",
};

/// C2 is another.
pub(super) struct TurnOnShift;

impl Effect for TurnOnShift {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::size(&[("shift_rad_s", -0.125)])
    }

    fn separated_by(&self) -> Option<&'static str> {
        Some("five or more power-ons: their scatter tells a shifted mean from an unlucky draw")
    }

    fn simulated(&self, parameters: &Parameters, _: &Scene, _: u64) -> Result<Box<dyn GyroEffect>> {
        let shift = Checked::of(&ABOUT, parameters)?.value(SHIFT)?;
        Ok(Box::new(Bias(move |_, _: &Scene| shift, GyroInFilter::Known)))
    }

    fn explanation(&self, _: &Scene) -> Option<Explanation> {
        Some(Explanation::TurnOn)
    }
}
