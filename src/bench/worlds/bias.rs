//! bias(t) += strength · path(t): the listed effects that are signals
//!
//! None is the textbook's formula: ramps bend, exponentials stretch, temperature lags and its response bends, steps take
//! their time, tones breathe and wander, levels of telegraph noise are not exactly two.

use super::draw::{between, chance, exponential, gamma_halves, log_between, sign};
use super::effect::Effect;
use super::label::{Parameters, Place};
use super::run::{Run, Unit};
use crate::math::random::Stream;
use std::f64::consts::TAU;

fn named(pairs: &[(&str, f64)]) -> Parameters {
    pairs.iter().map(|(name, value)| ((*name).to_string(), *value)).collect()
}

/// a t (1 + b (t/span - 1)): the straight line through it has the slope a
pub(super) struct Ramp {
    bend: f64,
    sign: f64,
}

impl Ramp {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { bend: between(s, -0.06, 0.06), sign: sign(s) }
    }
}

impl Effect for Ramp {
    fn id(&self) -> &'static str {
        "gyro.rate_ramp"
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        let span_s = run.span_s();
        run.times_s().map(|t| self.sign * t * (1.0 + self.bend * (t / span_s - 1.0))).collect()
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-16, 1.0]
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("ramp_rad_s2", self.sign * strength)])
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("elapsed_time")
    }
}

/// a (1 - exp(-(t/T3)^β))
pub(super) struct SecondExponential {
    time_constant_s: f64,
    stretch: f64,
    sign: f64,
}

impl SecondExponential {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let time_constant_s = unit.time_constant_s * log_between(s, 0.05, 0.35);
        Self { time_constant_s, stretch: between(s, 0.88, 1.08), sign: sign(s) }
    }
}

impl Effect for SecondExponential {
    fn id(&self) -> &'static str {
        "gyro.second_time_constant"
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        let one = |t: f64| self.sign * -(-(t / self.time_constant_s).powf(self.stretch)).exp_m1();
        run.times_s().map(one).collect()
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("c3_rad_s", self.sign * strength), ("time_constant_s", self.time_constant_s)])
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("elapsed_time")
    }
}

/// a (x + b x²/10 °C), x the warming since power-on through one or two lags
pub(super) struct Temperature {
    lags_s: [f64; 2],
    bend: f64,
    sign: f64,
}

impl Temperature {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let first = if chance(s, 0.7) { log_between(s, 8.0, 150.0) } else { 0.0 };
        let second = if chance(s, 0.3) { 0.3 * first } else { 0.0 };
        Self { lags_s: [first, second], bend: between(s, -0.12, 0.12), sign: sign(s) }
    }

    fn lagged_c(&self, run: &Run) -> Vec<f64> {
        let mut x = run.warming_c();
        for lag_s in self.lags_s {
            if lag_s > 0.0 {
                let follow = -(-run.step_s() / lag_s).exp_m1();
                let mut state = 0.0;
                for c in &mut x {
                    state += follow * (*c - state);
                    *c = state;
                }
            }
        }
        x
    }
}

impl Effect for Temperature {
    fn id(&self) -> &'static str {
        "gyro.temperature_sensitivity"
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        self.lagged_c(run).into_iter().map(|x| self.sign * x * (1.0 + 0.1 * self.bend * x)).collect()
    }

    fn parameters(&self, run: &Run, path: &[f64], strength: f64) -> Parameters {
        named(&[("coefficient_rad_s_per_c", strength * slope(&self.lagged_c(run), path))])
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("temperature_c")
    }
}

/// Slope of the line through y over x.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len().max(1) as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let cross: f64 = x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum();
    let square: f64 = x.iter().map(|a| (a - mx).powi(2)).sum();
    if square > 0.0 { cross / square } else { 0.0 }
}

/// a (v + b v²/50 mV), v the supply less its value at power-on
pub(super) struct Supply {
    bend: f64,
    sign: f64,
}

impl Supply {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { bend: between(s, -0.1, 0.1), sign: sign(s) }
    }

    fn change_v(run: &Run) -> Vec<f64> {
        let first = run.supply_v.first().copied().unwrap_or(0.0);
        run.supply_v.iter().map(|v| v - first).collect()
    }
}

impl Effect for Supply {
    fn id(&self) -> &'static str {
        "gyro.supply_sensitivity"
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        Self::change_v(run).into_iter().map(|v| self.sign * v * (1.0 + self.bend * v / 0.05)).collect()
    }

    fn parameters(&self, run: &Run, path: &[f64], strength: f64) -> Parameters {
        named(&[("coefficient_rad_s_per_v", strength * slope(&Self::change_v(run), path))])
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place::following("supply_v")
    }
}

/// One jump at a time drawn in each run, exponential or logistic, over some seconds
pub(super) struct Step {
    settle_s: f64,
    logistic: bool,
    sign: f64,
}

impl Step {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { settle_s: log_between(s, 0.2, 12.0), logistic: chance(s, 0.5), sign: sign(s) }
    }
}

impl Effect for Step {
    fn id(&self) -> &'static str {
        "gyro.bias_step"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let at_s = between(s, 0.15, 0.85) * run.span_s();
        let one = |t: f64| {
            let x = (t - at_s) / self.settle_s;
            match self.logistic {
                true => 1.0 / (1.0 + (-2.0 * x).clamp(-700.0, 700.0).exp()),
                false => -(-x.max(0.0)).exp_m1(),
            }
        };
        run.times_s().map(|t| self.sign * one(t)).collect()
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("step_rad_s", self.sign * strength)])
    }

    fn place(&self, run: &Run, path: &[f64]) -> Place {
        let row = path.iter().position(|p| p.abs() >= 0.5).unwrap_or(0);
        Place { time_s: Some([run.time_s(row); 2]), ..Place::gyro() }
    }
}

