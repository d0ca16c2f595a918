//! The answer of a diagnosis: what `--json` writes.

use super::trace::Step;
use crate::effects::Parameters;
use crate::navigate::Summary;
use serde::{Deserialize, Serialize};

/// What the diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The nominal simulator explains the recording.
    None,
    /// An effect of the library explains most of the gap.
    Identified,
    /// There is a gap, and the named effects together do not explain most of it.
    Unknown,
    /// The channels that are there test nothing: no two of them say the same thing twice (drives only).
    CannotTell,
}

/// Answers to: where does the gap lie, which effect causes it, how far does it shrink.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The effect that closes most of the gap in held-out log score. Never one that is idle; under `unknown` the named effect that
    /// closes most, if there is one; none under `none` and `cannot_tell`.
    pub main: Option<String>,
    /// Probability that `main` is right.
    pub main_probability: f64,
    /// Probability that the nominal simulator lacks nothing.
    pub none_probability: f64,
    /// Probability that what it lacks most is not in the library.
    pub unknown_probability: f64,
    /// Effects that were considered, most probable first.
    pub effects: Vec<EffectAnswer>,
    /// Effects judged present that are not idle, whatever the verdict.
    pub together: Vec<String>,
    /// Part of the gap that the named effects leave, and where it lies; none where there is no gap.
    #[serde(default)]
    pub remainder: Option<Remainder>,
    /// Clocks that disagree, each recording on its own.
    #[serde(default)]
    pub time_offsets: Vec<TimeOffset>,
    /// Where no effect explains most: the one of the library that explains most alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nearest: Option<Nearest>,
    /// Classes of effects that this log cannot separate.
    pub cannot_tell_apart: Vec<Vec<String>>,
    /// For each class, in the same order: how alike, and what would separate them.
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
    /// The gap on the recording kept back.
    pub gap: Vec<Metric>,
    /// Of drives with a pose in the recording kept back: the navigation filter on it, before and after it got what was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub navigation: Option<FilterGain>,
    /// How the gap was measured, and what could not be told, in sentences.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Everything that was tried, by stages, and why it was taken or not.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trace: Vec<Step>,
}

/// One effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectAnswer {
    /// Identifier.
    pub id: String,
    /// Posterior probability that it is present.
    pub probability: f64,
    /// ln evidence that the account loses if this effect is left out and all others are fitted anew, nats.
    #[serde(default)]
    pub evidence_nats: Option<f64>,
    /// Whether it is present beyond doubt, and yet closes nothing of the gap that can be measured.
    #[serde(default)]
    pub idle: bool,
    /// Parameters (posterior mode).
    pub parameters: Parameters,
    /// Their standard deviations.
    pub std: Parameters,
    /// (before - after) / (before - floor) in log score, of this effect alone.
    pub gap_closed: Option<f64>,
    /// Its interval, by blocks of time.
    pub gap_closed_ci95: Option<[f64; 2]>,
    /// Its share of what all that were found close together (mean of first in and last in).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
}

impl EffectAnswer {
    /// An effect of which nothing but its probability of being present is known.
    #[must_use]
    pub fn new(id: &str, probability: f64) -> Self {
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

/// A stream whose clock disagrees with the gyro's (without a gyro: with the wheels').
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
    /// What it explains alone of what was explained in the recording, 0 to 1.
    pub share: f64,
    /// The gap on the recording kept back, `after` with it alone.
    pub gap: Vec<Metric>,
}

/// A class of effects that look alike on this log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alike {
    /// Their ids.
    pub ids: Vec<String>,
    /// Overlap of what they do to this log, 0 to 1.
    pub overlap: f64,
    /// What would separate them.
    pub separate_by: String,
}

/// Where the gap lies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Place {
    /// Channel.
    pub channel: String,
    /// The deficient equation, in words.
    pub equation: String,
    /// From when to when, s, as in the fit log.
    pub time_s: Option<[f64; 2]>,
    /// From which to which frequency, Hz.
    pub frequency_hz: Option<[f64; 2]>,
    /// What it follows.
    pub condition: Option<String>,
    /// For an unknown: what it looks like, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
}

/// A free form that competed as 'unknown'.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FreeFormAnswer {
    /// What is free: `time`, `temperature`, `temperature_rate`, `supply`, `phase`, `spectrum`, ...
    pub id: String,
    /// Probability that it is what the model lacks most.
    pub probability: f64,
    /// What it looks like, in words.
    pub description: String,
}

/// An equation of the nominal model that a free correction would mend.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EquationAnswer {
    /// In words.
    pub equation: String,
    /// Channel of the answer.
    pub channel: String,
    /// What the best correction gains in ln evidence.
    pub gain_nats: f64,
    /// What the best correction follows.
    pub follows: String,
    /// The correction as a signal, of the equations that gain most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<Correction>,
}

/// What has to be added to an equation in the course of a drive: a random walk, as the smoother sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// The process noise that the equation needs, in its unit per √s.
    pub diffusion: f64,
    /// The equation's unit.
    pub unit: String,
    /// What the walk gains in ln likelihood over a constant.
    pub gain_nats: f64,
    /// Probability of as much gain or more where a constant is enough.
    pub p_value: f64,
    /// Whether the signal is about its mean: the level of this equation varies from one run to the next, or cannot be told.
    pub about_mean: bool,
    /// Independent values that the drive knows of the signal.
    pub degrees_of_freedom: f64,
    /// Knots, s, as in the fit log.
    pub times_s: Vec<f64>,
    /// Of several drives: the first knot of each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<usize>,
    /// The signal there; straight between them.
    pub values: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// What it was regressed on, the largest share first.
    pub regressors: Vec<Regressor>,
    /// The first of them at the knots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<Against>,
}

/// A state or an input that a correction was regressed on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Regressor {
    /// `speed`, `yaw_rate`, ...
    pub name: String,
    /// Share of the signal's variance, adjusted for the functions that were fitted.
    pub share: f64,
}

/// A state or an input at the knots of a correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Against {
    /// `speed`, `yaw_rate`, ...
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its mean about each knot.
    pub values: Vec<f64>,
}

/// The navigation filter on the recording kept back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterGain {
    /// With the nominal model.
    pub before: FilterFigures,
    /// With the augmented one.
    pub after: FilterFigures,
}

/// How well a filter navigated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterFigures {
    /// Root mean square distance from the reference, m.
    pub position_rms_m: f64,
    /// Root mean square heading error, rad; none where the reference has no heading.
    pub heading_rms_rad: Option<f64>,
    /// Mean normalised innovation squared of gyro and wheels; expected: 1.
    pub nis_mean: f64,
    /// Between these it lies in 95 % of runs if the model holds.
    pub nis_mean_bounds95: [f64; 2],
}

impl FilterFigures {
    /// Of a run; none without a reference.
    #[must_use]
    pub fn of(summary: &Summary) -> Option<Self> {
        let reference = summary.reference.as_ref()?;
        Some(Self {
            position_rms_m: reference.position_rms_m,
            heading_rms_rad: reference.heading_rms_rad,
            nis_mean: summary.consistency.nis_mean,
            nis_mean_bounds95: summary.consistency.nis_mean_bounds95,
        })
    }
}

/// One measure of the gap on the recording kept back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// `log_score`, `heading_drift_rms_rad_60s`, ...
    pub metric: String,
    /// Under the nominal simulator.
    pub before: f64,
    /// Under the augmented one.
    pub after: f64,
    /// Of the augmented simulator on its own logs.
    pub floor: f64,
}
