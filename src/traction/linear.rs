//! μ = min(k λ, μ0)

use super::Traction;
use serde::{Deserialize, Serialize};

/// Traction proportional to slip, up to its greatest value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Linear {
    /// k: dμ/dλ.
    pub stiffness: f64,
    /// μ0: the greatest μ.
    pub friction: f64,
}

impl Traction for Linear {
    #[inline]
    fn at(&self, slip: f64) -> [f64; 2] {
        let mu = self.stiffness * slip;
        if mu <= self.friction { [mu, self.stiffness] } else { [self.friction, 0.0] }
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("stiffness", self.stiffness), ("friction", self.friction)]
    }
}