/// a (1 + m sin(…)) cos(2π f t + φ(t)), φ wandering
pub(super) struct Tone {
    frequency_hz: f64,
    depth: f64,
    breath_s: f64,
    wander_rad: f64,
}

impl Tone {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let nyquist_hz = 0.5 / unit.step_s;
        let frequency_hz = if chance(s, 0.5) {
            log_between(s, 0.01, 0.95 * nyquist_hz)
        } else {
            between(s, 0.03 * nyquist_hz, 0.97 * nyquist_hz)
        };
        Self {
            frequency_hz,
            depth: between(s, 0.0, 0.12),
            breath_s: log_between(s, 200.0, 4000.0),
            wander_rad: between(s, 0.0, 0.5),
        }
    }
}

impl Effect for Tone {
    fn id(&self) -> &'static str {
        "gyro.tone"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let (start, breath) = (between(s, 0.0, TAU), between(s, 0.0, TAU));
        let walk = self.wander_rad / (run.len.max(1) as f64).sqrt();
        let mut phase = start;
        run.times_s()
            .map(|t| {
                phase += walk * s.normal();
                let loud = 1.0 + self.depth * (TAU * t / self.breath_s + breath).sin();
                loud * (TAU * self.frequency_hz * t + phase).cos()
            })
            .collect()
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("amplitude_rad_s", strength), ("frequency_hz", self.frequency_hz)])
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        Place { frequency_hz: Some([self.frequency_hz; 2]), ..Place::gyro() }
    }
}

/// C2 + a
pub(super) struct TurnOnShift {
    sign: f64,
}

impl TurnOnShift {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { sign: sign(s) }
    }
}

impl Effect for TurnOnShift {
    fn id(&self) -> &'static str {
        "gyro.turn_on_shift"
    }

    fn path(&self, run: &Run, _: &mut Stream) -> Vec<f64> {
        vec![self.sign; run.len]
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("shift_rad_s", self.sign * strength)])
    }
}

/// Two levels, their dwell times unequal and not exactly exponential, each visit a little off its level
pub(super) struct Telegraph {
    /// Mean dwell at the lower and the upper level, s.
    dwell_s: [f64; 2],
    /// Gamma shape in halves: 2 is exponential.
    halves: usize,
    jitter: f64,
}

impl Telegraph {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let mean_s = log_between(s, 4.0, 700.0);
        let uneven = log_between(s, 0.4, 2.5).sqrt();
        let norm = 0.5 * (uneven + 1.0 / uneven);
        Self {
            dwell_s: [mean_s * uneven / norm, mean_s / uneven / norm],
            halves: 1 + crate::bench::worlds::draw::index(s, 3),
            jitter: between(s, 0.0, 0.06),
        }
    }

    fn mean_dwell_s(&self) -> f64 {
        0.5 * (self.dwell_s[0] + self.dwell_s[1])
    }

    fn upper_share(&self) -> f64 {
        self.dwell_s[1] / (self.dwell_s[0] + self.dwell_s[1])
    }

    fn dwell(&self, level: usize, s: &mut Stream) -> f64 {
        let relative = if self.halves == 2 { exponential(s) } else { gamma_halves(s, self.halves) };
        self.dwell_s[level] * relative.max(1e-3)
    }

    pub(crate) fn once(&self, run: &Run, s: &mut Stream) -> (Vec<f64>, usize) {
        let dt = run.step_s();
        let mut level = usize::from(chance(s, self.upper_share()));
        let mut value = level as f64 + self.jitter * s.normal();
        let mut left_s = self.dwell(level, s) * s.uniform();
        let mut flips = 0;
        let path = (0..run.len)
            .map(|_| {
                // a sample is the mean over its interval, however often the level flips in it
                let (mut open_s, mut sum) = (dt, 0.0);
                while left_s < open_s {
                    sum += left_s * value;
                    open_s -= left_s;
                    level = 1 - level;
                    value = level as f64 + self.jitter * s.normal();
                    left_s = self.dwell(level, s);
                    flips += 1;
                }
                left_s -= open_s;
                (sum + open_s * value) / dt - self.upper_share()
            })
            .collect();
        (path, flips)
    }
}

impl Effect for Telegraph {
    fn id(&self) -> &'static str {
        "gyro.telegraph_noise"
    }

    /// A recording with less than three flips shows a step, not telegraph noise: such paths are drawn again.
    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let mut out = self.once(run, s);
        for _ in 0..50 {
            if out.1 >= 3 {
                break;
            }
            out = self.once(run, s);
        }
        out.0
    }

    /// PSD of a Markov chain of the same dwell times (Machlup, J. Appl. Phys. 25 (1954) 341).
    fn psd(&self, f_hz: f64) -> Option<f64> {
        let rate = 1.0 / self.dwell_s[0] + 1.0 / self.dwell_s[1];
        let variance = self.upper_share() * (1.0 - self.upper_share());
        Some(2.0 * variance * rate / (rate * rate + (TAU * f_hz).powi(2)))
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        named(&[("level_spacing_rad_s", strength), ("mean_dwell_s", self.mean_dwell_s())])
    }
}
