//! e\[k+1\] = decay · e\[k\] + drive, with e\[0\] = initial
//!
//! With h = Ts/T: exact decay = exp(-h); backward Euler 1/(1+h), the paper's (5j); forward Euler 1-h.
//! drive = (1 - decay)(C1 + C2) in all three. The paper's printed (4) has Ts/(T+Ts) wrong and is not offered.

use super::WarmUp;
use crate::error::{Error, ErrorKind, Result};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How the differential equation de/dt = (C1 + C2 - e)/T is carried from one sample to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// decay = exp(-Ts/T): the samples of e(t) themselves.
    #[default]
    Exact,
    /// decay = T/(T+Ts): equation (5j); acts as a time constant T + Ts/2.
    BackwardEuler,
    /// decay = 1 - Ts/T: acts as T - Ts/2, stable for Ts < 2T.
    ForwardEuler,
}

impl Scheme {
    /// All schemes.
    pub const ALL: [Self; 3] = [Self::Exact, Self::BackwardEuler, Self::ForwardEuler];

    /// Its name in configuration and command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::BackwardEuler => "backward_euler",
            Self::ForwardEuler => "forward_euler",
        }
    }

    /// Factor by which e - (C1+C2) shrinks over `step_s`.
    #[inline]
    #[must_use]
    pub fn decay(self, step_s: f64, time_constant_s: f64) -> f64 {
        let h = step_s / time_constant_s;
        match self {
            Self::Exact => (-h).exp(),
            Self::BackwardEuler => 1.0 / (1.0 + h),
            Self::ForwardEuler => 1.0 - h,
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The recursion that a navigation filter runs at its own sample time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Discrete {
    /// Sample time of the filter, s.
    pub sample_time_s: f64,
    /// How `decay` was made.
    pub scheme: Scheme,
    /// Factor of the last error.
    pub decay: f64,
    /// Added at each step, rad/s.
    pub drive: f64,
    /// Error at power-on, C2, rad/s.
    pub initial: f64,
}

impl Discrete {
    /// Discretises `model` at `sample_time_s`.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] if the sample time is not positive, or forward Euler would be unstable.
    pub fn new(model: &WarmUp, sample_time_s: f64, scheme: Scheme) -> Result<Self> {
        if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
            let found = format!("{sample_time_s} s is not a positive time");
            return Err(Error::new(ErrorKind::Value, "discretisation", found).at("sample_time_s"));
        }
        let decay = scheme.decay(sample_time_s, model.time_constant_s);
        if decay <= -1.0 {
            let found = format!("forward Euler is unstable at {sample_time_s} s with T = {} s", model.time_constant_s);
            return Err(Error::new(ErrorKind::Value, "discretisation", found)
                .at("scheme")
                .hint("use the exact scheme, or a sample time below 2 T"));
        }
        // 1 - decay without the cancellation at small steps
        let h = sample_time_s / model.time_constant_s;
        let gain = match scheme {
            Scheme::Exact => -(-h).exp_m1(),
            Scheme::BackwardEuler => h / (1.0 + h),
            Scheme::ForwardEuler => h,
        };
        Ok(Self { sample_time_s, scheme, decay, drive: gain * model.warm_error_rad_s(), initial: model.c2_rad_s })
    }

    /// The error one sample later, rad/s.
    #[inline]
    #[must_use]
    pub fn step(&self, error_rad_s: f64) -> f64 {
        self.decay * error_rad_s + self.drive
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: WarmUp = WarmUp { c1_rad_s: 2e-3, c2_rad_s: -5e-3, time_constant_s: 600.0 };

    fn run(scheme: Scheme, step: f64, n: usize) -> f64 {
        let d = Discrete::new(&MODEL, step, scheme).unwrap();
        (0..n).fold(d.initial, |e, _| d.step(e))
    }

    #[test]
    fn exact_reproduces_the_continuous_model() {
        for n in [1, 100, 60_000] {
            let e = run(Scheme::Exact, 0.1, n);
            // rounding adds up over n steps at most linearly
            let bound = 4.0 * f64::EPSILON * 5e-3 * n as f64;
            assert!((e - MODEL.error_rad_s(0.1 * n as f64)).abs() < bound, "{n}");
        }
    }

    #[test]
    fn euler_errors_peak_where_theory_says() {
        // both Euler schemes err by C1 h/(2e) at t = T, backward low and forward high
        let (step, n) = (6.0, 100);
        let peak = MODEL.c1_rad_s * (step / 600.0) / (2.0 * std::f64::consts::E);
        let truth = MODEL.error_rad_s(600.0);
        let back = run(Scheme::BackwardEuler, step, n) - truth;
        let forward = run(Scheme::ForwardEuler, step, n) - truth;
        assert!((back / -peak - 1.0).abs() < 0.02, "{back} {peak}");
        assert!((forward / peak - 1.0).abs() < 0.02, "{forward} {peak}");
    }

    #[test]
    fn all_schemes_share_the_fixed_point() {
        for scheme in Scheme::ALL {
            let d = Discrete::new(&MODEL, 0.5, scheme).unwrap();
            let fixed = d.drive / (1.0 - d.decay);
            assert!((fixed - MODEL.warm_error_rad_s()).abs() < 1e-12, "{scheme}: {fixed}");
        }
    }

    #[test]
    fn an_unstable_step_is_refused() {
        assert!(Discrete::new(&MODEL, 1300.0, Scheme::ForwardEuler).is_err());
        assert!(Discrete::new(&MODEL, 1300.0, Scheme::BackwardEuler).is_ok());
        assert!(Discrete::new(&MODEL, 0.0, Scheme::Exact).is_err());
    }
}
