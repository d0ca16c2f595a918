//! e(t) = C1 (1 - exp(-t/T)) + C2

use crate::error::{Error, ErrorKind, Result};

/// The error of a gyro at rest while it warms up. `t` counts from power-on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarmUp {
    /// C1: how far the error moves from power-on to the warm state, rad/s.
    pub c1_rad_s: f64,
    /// C2: the error at power-on, rad/s.
    pub c2_rad_s: f64,
    /// T: time constant, s.
    pub time_constant_s: f64,
}

impl WarmUp {
    /// A model with finite parameters and a positive time constant.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] that names the parameter.
    pub fn new(c1_rad_s: f64, c2_rad_s: f64, time_constant_s: f64) -> Result<Self> {
        for (name, value) in [("c1_rad_s", c1_rad_s), ("c2_rad_s", c2_rad_s), ("time_constant_s", time_constant_s)] {
            if !value.is_finite() {
                return Err(Error::new(ErrorKind::Value, "warm-up model", format!("{value} is not finite")).at(name));
            }
        }
        if time_constant_s <= 0.0 {
            let found = format!("{time_constant_s} s is not a positive time");
            return Err(Error::new(ErrorKind::Value, "warm-up model", found).at("time_constant_s"));
        }
        Ok(Self { c1_rad_s, c2_rad_s, time_constant_s })
    }

    /// Error `t_s` after power-on, rad/s (equation 2).
    #[inline]
    #[must_use]
    pub fn error_rad_s(&self, t_s: f64) -> f64 {
        // exp_m1 keeps the digits where t << T
        self.c2_rad_s - self.c1_rad_s * (-t_s / self.time_constant_s).exp_m1()
    }

    /// Error in the warm state, C1 + C2, rad/s.
    #[must_use]
    pub(crate) fn warm_error_rad_s(&self) -> f64 {
        self.c1_rad_s + self.c2_rad_s
    }

    /// Derivatives of the error at `t_s` by C1 (1), C2 (1) and T (rad/s²).
    #[inline]
    #[must_use]
    pub(crate) fn gradient(&self, t_s: f64) -> [f64; 3] {
        let u = t_s / self.time_constant_s;
        [-(-u).exp_m1(), 1.0, -self.c1_rad_s * u * (-u).exp() / self.time_constant_s]
    }

    /// The same error told by a log whose clock starts `offset_s` after power-on:
    /// C1 exp(-t0/T) in the place of C1, e(t0) in the place of C2.
    #[must_use]
    pub(crate) fn seen_from(&self, offset_s: f64) -> Self {
        Self {
            c1_rad_s: self.c1_rad_s * (-offset_s / self.time_constant_s).exp(),
            c2_rad_s: self.error_rad_s(offset_s),
            time_constant_s: self.time_constant_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_agrees_with_differences() {
        let m = WarmUp { c1_rad_s: 2e-3, c2_rad_s: -4e-3, time_constant_s: 250.0 };
        for t in [0.0, 1.0, 100.0, 900.0] {
            let g = m.gradient(t);
            let by = |d1: f64, d2: f64, dt: f64| {
                let shift = |s: f64| WarmUp {
                    c1_rad_s: m.c1_rad_s + s * d1,
                    c2_rad_s: m.c2_rad_s + s * d2,
                    time_constant_s: m.time_constant_s + s * dt,
                };
                (shift(1.0).error_rad_s(t) - shift(-1.0).error_rad_s(t)) / (2.0 * (d1 + d2 + dt))
            };
            for (a, b) in g.iter().zip([by(1e-3, 0.0, 0.0), by(0.0, 1e-3, 0.0), by(0.0, 0.0, 1e-2)]) {
                assert!((a - b).abs() < 1e-8 * (1e-3 + b.abs()), "{a} {b} at {t}");
            }
        }
    }

    #[test]
    fn a_late_log_sees_the_same_error() {
        let m = WarmUp { c1_rad_s: 2e-3, c2_rad_s: -4e-3, time_constant_s: 250.0 };
        let late = m.seen_from(70.0);
        for t in [0.0, 10.0, 1000.0] {
            assert!((late.error_rad_s(t) - m.error_rad_s(t + 70.0)).abs() < 1e-17);
        }
    }
}
