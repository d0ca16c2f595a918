//! bias(t) += strength · path(t): effects that are in no list, as real units and places have them
//!
//! A diagnosis that names one of the listed effects for these is wrong: it should say 'unknown'.

use super::draw::{between, chance, exponential, log_between, sign};
use super::effect::Effect;
use super::label::Place;
use super::run::{Run, Unit};
use crate::math::random::Stream;
use std::f64::consts::TAU;

/// A sinusoid whose frequency runs over the log from one end to the other, linearly or by a constant factor a second
pub(super) struct Chirp {
    from_hz: f64,
    to_hz: f64,
    by_factor: bool,
}

impl Chirp {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let nyquist_hz = 0.5 / unit.step_s;
        let from_hz = log_between(s, 0.002, 0.3 * nyquist_hz);
        let to_hz = (from_hz * log_between(s, 1.5, 8.0)).min(0.95 * nyquist_hz);
        let (from_hz, to_hz) = if chance(s, 0.5) { (from_hz, to_hz) } else { (to_hz, from_hz) };
        Self { from_hz, to_hz, by_factor: chance(s, 0.5) }
    }
}

impl Effect for Chirp {
    fn id(&self) -> &'static str {
        "x.chirp"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let (span_s, start) = (run.span_s(), between(s, 0.0, TAU));
        let rate = (self.to_hz / self.from_hz).ln();
        let cycles = |t: f64| match self.by_factor {
            true => self.from_hz * span_s / rate * (rate * t / span_s).exp_m1(),
            false => self.from_hz * t + 0.5 * (self.to_hz - self.from_hz) * t * t / span_s,
        };
        run.times_s().map(|t| (TAU * cycles(t) + start).cos()).collect()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place { frequency_hz: Some([self.from_hz.min(self.to_hz), self.from_hz.max(self.to_hz)]), ..Place::gyro() }
    }
}

/// Wave forms of [`Periodic`].
#[derive(Clone, Copy)]
pub(super) enum Wave {
    /// Up for this share of the period.
    Pulse(f64),
    /// Rises, and falls at once.
    Saw,
    /// Up half of the time.
    Square,
}

/// A periodic bias that is no sinusoid, its edges rounded over a sample or two
pub(super) struct Periodic {
    id: &'static str,
    wave: Wave,
    period_s: f64,
    sign: f64,
}

impl Periodic {
    pub(crate) fn pulses(s: &mut Stream) -> Self {
        let wave = Wave::Pulse(log_between(s, 0.01, 0.12));
        Self { id: "x.pulse_train", wave, period_s: log_between(s, 15.0, 300.0), sign: sign(s) }
    }

    pub(crate) fn saw(s: &mut Stream) -> Self {
        Self { id: "x.sawtooth", wave: Wave::Saw, period_s: log_between(s, 60.0, 1500.0), sign: sign(s) }
    }

    pub(crate) fn square(s: &mut Stream) -> Self {
        Self { id: "x.square_wave", wave: Wave::Square, period_s: log_between(s, 60.0, 1500.0), sign: 1.0 }
    }
}

impl Effect for Periodic {
    fn id(&self) -> &'static str {
        self.id
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let start = s.uniform();
        let mut smooth = 0.0;
        run.times_s()
            .map(|t| {
                let phase = (t / self.period_s + start).fract();
                let raw = match self.wave {
                    Wave::Pulse(share) => f64::from(u8::from(phase < share)),
                    Wave::Saw => phase - 0.5,
                    Wave::Square => f64::from(u8::from(phase < 0.5)) - 0.5,
                };
                smooth += 0.7 * (raw - smooth);
                self.sign * smooth
            })
            .collect()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place { frequency_hz: Some([1.0 / self.period_s; 2]), ..Place::gyro() }
    }
}

/// Variable of the surroundings that the bias follows, as [`Response`] has it.
#[derive(Clone, Copy)]
pub(super) enum Law {
    /// The sign of the temperature's rate, after a lag: hysteresis of a package under stress.
    Hysteresis,
    /// The temperature's rate: a gradient across the die.
    Rate,
    /// The supply below a threshold: a regulator that leaves its range.
    Threshold,
}

/// A bias that follows temperature or supply otherwise than by a slope
pub(super) struct Response {
    law: Law,
    lag_s: f64,
    share: f64,
    sign: f64,
}

impl Response {
    pub(crate) fn draw(law: Law, s: &mut Stream) -> Self {
        Self { law, lag_s: between(s, 15.0, 90.0), share: between(s, 0.3, 0.6), sign: sign(s) }
    }

