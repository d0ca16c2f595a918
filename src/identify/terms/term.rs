//! One estimated term: its size, its times or frequencies, and their intervals.

use super::advice::RecordingAdvice;
use crate::noise::{Band, BandForm, Colour, LowPass, TermKind};
use serde::Serialize;

/// A correlation time, s, or a frequency, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimeEstimate {
    /// Estimate.
    pub estimate: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// An estimated term.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TermEstimate {
    /// Which term.
    pub id: TermKind,
    /// Its size.
    pub estimate: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % interval: of the profile likelihood; an end that the log does not bound is 0 or infinite.
    pub ci95: [f64; 2],
    /// Unit of the size.
    pub unit: &'static str,
    /// Correlation time of a Gauss-Markov term.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation_time_s: Option<TimeEstimate>,
    /// Centre of a narrow band.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center_hz: Option<TimeEstimate>,
    /// Its full width at half the peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<TimeEstimate>,
    /// Its form.
    #[serde(skip_serializing_if = "Option::is_none", rename = "band_form")]
    pub band: Option<BandForm>,
    /// Form of a low-pass.
    #[serde(skip_serializing_if = "Option::is_none", rename = "low_pass_form")]
    pub low_pass: Option<LowPass>,
    /// How long to record to know it to ±20 %, where this log does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<RecordingAdvice>,
}

impl TermEstimate {
    pub(super) fn new(
        id: TermKind,
        estimate: f64,
        std: f64,
        ci95: [f64; 2],
        correlation_time_s: Option<TimeEstimate>,
    ) -> Self {
        Self {
            id,
            estimate,
            std,
            ci95,
            unit: id.unit(),
            correlation_time_s,
            center_hz: None,
            bandwidth_hz: None,
            band: None,
            low_pass: None,
            advice: None,
        }
    }

    /// σ²(τ) of the continuous term, rad²/s².
    #[must_use]
    pub fn allan_variance(&self, tau_s: f64) -> f64 {
        if let (Some(center), Some(width)) = (self.center_hz, self.bandwidth_hz) {
            return self.estimate.powi(2) * band_allan_variance(center.estimate, width.estimate, tau_s);
        }
        self.estimate.powi(2) * self.id.allan_variance(tau_s, self.correlation_time_s.map_or(0.0, |t| t.estimate))
    }

    /// Drive q of a Gauss-Markov term, rad/s/√s: σ² = q² T/2.
    #[must_use]
    pub fn drive(&self) -> Option<f64> {
        self.correlation_time_s.map(|t| self.estimate * (2.0 / t.estimate).sqrt())
    }
}

/// σ²(τ)/σ² of a narrow band: 2 sin⁴(πfτ)/(πfτ)², its mean over the line (twice its width on each side, of Gauss's form).
fn band_allan_variance(center_hz: f64, width_hz: f64, tau_s: f64) -> f64 {
    const NODES: i32 = 200;
    let node = |i: i32| {
        let x = 4.0 * (f64::from(i) + 0.5) / f64::from(NODES) - 2.0;
        let f = (center_hz + x * width_hz).max(f64::MIN_POSITIVE);
        let weight = (-4.0 * std::f64::consts::LN_2 * x * x).exp();
        let phase = std::f64::consts::PI * f * tau_s;
        (weight, 2.0 * phase.sin().powi(4) / (phase * phase))
    };
    let (sum, all) = (0..NODES).map(node).fold((0.0, 0.0), |(s, a), (w, v)| (s + w * v, a + w));
    sum / all
}

/// The colour of the noise that a low-pass and bands among `terms` give.
#[must_use]
pub(crate) fn colour(terms: &[TermEstimate]) -> Colour {
    let band = |t: &TermEstimate| {
        let (form, center, width) = (t.band?, t.center_hz?, t.bandwidth_hz?);
        let (center_hz, bandwidth_hz) = (center.estimate, width.estimate);
        Some(Band { form, center_hz, bandwidth_hz, std_rad_s: t.estimate })
    };
    Colour {
        low_pass: terms.iter().find_map(|t| Some((t.low_pass?, t.estimate))),
        bands: terms.iter().filter_map(band).collect(),
    }
}

/// Terms in order: the low-pass and then bands at the end, the largest first.
pub(super) fn ordered(mut terms: Vec<TermEstimate>) -> Vec<TermEstimate> {
    let size = |t: &TermEstimate| if t.band.is_some() { t.estimate } else { 0.0 };
    terms.sort_by(|a, b| a.id.cmp(&b.id).then(size(b).total_cmp(&size(a))));
    terms
}

/// An estimate from the standard deviation of its logarithm.
pub(super) fn estimate_of_ln(estimate: f64, ln_std: f64, ci95: [f64; 2]) -> TimeEstimate {
    TimeEstimate { estimate, std: estimate * ln_std, ci95 }
}
