//! h' = (1 - h)/T while on,  h' = -h/Tc while off;  e = C1 h + C2
//!
//! h is how far the gyro has warmed up: 0 cold, 1 warm. From a cold power-on this is e(t) = C1 (1 - exp(-t/T)) + C2.
//! Switched off at the age a, and on again d later, it starts from
//!
//! ```text
//!     h0 = (1 - exp(-a/T)) exp(-d/Tc)
//!     e(t) = C1 (1 - (1 - h0) exp(-t/T)) + C2          t from the new power-on
//! ```
//!
//! which is the warm-up of a log that begins at the age A = -T ln(1 - h0): e(t) = C1 (1 - exp(-(t + A)/T)) + C2. An age
//! is time on since a cold power-on, or the time that would have warmed the gyro as far; so one number carries any
//! number of restarts, as long as it is read with the T that it was made with.
//!
//! The missing part m = 1 - h0 = (1 - exp(-d/Tc)) + exp(-a/T - d/Tc) is a sum of positive terms, so that it keeps its
//! precision where h0 is near one. Its derivative by ln T, with a and d held, is
//!
//! ```text
//!     ∂m/∂ln T = (a/T) exp(-a/T - d/Tc)                                     Tc a constant of its own
//!                (a/T) exp(-a/T - d/T) - (d/T) (1 - exp(-a/T)) exp(-d/T)    Tc = T
//! ```
//!
//! First-order heating as in the warm-up's own model (Barshan and Durrant-Whyte 1995). Off, the gyro loses its own
//! heat through the same resistance, so that Tc = T is the natural default; a case that the other electronics kept
//! warm, or that a fan no longer cools, makes it longer.

use crate::error::{Error, ErrorKind, Result};

/// A gyro that is switched on again before it is cold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Restart {
    /// a: its age when it was switched off, s.
    warm_up_age_s: f64,
    /// d: how long it was off, s.
    off_s: f64,
    /// Tc, s; `None`: as T.
    cooling_time_constant_s: Option<f64>,
}

/// Share of the warm-up that is still to come at a restart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lack {
    /// 1 - h0: 1 for a cold gyro, 0 for a warm one.
    pub share: f64,
    /// Its derivative by ln T.
    pub by_ln_time_constant: f64,
}

impl Lack {
    /// A cold power-on: all of the warm-up is still to come, whatever T is.
    pub(crate) const COLD: Self = Self { share: 1.0, by_ln_time_constant: 0.0 };
}

