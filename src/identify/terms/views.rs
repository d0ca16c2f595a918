//! The two views of a log: with the column of a ramp and without.

use super::model::Peak;
use super::observed::Observed;
use crate::noise::TermKind;

/// The two views of a log: with the column of a ramp (the last one) and without.
pub(super) struct Views {
    pub plain: Observed,
    pub ramp: Observed,
}

impl Views {
    /// From the log with the ramp's column.
    pub(crate) fn new(ramp: Observed) -> Self {
        let plain = ramp.without(ramp.columns() - 1, 0.0);
        Self { plain, ramp }
    }

    pub(crate) fn of(&self, kinds: &[TermKind]) -> &Observed {
        if kinds.contains(&TermKind::RateRamp) { &self.ramp } else { &self.plain }
    }

    /// The ramp, rad/s², and its standard deviation, at a mode with its column.
    pub(crate) fn slope(&self, peak: &Peak) -> [f64; 2] {
        let j = self.ramp.columns() - 1;
        let n = self.ramp.columns();
        let rms = self.ramp.column_rms[j];
        [peak.point.coefficients[j] / rms, peak.point.covariance[j * n + j].sqrt() / rms]
    }
}
