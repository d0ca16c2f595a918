//! The gyro's error by temperature, as the configuration holds it.

use crate::bias::Thermal;
use serde::{Deserialize, Serialize};

/// `[gyro.temperature]`: e(θ) = bias + sensitivity (θ - reference) + curvature (θ - reference)².
///
/// `validate` and `navigate` use it and need the temperature. c1, c2 and the time constant, of the same log, remain for
/// users without a thermometer. The temperatures that it was fitted on stand in `[validation]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Temperature {
    /// Temperature from which the others count, °C.
    pub reference_c: f64,
    /// Error at the reference temperature, rad/s.
    pub bias_rad_s: f64,
    /// Slope there, rad/s per K.
    pub sensitivity_rad_s_k: f64,
    /// Coefficient of the square, rad/s per K²; without it the error is a straight line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature_rad_s_k2: Option<f64>,
    /// Covariance of the estimates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<TemperatureCovariance>,
}

impl Temperature {
    /// The model.
    #[must_use]
    pub fn thermal(&self) -> Thermal {
        Thermal {
            reference_c: self.reference_c,
            bias_rad_s: self.bias_rad_s,
            sensitivity_rad_s_k: self.sensitivity_rad_s_k,
            curvature_rad_s_k2: self.curvature_rad_s_k2.unwrap_or(0.0),
        }
    }
}

/// `[gyro.temperature.covariance]`: of bias, sensitivity and curvature, allowing for autocorrelated residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemperatureCovariance {
    /// var(bias), rad²/s²
    pub bias_bias_rad2_s2: f64,
    /// cov(bias, sensitivity), rad²/s²/K
    pub bias_sensitivity_rad2_s2_k: f64,
    /// var(sensitivity), rad²/s²/K²
    pub sensitivity_sensitivity_rad2_s2_k2: f64,
    /// cov(bias, curvature), rad²/s²/K²
    #[serde(default)]
    pub bias_curvature_rad2_s2_k2: f64,
    /// cov(sensitivity, curvature), rad²/s²/K³
    #[serde(default)]
    pub sensitivity_curvature_rad2_s2_k3: f64,
    /// var(curvature), rad²/s²/K⁴
    #[serde(default)]
    pub curvature_curvature_rad2_s2_k4: f64,
}

impl TemperatureCovariance {
    /// From the matrix in the order bias, sensitivity, curvature.
    #[must_use]
    pub fn from_matrix(m: &[[f64; 3]; 3]) -> Self {
        Self {
            bias_bias_rad2_s2: m[0][0],
            bias_sensitivity_rad2_s2_k: m[0][1],
            sensitivity_sensitivity_rad2_s2_k2: m[1][1],
            bias_curvature_rad2_s2_k2: m[0][2],
            sensitivity_curvature_rad2_s2_k3: m[1][2],
            curvature_curvature_rad2_s2_k4: m[2][2],
        }
    }

    /// The symmetric matrix in the order bias, sensitivity, curvature.
    #[must_use]
    pub fn to_matrix(self) -> [[f64; 3]; 3] {
        let (bs, bq) = (self.bias_sensitivity_rad2_s2_k, self.bias_curvature_rad2_s2_k2);
        let sq = self.sensitivity_curvature_rad2_s2_k3;
        let (ss, qq) = (self.sensitivity_sensitivity_rad2_s2_k2, self.curvature_curvature_rad2_s2_k4);
        [[self.bias_bias_rad2_s2, bs, bq], [bs, ss, sq], [bq, sq, qq]]
    }
}