impl Restart {
    /// Switched off at the age `warm_up_age_s`, for `off_s`; cooling with `cooling_time_constant_s`, or as T if `None`.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] if a time is negative or not finite, or Tc not positive.
    pub fn new(warm_up_age_s: f64, off_s: f64, cooling_time_constant_s: Option<f64>) -> Result<Self> {
        let error = |place: &str, value: f64, what: &str| {
            Error::new(ErrorKind::Value, "warm restart", format!("{value} s is {what}")).at(place)
        };
        for (place, value) in [("warm-up age", warm_up_age_s), ("off time", off_s)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(error(place, value, "no duration").hint("give zero or a positive number of seconds"));
            }
        }
        if let Some(tc) = cooling_time_constant_s.filter(|tc| !(tc.is_finite() && *tc > 0.0)) {
            return Err(error("cooling time constant", tc, "not a positive time").hint("leave it out to take it as T"));
        }
        Ok(Self { warm_up_age_s, off_s, cooling_time_constant_s })
    }

    /// 1 - h0 and its derivative, at the time constant T = `time_constant_s`.
    #[must_use]
    pub(crate) fn lack(&self, time_constant_s: f64) -> Lack {
        let warmed = self.warm_up_age_s / time_constant_s;
        let cooled = self.off_s / self.cooling_time_constant_s.unwrap_or(time_constant_s);
        let both = (-warmed - cooled).exp();
        let by_warming = warmed * both;
        let by_cooling = match self.cooling_time_constant_s {
            Some(_) => 0.0,
            None => cooled * (-warmed).exp_m1() * (-cooled).exp(),
        };
        Lack { share: both - (-cooled).exp_m1(), by_ln_time_constant: by_warming + by_cooling }
    }

    /// A = -T ln(1 - h0): the age at which a log of this restart begins, s.
    #[must_use]
    pub fn age_s(&self, time_constant_s: f64) -> f64 {
        if self.off_s == 0.0 {
            // also where exp(-a/T) underflows
            return self.warm_up_age_s;
        }
        // a share that rounds above one must not become a negative age
        (-time_constant_s * self.lack(time_constant_s).share.ln()).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bias::WarmUp;

    const T: f64 = 240.0;

    fn restart(age: f64, off: f64, cooling: Option<f64>) -> Restart {
        Restart::new(age, off, cooling).unwrap()
    }

    /// h after `on` at T and `off` at Tc, by fine steps of the differential equations (midpoint rule).
    fn integrated(on: f64, off: f64, cooling: f64) -> f64 {
        let steps = 100_000;
        let run = |h: f64, span: f64, target: f64, tau: f64| {
            let dt = span / f64::from(steps);
            (0..steps).fold(h, |h, _| {
                let middle = h + 0.5 * dt * (target - h) / tau;
                h + dt * (target - middle) / tau
            })
        };
        run(run(0.0, on, 1.0, T), off, 0.0, cooling)
    }

    #[test]
    fn the_heat_is_that_of_the_differential_equations() {
        for (on, off, cooling) in [(600.0, 300.0, None), (60.0, 30.0, None), (600.0, 300.0, Some(700.0))] {
            let h = integrated(on, off, cooling.unwrap_or(T));
            let share = restart(on, off, cooling).lack(T).share;
            // the midpoint rule errs by span³/(6 τ³ n²) of a value below one
            assert!((1.0 - share - h).abs() < 1e-9, "{on} {off}: {} {h}", 1.0 - share);
        }
    }

    #[test]
    fn a_restart_is_a_log_that_begins_at_its_age() {
        let model = WarmUp { c1_rad_s: -2.4e-3, c2_rad_s: 8e-3, time_constant_s: T };
        for r in [restart(600.0, 300.0, None), restart(5.0, 1.0, Some(50.0)), restart(1e4, 1e-3, None)] {
            let (lack, age) = (r.lack(T).share, r.age_s(T));
            for t in [0.0, 10.0, 500.0] {
                let e = model.c1_rad_s * (1.0 - lack * (-t / T).exp()) + model.c2_rad_s;
                assert!((model.error_rad_s(t + age) - e).abs() < 1e-16, "{r:?} at {t}");
            }
        }
    }

    #[test]
    fn the_limits_are_right() {
        // never off: the age goes on, also where exp(-a/T) is zero
        for age in [0.0, 3.0, 600.0, 1e9] {
            assert_eq!(restart(age, 0.0, None).age_s(T), age);
        }
        // off for ever, or never on: cold
        for r in [restart(600.0, 1e9, None), restart(0.0, 10.0, None), restart(0.0, 0.1, Some(7.0))] {
            assert!((r.lack(T).share - 1.0).abs() < 4.0 * f64::EPSILON && r.age_s(T) < 1e-12 * T, "{r:?}");
            assert!(r.lack(T).by_ln_time_constant.abs() < 4.0 * f64::EPSILON);
        }
        // warm, and off for a blink: d/Tc is lacking, to all digits
        let lack = restart(1e6, 1e-6, None).lack(T).share;
        assert!((lack / (1e-6 / T) - 1.0).abs() < 1e-8, "{lack}");
    }

    #[test]
    fn two_restarts_in_a_row_are_one_with_the_age_of_the_first() {
        let first = restart(600.0, 300.0, None);
        let again = restart(first.age_s(T) + 120.0, 60.0, None);
        let h = (1.0 - first.lack(T).share * (-120.0 / T).exp()) * (-60.0 / T).exp();
        assert!((1.0 - again.lack(T).share - h).abs() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn the_derivative_agrees_with_differences() {
        for cooling in [None, Some(90.0), Some(2000.0)] {
            for (age, off) in [(0.0, 0.0), (600.0, 0.0), (60.0, 300.0), (600.0, 300.0), (2000.0, 20.0)] {
                let r = restart(age, off, cooling);
                let eps = 1e-5f64;
                let at = |sign: f64| r.lack(T * (sign * eps).exp()).share;
                let difference = (at(1.0) - at(-1.0)) / (2.0 * eps);
                let found = r.lack(T).by_ln_time_constant;
                // truncation eps² times a third derivative of a few units, rounding of values near one over 2 eps
                assert!((found - difference).abs() < 1e-9, "{age} {off} {cooling:?}: {found} {difference}");
            }
        }
    }

    #[test]
    fn what_is_no_time_is_refused_by_name() {
        let refused = |r: Result<Restart>, part: &str| assert!(r.unwrap_err().to_string().contains(part), "{part}");
        refused(Restart::new(-1.0, 1.0, None), "warm-up age");
        refused(Restart::new(1.0, f64::NAN, None), "off time");
        refused(Restart::new(1.0, f64::INFINITY, None), "off time");
        refused(Restart::new(1.0, 1.0, Some(0.0)), "cooling time constant");
    }
}
