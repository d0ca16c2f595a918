//! The minimum of the sum of squares, and why the search for it ended.

use super::surface::Linear;
use serde::Serialize;

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "reason")]
pub enum Termination {
    /// A minimum inside the range of T: the last Gauss-Newton step was below the rounding of the sums.
    Converged {
        /// Iterations of both Brent searches.
        iterations: u64,
        /// Gauss-Newton steps of the polish.
        polish_steps: u32,
        /// Last relative step of T.
        last_step: f64,
    },
    /// The polish ended by its limit of steps; the last relative step of T says how far it still moved.
    StepLimit {
        /// Last relative step of T.
        last_step: f64,
    },
    /// The sum of squares falls towards ever longer T: a straight line fits as well.
    StraightLine,
    /// The sum of squares falls towards T = 0: a constant after the first sample fits as well.
    TooFast,
    /// T was given: the rest is linear.
    Linear,
}

impl Termination {
    /// Whether there is a minimum.
    #[must_use]
    pub fn converged(&self) -> bool {
        matches!(self, Self::Converged { .. } | Self::Linear)
    }
}

/// Result of the search, in the clock of the projection.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    pub time_constant: f64,
    pub linear: Linear,
    pub termination: Termination,
    /// The scan: ln T and the residual sum of squares there; empty where T was given.
    pub scan: Vec<(f64, f64)>,
}
