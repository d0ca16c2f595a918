//! The answer of a diagnosis: what `--json` writes.

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
    /// There is a gap, and no effect of the library explains most of it.
    Unknown,
}

/// Answers to: where does the gap lie, which effect causes it, how far does it shrink.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The effect that closes most of the gap in held-out log score; none unless identified.
    pub main: Option<String>,
    /// Probability that `main` is right.
    pub main_probability: f64,
    /// Probability that the nominal simulator lacks nothing.
    pub none_probability: f64,
    /// Probability that what it lacks most is not in the library.
    pub unknown_probability: f64,
    /// Effects that were considered, most probable first.
    pub effects: Vec<EffectAnswer>,
    /// Effects judged present.
    pub together: Vec<String>,
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
}

/// One effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectAnswer {
    /// Identifier.
    pub id: String,
    /// Posterior probability that it is present.
    pub probability: f64,
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