    /// Rate of the temperature, °C/s, over about half a minute.
    fn rate_c_s(run: &Run) -> Vec<f64> {
        let half = (15.0 / run.step_s()) as usize;
        let c = &run.temperature_c;
        let last = c.len().saturating_sub(1);
        (0..c.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(half), (i + half).min(last));
                (c[b] - c[a]) / (run.step_s() * (b - a).max(1) as f64)
            })
            .collect()
    }
}

impl Effect for Response {
    fn id(&self) -> &'static str {
        match self.law {
            Law::Hysteresis => "x.hysteresis",
            Law::Rate => "x.temperature_rate",
            Law::Threshold => "x.supply_threshold",
        }
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        let follow = -(-run.step_s() / self.lag_s).exp_m1();
        let mut state = 0.0;
        let lagged = |x: Vec<f64>, state: &mut f64| -> Vec<f64> {
            x.into_iter()
                .map(|x| {
                    *state += follow * (x - *state);
                    self.sign * *state
                })
                .collect()
        };
        match self.law {
            Law::Hysteresis => {
                let rate = Self::rate_c_s(run).into_iter().map(|r| (r / 3e-4).tanh()).collect();
                lagged(rate, &mut state)
            }
            Law::Rate => {
                let rate = Self::rate_c_s(run);
                state = rate.first().copied().unwrap_or(0.0);
                lagged(rate, &mut state)
            }
            Law::Threshold => {
                // of the unit, not of the run: a voltage under which the supply comes as the battery empties
                let threshold = run.unit.supply_v - self.share * (run.unit.supply_sag_v + run.unit.load_step_v);
                run.supply_v.iter().map(|v| self.sign * (threshold - v).max(0.0)).collect()
            }
        }
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following(match self.law {
            Law::Hysteresis | Law::Rate => "temperature_rate",
            Law::Threshold => "supply_v",
        })
    }
}

/// Shots at random times that relax: Σ size exp(-(t - t_i)/τ)
pub(super) struct Shots {
    every_s: f64,
    relax_s: f64,
    sign: f64,
}

impl Shots {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { every_s: log_between(s, 150.0, 1200.0), relax_s: log_between(s, 4.0, 60.0), sign: sign(s) }
    }
}

impl Effect for Shots {
    fn id(&self) -> &'static str {
        "x.shot_relaxation"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let keep = (-run.step_s() / self.relax_s).exp();
        let mut next_s = self.every_s * exponential(s).min(2.0);
        let mut x = 0.0;
        run.times_s()
            .map(|t| {
                x *= keep;
                while t >= next_s {
                    x += 0.3 + exponential(s);
                    next_s += self.every_s * exponential(s);
                }
                self.sign * x
            })
            .collect()
    }
}

/// exp(-t/τ) cos(2π t/P + φ) after power-on: a loop that settles
pub(super) struct Ringing {
    decay_s: f64,
    period_s: f64,
}

impl Ringing {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let period_s = unit.time_constant_s * log_between(s, 0.15, 0.8);
        Self { decay_s: period_s * between(s, 1.0, 4.0), period_s }
    }
}

impl Effect for Ringing {
    fn id(&self) -> &'static str {
        "x.ringing_after_power_on"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let phase = between(s, 0.0, TAU);
        let one = |t: f64| (-t / self.decay_s).exp() * (TAU * t / self.period_s + phase).cos();
        run.times_s().map(one).collect()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place { time_s: Some([0.0, 3.0 * self.decay_s]), ..Place::gyro() }
    }
}

/// A carrier under an envelope that comes and goes: bursts of vibration, far from one line
pub(super) struct Bursts {
    carrier_hz: f64,
    burst_s: f64,
    pause_s: f64,
}

impl Bursts {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let carrier_hz = log_between(s, 0.1, 0.45 / unit.step_s);
        let burst_s = log_between(s, 10.0, 60.0) / carrier_hz.max(0.5);
        Self { carrier_hz, burst_s, pause_s: burst_s * log_between(s, 2.0, 10.0) }
    }
}

impl Effect for Bursts {
    fn id(&self) -> &'static str {
        "x.modulated_tone"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let mut phase = between(s, 0.0, TAU);
        let (mut on, mut until_s, mut loud) = (false, self.pause_s * s.uniform(), 0.0);
        let follow = -(-4.0 * run.step_s() / self.burst_s).exp_m1();
        run.times_s()
            .map(|t| {
                while t >= until_s {
                    on = !on;
                    until_s += exponential(s) * if on { self.burst_s } else { self.pause_s };
                    if on {
                        // each burst starts at a phase of its own
                        phase = between(s, 0.0, TAU);
                    }
                }
                loud += follow * (f64::from(u8::from(on)) - loud);
                loud * (TAU * self.carrier_hz * t + phase).cos()
            })
            .collect()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place { frequency_hz: Some([0.9, 1.1].map(|x| x * self.carrier_hz)), ..Place::gyro() }
    }
}
