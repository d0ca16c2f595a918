//! white' = g(t) law(white),  reading' = held or dead(reading): unlisted effects on the noise and on the output

use super::draw::{between, chance, exponential, index, log_between};
use super::effect::{Effect, Turn};
use super::nats;
use super::run::Run;
use crate::math::random::Stream;
use std::f64::consts::{PI, TAU};

/// How the noise's level moves, as [`Level`] has it.
#[derive(Clone, Copy)]
enum Moves {
    /// Louder for a while, now and then: mean burst and pause, s.
    Bursts { burst_s: f64, pause_s: f64 },
    /// Up and down with this period, s.
    Periodic { period_s: f64 },
}

/// σ' = σ exp(strength · m(t))
pub(super) struct Level(Moves);

impl Level {
    pub(crate) fn bursts(s: &mut Stream) -> Self {
        let burst_s = log_between(s, 3.0, 60.0);
        Self(Moves::Bursts { burst_s, pause_s: burst_s * log_between(s, 3.0, 15.0) })
    }

    pub(crate) fn periodic(s: &mut Stream) -> Self {
        Self(Moves::Periodic { period_s: log_between(s, 20.0, 900.0) })
    }
}

impl Effect for Level {
    fn id(&self) -> &'static str {
        match self.0 {
            Moves::Bursts { .. } => "x.noise_bursts",
            Moves::Periodic { .. } => "x.noise_modulation",
        }
    }

    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        let n = run.len as f64;
        match self.0 {
            Moves::Bursts { burst_s, pause_s } => n * burst_s / (burst_s + pause_s) * nats::level(strength.exp()),
            Moves::Periodic { .. } => {
                let one = |i: i32| nats::level((strength * (TAU * f64::from(i) / 32.0).cos()).exp());
                n * (0..32).map(one).sum::<f64>() / 32.0
            }
        }
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-5, 3.0]
    }

    fn white(&self, strength: f64, white: &mut [f64], run: &Run, s: &mut Stream) {
        match self.0 {
            Moves::Bursts { burst_s, pause_s } => {
                let (mut on, mut until_s) = (false, pause_s * s.uniform());
                for (w, t) in white.iter_mut().zip(run.times_s()) {
                    while t >= until_s {
                        on = !on;
                        until_s += exponential(s) * if on { burst_s } else { pause_s };
                    }
                    if on {
                        *w *= strength.exp();
                    }
                }
            }
            Moves::Periodic { period_s } => {
                let phase = between(s, 0.0, TAU);
                for (w, t) in white.iter_mut().zip(run.times_s()) {
                    *w *= (strength * (TAU * t / period_s + phase).cos()).exp();
                }
            }
        }
    }
}

/// Student's t of 1/strength + 2 degrees of freedom, with variance one
pub(super) struct HeavyTails;

impl HeavyTails {
    /// ln of the density at z.
    fn log_density(z: f64, degrees: f64) -> f64 {
        use statrs::function::gamma::ln_gamma;
        let scale2 = (degrees - 2.0) / degrees;
        ln_gamma(0.5 * (degrees + 1.0))
            - ln_gamma(0.5 * degrees)
            - 0.5 * (PI * degrees * scale2).ln()
            - 0.5 * (degrees + 1.0) * (z * z / (degrees * scale2)).ln_1p()
    }
}

impl Effect for HeavyTails {
    fn id(&self) -> &'static str {
        "x.heavy_tails"
    }

    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        let degrees = 2.0 + 1.0 / strength;
        // z = sinh(u) reaches far into the tails with few nodes
        const WIDTH: f64 = 0.03;
        let one = |i: i32| {
            let u = f64::from(i) * WIDTH;
            let z = u.sinh();
            let ln_t = Self::log_density(z, degrees);
            let ln_normal = -0.5 * z * z - 0.5 * TAU.ln();
            ln_t.exp() * (ln_t - ln_normal) * u.cosh() * WIDTH
        };
        run.len as f64 * (-230..=230).map(one).sum::<f64>()
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-3, 1.0]
    }

    fn turn(&self) -> Turn {
        Turn::Law
    }

    fn white(&self, strength: f64, white: &mut [f64], _: &Run, s: &mut Stream) {
        let degrees = 2.0 + 1.0 / strength;
        for w in white.iter_mut() {
            // Bailey, Mathematics of Computation 62 (1994) 779
            let (u, v) = ((1.0 - s.uniform()).max(1e-300), s.uniform());
            let radius = (degrees * (u.powf(-2.0 / degrees) - 1.0)).sqrt();
            *w = radius * (TAU * v).cos() * ((degrees - 2.0) / degrees).sqrt();
        }
    }
}

/// Soft saturation of the noise: c tanh(z/c), c = 1/strength standard deviations
pub(super) struct Saturation;

impl Effect for Saturation {
    fn id(&self) -> &'static str {
        "x.saturation"
    }

    /// Nats of the variance that is lost.
    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        let (mut variance, mut weight) = (0.0, 0.0);
        for i in -80..=80 {
            let z = f64::from(i) * 0.06;
            let bell = (-0.5 * z * z).exp();
            variance += bell * ((strength * z).tanh() / strength).powi(2);
            weight += bell;
        }
        run.len as f64 * nats::level((variance / weight).sqrt())
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-3, 2.0]
    }

    fn turn(&self) -> Turn {
        Turn::Law
    }

    fn white(&self, strength: f64, white: &mut [f64], _: &Run, _: &mut Stream) {
        white.iter_mut().for_each(|w| *w = (strength * *w).tanh() / strength);
    }
}

/// How readings stick, as [`Held`] has it.
#[derive(Clone, Copy)]
enum Sticks {
    /// Some repeat the one before, in runs of up to so many.
    Stuck { longest: usize },
    /// A reading is given out only where it differs enough from the last one given out.
    DeadBand,
}

/// Readings that repeat. Strength is the share that does.
pub(super) struct Held(Sticks);

impl Held {
    pub(crate) fn stuck(s: &mut Stream) -> Self {
        Self(Sticks::Stuck { longest: 1 + index(s, 4) })
    }

    pub(crate) fn dead_band() -> Self {
        Self(Sticks::DeadBand)
    }
}

impl Effect for Held {
    fn id(&self) -> &'static str {
        match self.0 {
            Sticks::Stuck { .. } => "x.stuck_samples",
            Sticks::DeadBand => "x.dead_band",
        }
    }

    /// Nats of the correlation between neighbours: n ρ²/2.
    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        0.5 * run.len as f64 * strength * strength
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-4, 0.6]
    }

    fn output(&self, strength: f64, reading_rad_s: &mut [f64], run: &Run, s: &mut Stream) {
        match self.0 {
            Sticks::Stuck { longest } => {
                let mean = 0.5 * (1.0 + longest as f64);
                let mut left = 0;
                for i in 1..reading_rad_s.len() {
                    if left == 0 && chance(s, strength / mean) {
                        left = 1 + index(s, longest);
                    }
                    if left > 0 {
                        left -= 1;
                        reading_rad_s[i] = reading_rad_s[i - 1];
                    }
                }
            }
            Sticks::DeadBand => {
                // neighbours differ by N(0, 2σ²): less than w = strength σ √π in this share
                let width = strength * PI.sqrt() * run.unit.white_std_rad_s();
                for i in 1..reading_rad_s.len() {
                    if (reading_rad_s[i] - reading_rad_s[i - 1]).abs() < width {
                        reading_rad_s[i] = reading_rad_s[i - 1];
                    }
                }
            }
        }
    }
}
