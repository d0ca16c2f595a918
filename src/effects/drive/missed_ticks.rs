//! reading_i = (1 - λ) reading_i inside bursts, which begin and end as a Markov chain of two states
//! reading_i = (1 - E[λ]) reading_i where single bursts are lost in noise: their mean is all that a drive can show

use super::contract::{Coordinate, DriveExplanation, Driving, ModelChange, TickLoss, Touches};
use super::loss::Lost;
use super::on_log::{OnLog, Stage, channels};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::effects::parts::{Checked, stream};
use crate::error::Result;
use crate::math::random::Stream;
use crate::model::drive::{DriveEffect, Instrument, Moving, Reading, Robot};
use crate::model::{InFilter, Switch, Way};

const LOSS: &str = "loss_fraction";
const SIDE: &str = "right";
const BURST: &str = "burst_s";
const SHARE: &str = "share_of_time";

/// Mean length of a burst where it is not stated, s, and share of the time in bursts.
const BURST_S: f64 = 0.3;
const SHARE_OF_TIME: f64 = 0.05;

static ABOUT: About = About {
    id: "encoder.missed_ticks",
    title: "missed encoder ticks",
    equation: "reading = (1 - λ) reading of one wheel inside bursts",
    source: "Borenstein, Everett and Feng, Where am I? (1996), section 1.1: encoders lose counts",
    channel: "wheel_left",
    deficient: "wheel measurement: one wheel reads low in bursts",
    condition: None,
    parameters: &[
        Parameter { name: LOSS, meaning: "λ inside a burst", bounds: [0.0, 1.0], null: Some(0.0), required: true },
        Parameter {
            name: SIDE,
            meaning: "1 for the right wheel, 0 for the left one; left where it is missing",
            bounds: [0.0, 1.0],
            null: None,
            required: false,
        },
        Parameter {
            name: BURST,
            meaning: "mean length of a burst, s",
            bounds: [1e-4, 1e5],
            null: None,
            required: false,
        },
        Parameter {
            name: SHARE,
            meaning: "share of the time that lies in bursts; 1 where λ is the mean over all of it",
            bounds: [0.0, 1.0],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Look at that encoder's cable, disc and interrupt load; compare its index pulse with the counts.",
};

/// One wheel reads low in bursts.
pub(super) struct MissedTicks;

impl Driving for MissedTicks {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    #[cfg(test)]
    fn tried(&self) -> Tried {
        Tried {
            optional: &[("share_of_time", 0.2)],
            moves: [false, true, false, false, false],
            ..Tried::wheels(&[("loss_fraction", 0.4)])
        }
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::MissedTicks(&MissedTicks)
    }

    fn channel(&self, parameters: &Parameters) -> &'static str {
        [ABOUT.channel, "wheel_right"][self.side(parameters)]
    }

    fn on_log(&self, parameters: &Parameters) -> std::result::Result<OnLog, &'static str> {
        let (left, right) = channels(Instrument::Wheels).split_at(1);
        let channels = [left, right][self.side(parameters)];
        Ok(match self.is_mean(parameters) {
            true => OnLog::new(Stage::Gain, channels, "value * (1 - loss_fraction)"),
            false if [BURST, SHARE].iter().any(|name| !parameters.contains_key(*name)) => {
                return Err("how long its bursts last, or which share of the time they take, is not told");
            }
            false => {
                let value = "value * (1 - loss_fraction * bursts(t, rng, burst_s, share_of_time))";
                OnLog::drawn(Stage::Recorder, channels, value)
            }
        })
    }

    fn simulated(&self, parameters: &Parameters, _: f64, seed: u64) -> Result<Box<dyn DriveEffect>> {
        let checked = Checked::of(&ABOUT, parameters)?;
        if self.is_mean(parameters) {
            let law = MEAN_LOSS[self.side(parameters)];
            return Ok(law.at(&law.theta(parameters)));
        }
        Ok(Box::new(Work {
            loss: checked.value(LOSS)?,
            side: self.side(parameters),
            burst_s: checked.optional(BURST).unwrap_or(BURST_S),
            share: checked.optional(SHARE).unwrap_or(SHARE_OF_TIME).clamp(0.0, 1.0 - 1e-6),
            lost: false,
            draw: stream(&ABOUT, seed),
        }))
    }
}

