//! reading' = f(reading): an effect of a sensor on a log that was made without it, as an expression of Python with numpy.

use crate::model::drive::Instrument;
use crate::signal::names;

/// Place in the chain from the motion to the log; effects act in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The command, before the motors act on it.
    Command,
    /// The time of a reading.
    Delay,
    /// Its proportion.
    Gain,
    /// An addend, in the channel's unit.
    Bias,
    /// White noise.
    Noise,
    /// Loss in the recorder: digits, ticks.
    Recorder,
}

/// An effect on each of its channels in a log without it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnLog {
    /// Place in the chain.
    pub stage: Stage,
    /// Whether a log comes nearer to one recording by it: not by what is drawn anew in each run, nor by rounding.
    pub repeats: bool,
    /// Channels that it changes.
    pub channels: &'static [&'static str],
    /// The channel with the effect, as an expression in `value` (the channel without it; NaN where there is no reading), its `name`,
    /// `t` (s), the effect's parameters, the random generator `rng`, and four functions: `late(t, value, by_s, angle)`, the value `by_s`
    /// ago; `speed()`, what the wheels say, m/s; `std(name)`, the stated white noise of a reading; `bursts(t, rng, burst_s,
    /// share_of_time)`, 1 in rows that lie in bursts.
    pub value: &'static str,
}

/// Why an effect of the motion is in no log that was made without it.
pub(super) const UNTOLD: &str =
    "it changes how the robot moves, and a log made without it does not tell how that would have been";

/// Channels of an instrument.
pub(super) const fn channels(of: Instrument) -> &'static [&'static str] {
    match of {
        Instrument::Gyro => &[names::GYRO_Z],
        Instrument::Wheels => &[names::WHEEL_LEFT, names::WHEEL_RIGHT],
        Instrument::Pose => &[names::X, names::Y, names::HEADING],
    }
}

impl OnLog {
    /// A change that is the same in each run.
    pub(super) const fn new(stage: Stage, channels: &'static [&'static str], value: &'static str) -> Self {
        Self { stage, repeats: true, channels, value }
    }

    /// A change that is drawn anew in each run.
    pub(super) const fn drawn(stage: Stage, channels: &'static [&'static str], value: &'static str) -> Self {
        Self { stage, repeats: false, channels, value }
    }

    /// The readings of an instrument, `delay_s` late.
    pub(super) const fn late(of: Instrument) -> Self {
        Self::new(Stage::Delay, channels(of), "late(t, value, delay_s, angle=name == \"heading_rad\")")
    }

    /// Whether the expression uses the function `name`.
    #[must_use]
    pub fn uses(&self, name: &str) -> bool {
        self.value.contains(&format!("{name}("))
    }
}
