//! μ = D sin(C atan(B λ - E (B λ - atan(B λ))))
//!
//! Pacejka and Bakker, "The magic formula tyre model", Vehicle System Dynamics 21 (1992) supplement, 1-18.

use super::Traction;
use serde::{Deserialize, Serialize};

/// Pacejka's magic formula, longitudinal, without shifts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pacejka {
    /// B: stiffness factor.
    pub b: f64,
    /// C: shape factor.
    pub c: f64,
    /// D: peak.
    pub d: f64,
    /// E: curvature factor, at most 1; may be zero or negative.
    pub e: f64,
}

impl Traction for Pacejka {
    #[inline]
    fn at(&self, slip: f64) -> [f64; 2] {
        let z = self.b * slip;
        let inner = z - self.e * (z - z.atan());
        let inner_slope = self.b * (1.0 - self.e * z * z / (1.0 + z * z));
        let (sin, cos) = (self.c * inner.atan()).sin_cos();
        [self.d * sin, self.d * cos * self.c * inner_slope / (1.0 + inner * inner)]
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("b", self.b), ("c", self.c), ("d", self.d), ("e", self.e)]
    }
}
