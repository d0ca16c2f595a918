//! The answer of a diagnosis: what `--json` writes.

pub(crate) mod account;
pub(crate) mod calibration;
pub(crate) mod compose;
mod gain;
use super::trace::Step;
use crate::effects::{About, Parameters};
use crate::navigate::Summary;
use serde::{Deserialize, Serialize};

/// Verdict of the diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The nominal simulator explains the recording.
    None,
    /// An effect of the library explains most of the gap.
    Identified,
    /// There is a gap, and the named effects together do not explain most of it.
    Unknown,
    /// The recorded channels are not redundant: none can contradict another (drives only). Of a comparison also: the twin
    /// errs by more than the gap may be.
    CannotTell,
}

impl std::fmt::Display for Verdict {
    /// As in JSON.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.serialize(f)
    }
}

/// Answers to: where does the gap lie, which effect causes it, how far does it shrink.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The effect that closes most of the gap in held-out log score; never an idle one. Under `unknown` the named
    /// effect that closes most, if there is one; none under `none` and `cannot_tell`.
    pub main: Option<String>,
    /// Probability that `main` is right.
    pub main_probability: f64,
    /// Probability that the nominal simulator lacks nothing.
    pub none_probability: f64,
    /// Probability that the main cause is not in the library.
    pub unknown_probability: f64,
    /// Effects that were considered, most probable first.
    pub effects: Vec<EffectAnswer>,
    /// Effects judged present that are not idle, whatever the verdict.
    pub together: Vec<String>,
    /// Part of the gap that the named effects leave, and where it lies; none where there is no gap or it was not
    /// measured.
    #[serde(default)]
    pub remainder: Option<Remainder>,
    /// Time offsets of clocks that disagree, each recording on its own.
    #[serde(default)]
    pub time_offsets: Vec<TimeOffset>,
    /// Where no effect explains most of the gap: the effect of the library that explains most alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest: Option<Nearest>,
    /// Classes of effects that this log cannot separate.
    pub cannot_tell_apart: Vec<Vec<String>>,
    /// For each class, in the same order: similarity, and the experiment that would separate them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alike: Vec<Alike>,
    /// Where the main effect, or the unknown, shows; none where the verdict is none.
    #[serde(rename = "where")]
    pub place: Option<Place>,
    /// The free forms that competed as 'unknown', most probable first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub free_forms: Vec<FreeFormAnswer>,
    /// Of drives: which equations of the nominal model are deficient, before any effect is named; the worst first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub equations: Vec<EquationAnswer>,
    /// Measures of the gap on the hold-out recording, or without one on the recording itself.
    pub gap: Vec<Metric>,
    /// Drives with a pose in the hold-out recording: errors of the navigation filter on it, without and with the
    /// effects found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub navigation: Option<FilterGain>,
    /// How the gap was measured, and what could not be told, in sentences.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Everything that was tried, by stages, and why it was taken or not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trace: Vec<Step>,
}

impl Answer {
    /// The effects that are judged present and are not idle.
    pub fn present(&self) -> impl Iterator<Item = &EffectAnswer> {
        self.together.iter().filter_map(|id| self.effects.iter().find(|e| e.id == *id))
    }
}

/// One effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectAnswer {
    /// Identifier.
    pub id: String,
    /// Posterior probability that it is present.
    pub probability: f64,
    /// ln evidence lost when this effect is left out and all others are fitted anew, nats; none where not computed.
    #[serde(default)]
    pub evidence_nats: Option<f64>,
    /// Whether it is present beyond doubt, but closes no measurable part of the gap.
    #[serde(default)]
    pub idle: bool,
    /// Parameters (posterior mode).
    pub parameters: Parameters,
    /// Their standard deviations.
    pub std: Parameters,
    /// (before - after) / (before - floor) in log score, of this effect alone.
    pub gap_closed: Option<f64>,
    /// 95 % interval of `gap_closed`, by resampling blocks of time.
    pub gap_closed_ci95: Option<[f64; 2]>,
    /// Share, 0 to 1, of the log-likelihood gained by its most probable set (mean of added first and added last).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
}

impl EffectAnswer {
    /// An effect of which nothing but its probability of being present is known.
    #[must_use]
    pub(crate) fn new(id: &str, probability: f64) -> Self {
        Self {
            id: id.to_owned(),
            probability,
            evidence_nats: None,
            idle: false,
            parameters: Parameters::new(),
            std: Parameters::new(),
            gap_closed: None,
            gap_closed_ci95: None,
            share: None,
        }
    }
}

/// The part of the gap that no named effect closes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Remainder {
    /// Share of the gap in held-out log score, 0 to 1.
    pub share: f64,
    /// Where it lies.
    #[serde(rename = "where", default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
}

/// Time offset of a channel against the gyro (without a gyro: against the wheels).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimeOffset {
    /// `wheels`, `pose`, `torque`.
    pub channel: String,
    /// `fit` or `hold`; with several drives of a kind `fit 2`, `hold 1`, ...
    pub recording: String,
    /// By how much the channel is stamped late, s; negative: early.
    pub offset_s: f64,
    /// Standard deviation of the offset, s.
    pub std_s: f64,
}

