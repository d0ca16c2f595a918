//! Settings of the diagnosis of drives, and the constants by which it decides how far to look.

use crate::gap::answer::calibration::Calibration;
use crate::gap::selection::prior::Prior;

/// Settings of the comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Prior odds.
    pub prior: Prior,
    /// Calibration of evidences to probabilities.
    pub calibration: Calibration,
}

impl Default for Options {
    fn default() -> Self {
        let prior = Prior::of_drives();
        Self { prior, calibration: Calibration::of_drives(&prior) }
    }
}

/// Evidence from which on lost ticks are examined, nats.
pub(crate) const WORTH: f64 = 8.0;
/// Size of a gap from which on the derivatives at zero need not tell its cause, nats.
pub(crate) const LARGE: f64 = 300.0;
/// Nats by which an account may fall short before its model has settled.
pub(crate) const HOPELESS: f64 = 500.0;
