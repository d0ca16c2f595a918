//! bias(t) += strength · random path: the listed effects that are coloured noises, each in continuous time
//!
//! Integrated over ten substeps a sample and averaged over it, as a sensor does.

use super::draw::{between, log_between};
use super::effect::Effect;
use super::label::Parameters;
use super::run::Run;
use crate::math::random::Stream;
use std::f64::consts::TAU;

/// Substeps of a sample.
const SUBSTEPS: usize = 10;

/// Rate random walk: dx = K dW - x/leak dt, steps with tails a little heavier than normal
pub(super) struct RandomWalk {
    /// Length of the memory over that of the log: a walk in a case leans home in the end.
    leak: f64,
    tails: f64,
}

impl RandomWalk {
    pub fn draw(s: &mut Stream) -> Self {
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
    pub fn draw(s: &mut Stream) -> Self {
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
    pub fn draw(step_s: f64, s: &mut Stream) -> Self {
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
