//! e(θ) = b + s (θ - θr) + q (θ - θr)²

use serde::{Deserialize, Serialize};

/// Independent variable of the model of a gyro's error at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// Time since power-on: [`super::WarmUp`].
    #[default]
    Time,
    /// Temperature of the sensor: [`Thermal`].
    Temperature,
}

/// The error of a gyro at rest by its temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thermal {
    /// θr, °C.
    pub reference_c: f64,
    /// b: the error at the reference temperature, rad/s.
    pub bias_rad_s: f64,
    /// s: its slope there, rad/s per K.
    pub sensitivity_rad_s_k: f64,
    /// q, rad/s per K²; 0 for a straight line.
    pub curvature_rad_s_k2: f64,
}

impl Thermal {
    /// Error at `temperature_c`, rad/s.
    #[inline]
    #[must_use]
    pub fn error_rad_s(&self, temperature_c: f64) -> f64 {
        self.bias_rad_s + self.above_reference_rad_s(temperature_c)
    }

    /// Error at `temperature_c` less that at the reference, rad/s.
    #[inline]
    #[must_use]
    pub(crate) fn above_reference_rad_s(&self, temperature_c: f64) -> f64 {
        let rise = temperature_c - self.reference_c;
        rise * (self.sensitivity_rad_s_k + rise * self.curvature_rad_s_k2)
    }

    /// Derivatives of the error at `temperature_c` by b (1), s (K) and q (K²).
    #[inline]
    #[must_use]
    pub(crate) fn gradient(&self, temperature_c: f64) -> [f64; 3] {
        let rise = temperature_c - self.reference_c;
        [1.0, rise, rise * rise]
    }

    /// Variance of the error at `temperature_c` by `covariance` of (b, s, q), rad²/s².
    #[must_use]
    pub fn variance_rad2_s2(&self, covariance: &[[f64; 3]; 3], temperature_c: f64) -> f64 {
        let g = self.gradient(temperature_c);
        let row = |i: usize| (0..3).map(|j| covariance[i][j] * g[j]).sum::<f64>() * g[i];
        (0..3).map(row).sum::<f64>().max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_its_gradient_times_its_parameters() {
        let m = Thermal { reference_c: 25.0, bias_rad_s: 3e-3, sensitivity_rad_s_k: -4e-5, curvature_rad_s_k2: 6e-7 };
        for t in [-20.0, 25.0, 61.5] {
            let g = m.gradient(t);
            let sum = g[0] * m.bias_rad_s + g[1] * m.sensitivity_rad_s_k + g[2] * m.curvature_rad_s_k2;
            assert!((m.error_rad_s(t) - sum).abs() < 1e-17);
            let var = m.variance_rad2_s2(&[[4.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.5, 2.0]], t);
            let d = g[1];
            assert!((var - (4.0 + d * d + d * d * d + 2.0 * d.powi(4))).abs() < 1e-9 * var.max(1.0));
        }
    }
}
