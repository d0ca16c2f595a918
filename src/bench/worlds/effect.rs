//! reading = output( e(t) + Σ strength · path + σ · shaped white ): the places where an effect of reality can act

use super::label::{Parameters, Place};
use super::nats;
use super::run::Run;
use crate::math::random::Stream;

/// When a change of the white noise has its turn: a filter makes its noise anew, laws bend it, levels scale it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Turn {
    Filter,
    Law,
    Level,
}

/// One effect of one unit. Its form is drawn once; what is drawn anew in each run comes from the run's stream.
pub(super) trait Effect: Send + Sync {
    /// Identifier: of the contract, or `x.` and a name of its own.
    fn id(&self) -> &'static str;

    /// Addition to the bias at unit strength, one value a row; empty where there is none.
    fn path(&self, run: &Run, s: &mut Stream) -> Vec<f64> {
        let _ = (run, s);
        Vec::new()
    }

    /// Adds it to the readings, rad/s, at `strength`.
    fn add(&self, strength: f64, path: &[f64], run: &Run, reading_rad_s: &mut [f64]) {
        let _ = run;
        for (y, x) in reading_rad_s.iter_mut().zip(path) {
            *y += strength * x;
        }
    }

    /// Two-sided PSD at unit strength, 1/Hz: for noises, whose nats come from it and not from one path's energy.
    fn psd(&self, f_hz: f64) -> Option<f64> {
        let _ = f_hz;
        None
    }

    /// Expected log-likelihood ratio in `run` at `strength`, nats; grows with it. Effects of the bias keep this one.
    fn nats(&self, run: &Run, path: &[f64], strength: f64) -> f64 {
        if self.psd(1.0).is_some() {
            nats::noise(run, |f| strength * strength * self.psd(f).unwrap_or(0.0))
        } else {
            0.5 * strength * strength * nats::signal_energy(run, path)
        }
    }

    /// Strengths between which the one for given nats is sought.
    fn strengths(&self, run: &Run) -> [f64; 2] {
        let _ = run;
        [1e-12, 1e3]
    }

    /// The strength at which this run holds `target` nats of it.
    fn strength(&self, run: &Run, path: &[f64], target: f64) -> f64 {
        if !path.is_empty() && self.psd(1.0).is_none() {
            let energy = nats::signal_energy(run, path);
            return if energy > 0.0 { (2.0 * target / energy).sqrt() } else { 0.0 };
        }
        nats::solve(target, self.strengths(run), |strength| self.nats(run, path, strength))
    }

    /// When [`Effect::white`] has its turn.
    fn turn(&self) -> Turn {
        Turn::Level
    }

    /// Changes the run's white noise, which has unit variance.
    fn white(&self, strength: f64, white: &mut [f64], run: &Run, s: &mut Stream) {
        let _ = (strength, white, run, s);
    }

    /// Changes the readings.
    fn output(&self, strength: f64, reading_rad_s: &mut [f64], run: &Run, s: &mut Stream) {
        let _ = (strength, reading_rad_s, run, s);
    }

    /// Parameters as the contract names them.
    fn parameters(&self, run: &Run, path: &[f64], strength: f64) -> Parameters {
        let _ = (run, path, strength);
        Parameters::new()
    }

    /// Where it shows in `run`.
    fn place(&self, run: &Run, path: &[f64]) -> Place {
        let _ = (run, path);
        Place::gyro()
    }
}
