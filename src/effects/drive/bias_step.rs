//! b(t) = s for t ≥ t₁, else 0: the step of [`crate::effects`] at rest, in a drive

use super::contract::{DriveExplanation, Driving};
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameters};
use crate::effects::bias_step;
use crate::effects::parts::{Checked, stream};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Instrument, Moving};
use crate::model::{InFilter, Switch, Way};

/// The bias jumps once.
pub(super) struct BiasStep;

impl Driving for BiasStep {
    fn about(&self) -> &'static About {
        &bias_step::ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried::gyro(&[("step_rad_s", 0.01)])
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::GyroStep
    }

    fn on_log(&self, _: &Parameters) -> std::result::Result<OnLog, &'static str> {
        let value = "value + step_rad_s * (t >= t[0] + (t[-1] - t[0]) * rng.random())";
        Ok(OnLog::drawn(Stage::Bias, channels(Instrument::Gyro), value))
    }

    fn simulated(&self, parameters: &Parameters, span_s: f64, seed: u64) -> Result<Box<dyn DriveEffect>> {
        let checked = Checked::of(self.about(), parameters)?;
        let step_rad_s = checked.value(bias_step::STEP)?;
        Ok(match checked.optional(bias_step::TIME) {
            Some(at_s) => {
                Box::new(Step { step_rad_s, since_power_on_s: at_s, t_s: f64::NEG_INFINITY, drawn_over_s: None })
            }
            None => {
                let t_s = span_s * stream(self.about(), seed).uniform();
                Box::new(Step { step_rad_s, since_power_on_s: f64::NEG_INFINITY, t_s, drawn_over_s: Some(span_s) })
            }
        })
    }
}

struct Step {
    step_rad_s: f64,
    since_power_on_s: f64,
    t_s: f64,
    /// Span in which the time was drawn, s; `None` where the time is stated.
    drawn_over_s: Option<f64>,
}

impl DriveEffect for Step {
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        let after = at.since_power_on_s >= self.since_power_on_s && at.t_s >= self.t_s;
        if after { rate_rad_s + self.step_rad_s } else { rate_rad_s }
    }

    /// A step whose time is not stated: once a drive on average, and permanent.
    fn in_filter(&self) -> InFilter {
        let Some(span_s) = self.drawn_over_s else { return InFilter::Equations };
        let jumped = Way { offset: self.step_rad_s, ..Way::PLAIN };
        let rate_per_s = 1.0 / span_s.max(f64::MIN_POSITIVE);
        InFilter::GyroSwitch(Switch { ways: [Way::PLAIN, jumped], share: 1.0, rate_per_s, start: 0.0 })
    }
}
