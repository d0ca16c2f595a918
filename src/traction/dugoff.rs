//! μ = k λ/(1 - λ) for τ >= 1, else μ0 (1 - τ/2),  τ = μ0 (1 - λ)/(2 k λ)
//!
//! Dugoff, Fancher, Segel, "An analysis of tire traction properties and their influence on vehicle dynamic performance",
//! SAE 700377 (1970), without side slip: in their f(τ) = τ (2 - τ) the force F = C λ/(1 - λ) f(τ) becomes the second form.

use super::Traction;
use serde::{Deserialize, Serialize};

/// Dugoff's law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dugoff {
    /// μ0: limit of μ under full slip.
    pub friction: f64,
    /// k: dμ/dλ at zero slip, longitudinal stiffness over load.
    pub stiffness: f64,
}

impl Traction for Dugoff {
    #[inline]
    fn at(&self, slip: f64) -> [f64; 2] {
        let (friction, stiffness) = (self.friction, self.stiffness);
        let rolling = 1.0 - slip;
        // τ >= 1, without its division by zero
        if friction * rolling >= 2.0 * stiffness * slip {
            return [stiffness * slip / rolling, stiffness / (rolling * rolling)];
        }
        let quarter = 0.25 * friction * friction / (stiffness * slip);
        [friction - quarter * rolling, quarter / slip]
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("friction", self.friction), ("stiffness", self.stiffness)]
    }
}