/// The effect that comes nearest to an unknown cause. It is in the list of effects too, with its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Nearest {
    /// Identifier.
    pub id: String,
    /// Gain of this effect alone over the gain of the best explanation of the recording, 0 to 1.
    pub share: f64,
    /// The gap on the hold-out recording, `after` with this effect alone.
    pub gap: Vec<Metric>,
}

/// A class of effects with similar signatures on this log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alike {
    /// Their ids.
    pub ids: Vec<String>,
    /// Similarity of their signatures on this log, 0 to 1.
    pub overlap: f64,
    /// The experiment or channel that would separate them.
    pub separate_by: String,
}

/// Where the gap lies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Place {
    /// Channel.
    pub channel: String,
    /// The deficient equation, in words.
    pub equation: String,
    /// Interval of time in which it shows, s, as in the fit log.
    pub time_s: Option<[f64; 2]>,
    /// Frequency band in which it shows, Hz.
    pub frequency_hz: Option<[f64; 2]>,
    /// Quantity that it depends on, such as `temperature_c`.
    pub condition: Option<String>,
    /// For an unknown cause: description in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
}

impl Place {
    /// Place of an effect of this kind, whenever and at whatever frequency it acts.
    pub(crate) fn of(about: &About) -> Self {
        Self {
            channel: about.channel.into(),
            equation: about.deficient.into(),
            condition: about.condition.map(Into::into),
            ..Self::default()
        }
    }
}

/// A free form that competed as 'unknown'.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FreeFormAnswer {
    /// Identifier; the quantity it is a function of: `free.time`, `free.temperature`, `free.spectrum`, ...
    pub id: String,
    /// Probability that it is present.
    pub probability: f64,
    /// Gain in ln likelihood beside the other parts of its best set, nats.
    #[serde(default)]
    pub share_nats: f64,
    /// Description in words.
    pub description: String,
}

/// A deficient equation of the nominal model: a free correction of it raises the evidence.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquationAnswer {
    /// The equation, in words.
    pub equation: String,
    /// Channel of the answer.
    pub channel: String,
    /// Gain of the best correction in ln evidence, nats.
    pub gain_nats: f64,
    /// Quantity that the best correction is a function of.
    pub follows: String,
    /// The correction as a signal, of the equations with the largest gains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<Correction>,
}

/// Correction added to an equation in the course of a drive: a random walk, estimated by the smoother.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// Process noise that the equation needs: diffusion of the walk, in `unit` per √s.
    pub diffusion: f64,
    /// Unit of the equation.
    pub unit: String,
    /// Gain of the walk over a constant in ln likelihood, nats.
    pub gain_nats: f64,
    /// p-value of that gain under a constant correction (upper bound).
    pub p_value: f64,
    /// Whether the mean is removed from the signal: the level of this equation varies from run to run, or is not
    /// observable.
    pub about_mean: bool,
    /// Effective number of independent values of the signal (trace of the smoother).
    pub degrees_of_freedom: f64,
    /// Times of the knots, s, as in the fit log.
    pub times_s: Vec<f64>,
    /// Several drives: index of the first knot of each; empty for one drive.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<usize>,
    /// The correction at the knots, in `unit`; linear between them.
    pub values: Vec<f64>,
    /// Its standard deviation at the knots, in `unit`.
    pub std: Vec<f64>,
    /// States and inputs that it was regressed on, largest share first.
    pub regressors: Vec<Regressor>,
    /// Values of the first regressor at the knots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
}

/// A state or an input that a correction was regressed on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Regressor {
    /// `speed`, `yaw_rate`, ...
    pub name: String,
    /// Share of the signal's variance that it explains, 0 to 1, adjusted for the number of fitted functions.
    pub share: f64,
}

/// A state or an input at the knots of a correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Against {
    /// `speed`, `yaw_rate`, ...
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its mean about each knot, in `unit`.
    pub values: Vec<f64>,
}

/// Errors of the navigation filter on the hold-out recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterGain {
    /// With the nominal model.
    pub before: FilterFigures,
    /// With the augmented one.
    pub after: FilterFigures,
}

/// Errors of one run of a navigation filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterFigures {
    /// Root mean square distance from the reference, m.
    pub position_rms_m: f64,
    /// Root mean square heading error, rad; none where the reference has no heading.
    pub heading_rms_rad: Option<f64>,
    /// Mean normalised innovation squared of gyro and wheels; expected: 1.
    pub nis_mean: f64,
    /// Interval of `nis_mean` in 95 % of runs if the model holds.
    pub nis_mean_bounds95: [f64; 2],
}

impl FilterFigures {
    /// Figures of a run; none without a reference.
    #[must_use]
    pub(crate) fn of(summary: &Summary) -> Option<Self> {
        let reference = summary.reference.as_ref()?;
        Some(Self {
            position_rms_m: reference.position_rms_m,
            heading_rms_rad: reference.heading_rms_rad,
            nis_mean: summary.consistency.nis_mean,
            nis_mean_bounds95: summary.consistency.nis_mean_bounds95,
        })
    }
}

/// One measure of the gap on the hold-out recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// `log_score`, `heading_drift_rms_rad_60s`, ...
    pub metric: String,
    /// Its value under the nominal simulator.
    pub before: f64,
    /// Its value under the augmented simulator.
    pub after: f64,
    /// Its value for the augmented simulator on its own logs: the best to be expected.
    pub floor: f64,
}
