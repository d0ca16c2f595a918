//! bias(t) += strength · random path: the listed effects that are coloured noises, each in continuous time
//!
//! Integrated over ten substeps a sample and averaged over it, as a sensor does.

use super::draw::{between, log_between};
use super::effect::Effect;
use super::label::{Parameters, Place};
use super::run::{Run, Unit};
use crate::math::random::Stream;
use std::f64::consts::{PI, TAU};

/// Substeps of a sample.
const SUBSTEPS: usize = 10;

/// Rate random walk: dx = K dW - x/leak dt, steps with tails a little heavier than normal
pub(super) struct RandomWalk {
    /// Length of the memory over that of the log: a walk in a case leans home in the end.
    leak: f64,
    tails: f64,
}

impl RandomWalk {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self { leak: log_between(s, 4.0, 60.0), tails: between(s, 0.0, 0.5) }
    }
}

impl Effect for RandomWalk {
    fn id(&self) -> &'static str {
        "gyro.rate_random_walk"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let h = run.step_s() / SUBSTEPS as f64;
        let keep = (-h / (self.leak * run.span_s())).exp();
        // a scale mixture of two normals with variance one
        let (calm, wild) = ((1.0 - self.tails).sqrt(), (1.0 + 3.0 * self.tails).sqrt());
        let mut x = 0.0;
        (0..run.len)
            .map(|_| {
                let mut sum = 0.0;
                let scale = if s.uniform() < 0.25 { wild } else { calm };
                for _ in 0..SUBSTEPS {
                    x = keep * x + h.sqrt() * scale * s.normal();
                    sum += x;
                }
                sum / SUBSTEPS as f64
            })
            .collect()
    }

    fn psd(&self, f_hz: f64) -> Option<f64> {
        Some(1.0 / (TAU * f_hz).powi(2))
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-14, 1.0]
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("rate_random_walk_rad_s_sqrt_s".to_string(), strength)].into()
    }
}

/// Gauss-Markov: an Ornstein-Uhlenbeck process through a short lag, so that its paths are smooth at the finest
pub(super) struct GaussMarkov {
    correlation_time_s: f64,
    lag_s: f64,
}

impl GaussMarkov {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let correlation_time_s = log_between(s, 3.0, 300.0);
        Self { correlation_time_s, lag_s: correlation_time_s * between(s, 0.0, 0.12) }
    }

    /// Variance of an OU process of unit variance after the lag.
    fn variance(&self) -> f64 {
        self.correlation_time_s / (self.correlation_time_s + self.lag_s)
    }
}

impl Effect for GaussMarkov {
    fn id(&self) -> &'static str {
        "gyro.gauss_markov"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let h = run.step_s() / SUBSTEPS as f64;
        let keep = (-h / self.correlation_time_s).exp();
        let fresh = -(-2.0 * h / self.correlation_time_s).exp_m1();
        let follow = if self.lag_s > h { -(-h / self.lag_s).exp_m1() } else { 1.0 };
        let norm = self.variance().sqrt();
        let mut x = s.normal();
        let mut lagged = x * self.variance();
        (0..run.len)
            .map(|_| {
                let mut sum = 0.0;
                for _ in 0..SUBSTEPS {
                    x = keep * x + fresh.sqrt() * s.normal();
                    lagged += follow * (x - lagged);
                    sum += lagged;
                }
                sum / SUBSTEPS as f64 / norm
            })
            .collect()
    }

    fn psd(&self, f_hz: f64) -> Option<f64> {
        let w2 = (TAU * f_hz).powi(2);
        let (a, b) = (self.correlation_time_s, self.lag_s);
        Some(2.0 * a / (1.0 + w2 * a * a) / (1.0 + w2 * b * b) / self.variance())
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("correlation_time_s".to_string(), self.correlation_time_s), ("std_rad_s".to_string(), strength)].into()
    }
}

/// 1/f noise: a sum of Ornstein-Uhlenbeck processes whose time constants grow by a factor (McWhorter's surface traps)
///
/// psd(f) = Σ_j 2 v_j τ_j / (1 + (2π f τ_j)²), τ_j from half a sample to three logs, v_j ~ τ_j^(slope - 1).
pub(super) struct Flicker {
    times_s: Vec<f64>,
    variances: Vec<f64>,
}

impl Flicker {
    pub(crate) fn draw(step_s: f64, s: &mut Stream) -> Self {
        let factor = between(s, 2.2, 3.2);
        let slope = between(s, 0.93, 1.07);
        let mut times_s = vec![0.5 * step_s * between(s, 0.5, 1.5)];
        while let Some(last) = times_s.last().filter(|t| **t < 25_000.0) {
            times_s.push(last * factor);
        }
        let variances = times_s.iter().map(|t| t.powf(slope - 1.0) * between(s, 0.85, 1.15)).collect();
        let mut out = Self { times_s, variances };
        // unit strength: B = 1 in the middle of the band, where a log of hours shows it
        let middle = 0.003;
        let b2 = (-2..=2).map(|i| {
            let f = middle * 2.0_f64.powi(i);
            TAU * f * out.sum(f)
        });
        let b2 = b2.sum::<f64>() / 5.0;
        out.variances.iter_mut().for_each(|v| *v /= b2);
        out
    }

