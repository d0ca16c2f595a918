//! Options and results of the joint estimation of noise terms.

use super::advice::RecordingAdvice;
use super::drift::DriftCause;
use super::goodness::Goodness;
use super::ledger::Ledger;
use super::observed::SpectralLine;
use super::wavelet::WaveletFit;
use crate::identify::Fit;
use crate::noise::{AllanPoint, Band, BandForm, Colour, Deviation, LowPass, TermKind};
use serde::Serialize;

/// Whether the warm-up is taken out first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WarmUpRemoval {
    /// Where the fit finds one and knows its time constant.
    #[default]
    Found,
    /// Always: what the fit makes of the log is taken out.
    Always,
    /// Never: the log is taken as it is.
    Never,
}

/// Options of the estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct TermOptions {
    /// Terms among which the log chooses; N is always one.
    pub among: Vec<TermKind>,
    /// Take all of `among` instead of choosing.
    pub all_of_them: bool,
    /// Whether the warm-up is taken out first.
    pub warm_up: WarmUpRemoval,
    /// Frequencies above this are not fitted: where a filter in the sensor cuts the white noise off, Hz.
    pub max_frequency_hz: Option<f64>,
    /// Averaging times of the overlapping deviation in a decade, beside the octaves.
    pub per_decade: usize,
    /// Logs drawn for the goodness of fit.
    pub draws: usize,
    /// Their seed.
    pub seed: u64,
    /// Horizon of the ledger, s.
    pub horizon_s: f64,
    /// Standard deviation of the bias from one power-on to the next, where it is known, rad/s.
    pub turn_on_std_rad_s: Option<f64>,
}

impl Default for TermOptions {
    fn default() -> Self {
        Self {
            among: TermKind::ALL.to_vec(),
            all_of_them: false,
            warm_up: WarmUpRemoval::Found,
            max_frequency_hz: None,
            per_decade: 8,
            draws: 199,
            seed: 1,
            horizon_s: 60.0,
            turn_on_std_rad_s: None,
        }
    }
}

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

/// A term that the log does not support.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Refusal {
    /// Which term.
    pub id: TermKind,
    /// Its probability.
    pub probability: f64,
    /// Upper bound of its size with 95 % probability, beside the terms that were chosen; `None` for a Gauss-Markov
    /// term, which a long enough or short enough correlation time hides at any size.
    pub upper95: Option<f64>,
    /// Unit of the bound.
    pub unit: &'static str,
    /// Length of a log that would show the term; `None` where it cannot be told.
    pub advice: Option<RecordingAdvice>,
}

impl Refusal {
    /// Without a bound.
    pub(super) fn bare(id: TermKind, probability: f64) -> Self {
        Self { id, probability, upper95: None, unit: id.unit(), advice: None }
    }
}

/// A set of terms and how probable it is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetScore {
    /// The terms.
    pub terms: Vec<TermKind>,
    /// ln of evidence times prior below that of the best set.
    pub ln_evidence_below_best: f64,
    /// Probability among all sets.
    pub probability: f64,
    /// Bayesian information criterion above the smallest.
    pub bic_above_best: f64,
}

/// Influence of the warm-up on the estimate of the random walk.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WarmUpInfluence {
    /// Whether it was taken out.
    pub removed: bool,
    /// Whether the fit found one, and knows its time constant.
    pub found: bool,
    /// K with the warm-up taken out: its 95 % upper bound where it is not supported, rad/s/√s.
    pub rate_random_walk_removed: f64,
    /// Whether that is an upper bound.
    pub removed_is_upper_bound: bool,
    /// K of the same terms and K with the warm-up left in, rad/s/√s.
    pub rate_random_walk_left_in: f64,
}

/// The joint noise model of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseModel {
    /// The terms that the log supports.
    pub terms: Vec<TermEstimate>,
    /// Correlations of their estimates, in the order of the logarithms of sizes and correlation times, a ramp left out, and
    /// then of the cutoff and of centre, width and size of each band as it was found.
    pub correlation: Vec<Vec<f64>>,
    /// The terms that it does not support.
    pub refused: Vec<Refusal>,
    /// The sets of terms, most probable first.
    pub selection: Vec<SetScore>,
    /// Whether the model fits.
    pub goodness: Goodness,
    /// The same terms by wavelet moments.
    pub wavelet: Option<WaveletFit>,
    /// Allan family of the log without its warm-up.
    pub deviations: Vec<(Deviation, Vec<AllanPoint>)>,
    /// Overlapping Allan deviation with the warm-up left in.
    pub with_warm_up: Vec<AllanPoint>,
    /// The warm-up that was fitted.
    pub warm_up: Option<Fit>,
    /// Its influence on the estimate of the random walk.
    pub warm_up_influence: WarmUpInfluence,
    /// Time or temperature, where the log has one that varies.
    pub drift: Option<DriftCause>,
    /// Contribution of each cause to the heading error.
    pub ledger: Ledger,
    /// Lines of the spectrum that were left out of the fit; the deviations hold them.
    pub lines: Vec<SpectralLine>,
    /// Samples.
    pub samples: usize,
    /// Samples that were missing and filled in.
    pub filled: usize,
    /// Sample time, s.
    pub step_s: f64,
    /// Length, s.
    pub span_s: f64,
}

impl NoiseModel {
    /// The estimate of a term, if the log supports it.
    #[must_use]
    pub fn term(&self, kind: TermKind) -> Option<&TermEstimate> {
        self.terms.iter().find(|t| t.id == kind)
    }

    /// σ(τ) of all terms together, rad/s.
    #[must_use]
    pub fn allan_deviation(&self, tau_s: f64) -> f64 {
        self.terms.iter().map(|t| t.allan_variance(tau_s)).sum::<f64>().sqrt()
    }
}
