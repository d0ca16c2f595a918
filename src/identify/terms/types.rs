//! Options and results of the joint estimation of noise terms.

use super::advice::RecordingAdvice;
use super::drift::DriftCause;
use super::goodness::Goodness;
use super::ledger::Ledger;
use super::observed::SpectralLine;
use super::term::TermEstimate;
use super::wavelet::WaveletFit;
use crate::identify::types::Fit;
use crate::noise::{AllanPoint, Deviation, TermKind};
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