    fn sum(&self, f_hz: f64) -> f64 {
        let one = |(t, v): (&f64, &f64)| 2.0 * v * t / (1.0 + (TAU * f_hz * t).powi(2));
        self.times_s.iter().zip(&self.variances).map(one).sum()
    }
}

impl Effect for Flicker {
    fn id(&self) -> &'static str {
        "gyro.bias_instability"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let dt = run.step_s();
        let steps: Vec<[f64; 2]> = self
            .times_s
            .iter()
            .zip(&self.variances)
            .map(|(t, v)| [(-dt / t).exp(), (v * -(-2.0 * dt / t).exp_m1()).sqrt()])
            .collect();
        let mut state: Vec<f64> = self.variances.iter().map(|v| v.sqrt() * s.normal()).collect();
        (0..run.len)
            .map(|_| {
                for (x, [keep, fresh]) in state.iter_mut().zip(&steps) {
                    *x = keep * *x + fresh * s.normal();
                }
                state.iter().sum()
            })
            .collect()
    }

    fn psd(&self, f_hz: f64) -> Option<f64> {
        Some(self.sum(f_hz))
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("bias_instability_rad_s".to_string(), strength)].into()
    }
}

/// Narrow-band noise: a resonance that white noise drives, its centre wandering about the middle of a band
///
/// x = Re(z exp(iφ)), z a phasor that forgets with the rate π w, dφ/dt = 2π (f + s u(t)), u an Ornstein-Uhlenbeck process of
/// unit variance: one line at each moment, a band over the log.
pub(super) struct NarrowBand {
    center_hz: f64,
    /// w, Hz.
    line_hz: f64,
    /// s, Hz, and the time over which u forgets, s.
    wander_hz: f64,
    wander_s: f64,
}

impl NarrowBand {
    pub(crate) fn draw(unit: &Unit, s: &mut Stream) -> Self {
        let center_hz = log_between(s, 0.05, 0.35 / unit.step_s);
        let line_hz = center_hz * log_between(s, 0.006, 0.08);
        Self { center_hz, line_hz, wander_hz: line_hz * between(s, 0.2, 0.8), wander_s: log_between(s, 40.0, 600.0) }
    }

    /// Full width at half height of the spectrum over the log: a Lorentzian line smeared by a normal wander.
    fn width_hz(&self) -> f64 {
        // Olivero and Longbothum, J. Quant. Spectrosc. Radiat. Transfer 17 (1977) 233
        let normal = 2.354_82 * self.wander_hz;
        0.534_6 * self.line_hz + (0.216_6 * self.line_hz.powi(2) + normal.powi(2)).sqrt()
    }
}

impl Effect for NarrowBand {
    fn id(&self) -> &'static str {
        "gyro.narrow_band_noise"
    }

    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let dt = run.step_s();
        let step = |rate: f64| {
            let keep = (-rate * dt).exp();
            (keep, (1.0 - keep * keep).sqrt())
        };
        let ((keep, fresh), (stay, stir)) = (step(PI * self.line_hz), step(1.0 / self.wander_s));
        let (mut a, mut b, mut u, mut phase) = (s.normal(), s.normal(), s.normal(), 0.0_f64);
        (0..run.len)
            .map(|_| {
                (a, b) = (keep * a + fresh * s.normal(), keep * b + fresh * s.normal());
                u = stay * u + stir * s.normal();
                phase += TAU * dt * (self.center_hz + self.wander_hz * u);
                a * phase.cos() - b * phase.sin()
            })
            .collect()
    }

    /// PSD over the whole log, a line of the band's width: for a diagnosis that does not follow the wandering.
    fn psd(&self, f_hz: f64) -> Option<f64> {
        let rate = PI * self.width_hz();
        let line = |f: f64| rate / (rate * rate + (TAU * f).powi(2));
        Some(line(f_hz - self.center_hz) + line(f_hz + self.center_hz))
    }

    /// The integral over ln k would step over a narrow line: sums around the centre instead.
    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        const REACH: f64 = 30.0;
        const NODES: u32 = 600;
        let white = run.unit.white_std_rad_s().powi(2) * run.step_s();
        let [low, high] = [-REACH, REACH].map(|r| self.center_hz + r * self.width_hz());
        let (low, high) = (low.max(0.0), high.min(0.5 / run.step_s()));
        let width_hz = (high - low) / f64::from(NODES);
        let one = |i: u32| {
            let r = strength * strength * self.psd(low + (f64::from(i) + 0.5) * width_hz).unwrap_or(0.0) / white;
            0.5 * (r - r.ln_1p())
        };
        (0..NODES).map(one).sum::<f64>() * width_hz * 2.0 * run.span_s()
    }

    fn parameters(&self, _: &Run, _: &[f64], strength: f64) -> Parameters {
        [("center_hz", self.center_hz), ("bandwidth_hz", self.width_hz()), ("std_rad_s", strength)]
            .map(|(name, value)| (name.to_string(), value))
            .into()
    }

    fn place(&self, _: &Run, _: &[f64]) -> Place {
        let half = 0.5 * self.width_hz();
        Place { frequency_hz: Some([-half, half].map(|x| self.center_hz + x)), ..Place::gyro() }
    }
}
