//! σ' = σ g(t),  ln g = ±a (1 + m sin(2π t/P + φ)): white noise that is another than stated, and breathes

use super::draw::{between, chance, log_between};
use super::effect::Effect;
use super::label::Parameters;
use super::nats;
use super::run::Run;
use crate::math::random::Stream;
use std::f64::consts::TAU;

/// How loud a sensor is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Loudness {
    /// Mean of ln g.
    pub log: f64,
    /// Its share that breathes, and how: period, s, and phase.
    depth: f64,
    period_s: f64,
    phase: f64,
}

impl Loudness {
    /// The nominal level.
    pub(crate) const NOMINAL: Self = Self { log: 0.0, depth: 0.0, period_s: 1.0, phase: 0.0 };

    /// A form whose `log` is 1 or -1; it breathes with a period between those of `periods_s`.
    pub(crate) fn draw(periods_s: [f64; 2], s: &mut Stream) -> Self {
        let log = if chance(s, 0.6) { 1.0 } else { -1.0 };
        let [short_s, long_s] = periods_s;
        Self {
            log,
            depth: between(s, 0.0, 0.1),
            period_s: log_between(s, short_s, long_s),
            phase: between(s, 0.0, TAU),
        }
    }

    /// The same, so many times as strong.
    pub(crate) fn times(self, strength: f64) -> Self {
        Self { log: strength * self.log, ..self }
    }

    /// Standard deviation over the stated one at `t_s` since the log began.
    pub(crate) fn at(&self, t_s: f64) -> f64 {
        if self.log == 0.0 {
            return 1.0;
        }
        (self.log * (1.0 + self.depth * (TAU * t_s / self.period_s + self.phase).sin())).exp()
    }

    /// Root mean square over these times, s.
    pub(crate) fn rms(&self, times_s: impl Iterator<Item = f64>) -> f64 {
        let (sum, of) = times_s.fold((0.0, 0.0), |(sum, of), t| (sum + self.at(t).powi(2), of + 1.0_f64));
        (sum / of.max(1.0)).sqrt()
    }
}

/// The gyro's white noise at rest. Strength is the mean of |ln g|.
pub(super) struct NoiseLevel(Loudness);

impl NoiseLevel {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        Self(Loudness::draw([500.0, 4000.0], s))
    }
}

impl Effect for NoiseLevel {
    fn id(&self) -> &'static str {
        "gyro.noise_level"
    }

    fn nats(&self, run: &Run, _: &[f64], strength: f64) -> f64 {
        const THIN: usize = 50;
        let loud = self.0.times(strength);
        run.times_s().step_by(THIN).map(|t| nats::level(loud.at(t))).sum::<f64>() * THIN as f64
    }

    fn strengths(&self, _: &Run) -> [f64; 2] {
        [1e-5, 3.0]
    }

    fn white(&self, strength: f64, white: &mut [f64], run: &Run, _: &mut Stream) {
        let loud = self.0.times(strength);
        for (w, t) in white.iter_mut().zip(run.times_s()) {
            *w *= loud.at(t);
        }
    }

    fn parameters(&self, run: &Run, _: &[f64], strength: f64) -> Parameters {
        [("noise_over_nominal".to_string(), self.0.times(strength).rms(run.times_s()))].into()
    }
}