impl TickLoss for MissedTicks {
    fn mean(&self) -> &'static [&'static dyn ModelChange; 2] {
        &MEAN_LOSS
    }

    fn is_mean(&self, parameters: &Parameters) -> bool {
        parameters.get(SHARE).is_some_and(|share| *share >= 1.0)
    }

    fn side(&self, parameters: &Parameters) -> usize {
        usize::from(parameters.get(SIDE).is_some_and(|side| *side >= 0.5))
    }

    fn lost(&self, parameters: &Parameters) -> Option<Lost> {
        let value = |name: &str| parameters.get(name).copied();
        Some(Lost {
            loss: value(LOSS)?,
            side: self.side(parameters),
            length_s: value(BURST).unwrap_or(BURST_S),
            share: value(SHARE).unwrap_or(SHARE_OF_TIME).clamp(0.0, 1.0 - 1e-6),
        })
    }

    fn parameters(&self, lost: &Lost) -> Parameters {
        Parameters::from([
            (LOSS.into(), lost.loss),
            (SIDE.into(), lost.side as f64),
            (BURST.into(), lost.length_s),
            (SHARE.into(), lost.share),
        ])
    }
}

/// The mean loss of the left wheel, and of the right one.
static MEAN_LOSS: [&dyn ModelChange; 2] = [&MeanLoss(0), &MeanLoss(1)];

/// One wheel reads low on average, whenever.
struct MeanLoss(usize);

impl ModelChange for MeanLoss {
    fn coordinates(&self) -> &'static [Coordinate] {
        const { &[Coordinate { scale: [1e-3, 0.03], bounds: [0.0, 0.9] }] }
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Low { side: self.0, by: theta[0] })
    }

    fn touches(&self) -> Touches {
        Touches::WHEELS
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn positive(&self) -> usize {
        1
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([(LOSS.into(), theta[0]), (SIDE.into(), self.0 as f64), (SHARE.into(), 1.0)])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get(LOSS).copied().unwrap_or(0.0)]
    }
}

struct Low {
    side: usize,
    by: f64,
}

impl DriveEffect for Low {
    fn wheels_rad_s(&self, _: &Robot, _: &Moving, mut wheels_rad_s: [f64; 2]) -> [f64; 2] {
        wheels_rad_s[self.side] *= 1.0 - self.by;
        wheels_rad_s
    }
}

struct Work {
    loss: f64,
    side: usize,
    burst_s: f64,
    share: f64,
    lost: bool,
    draw: Stream,
}

impl DriveEffect for Work {
    fn recorded(&mut self, reading: &mut Reading) {
        let leave = 1.0 - (-reading.step_s / self.burst_s).exp();
        let enter = (leave * self.share / (1.0 - self.share)).min(1.0);
        let flip = self.draw.uniform() < if self.lost { leave } else { enter };
        self.lost ^= flip;
        if self.lost {
            reading.wheels_rad_s[self.side] *= 1.0 - self.loss;
        }
    }

    /// A burst begins at the rate leave · share/(1 - share), so that both rates together are 1/(burst (1 - share)).
    fn in_filter(&self) -> InFilter {
        let lost = Way { gain: 1.0 - self.loss, ..Way::PLAIN };
        let rate_per_s = 1.0 / (self.burst_s * (1.0 - self.share));
        InFilter::WheelSwitch(
            self.side,
            Switch { ways: [Way::PLAIN, lost], share: self.share, rate_per_s, start: self.share },
        )
    }
}
