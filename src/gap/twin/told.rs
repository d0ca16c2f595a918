//! A twin: parameters, quality of its predictions, effects.

use super::refine::Fitting;
use crate::config::Config;
use crate::effects::Parameters;
use crate::gap::answer::{Answer, Metric, Remainder, Verdict};
use crate::math::NORMAL_975;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where a parameter is known from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Provenance {
    /// The simulator's log.
    Log,
    /// The configuration that was given.
    Given,
    /// Neither: a convention, which no reading contradicts.
    Convention,
}

/// A parameter of the twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its value.
    pub value: f64,
    /// Standard deviation; none where the log does not tell it.
    pub std: Option<f64>,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Unit of all of these.
    pub unit: String,
    /// Where it is known from.
    pub source: Provenance,
}

impl Parameter {
    /// Told by the log.
    pub(super) fn told(value: f64, std: f64, unit: &str) -> Self {
        let std = Some(std).filter(|s| s.is_finite());
        let ci95 = std.map(|s| [value - NORMAL_975 * s, value + NORMAL_975 * s]);
        Self { value, std, ci95, unit: unit.into(), source: Provenance::Log }
    }

    /// Told by the log, positive: the interval is even in the logarithm, of standard deviation `std_ln`.
    pub(super) fn positive(value: f64, std_ln: f64, unit: &str) -> Self {
        let told = Self::told(value, value * std_ln, unit);
        let ci95 = told.std.map(|_| [value * (-NORMAL_975 * std_ln).exp(), value * (NORMAL_975 * std_ln).exp()]);
        Self { ci95, ..told }
    }

    /// Not told by the log.
    pub(super) fn kept(value: f64, unit: &str, source: Provenance) -> Self {
        Self { value, std: None, ci95: None, unit: unit.into(), source }
    }
}

/// An effect of the simulator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TwinEffect {
    /// Identifier.
    pub id: String,
    /// Parameters.
    pub parameters: Parameters,
    /// Their standard deviations.
    pub std: Parameters,
    /// Whether the twin holds it as a table `[[effect]]`; what is drawn anew in each run cannot be held.
    pub in_twin: bool,
}

/// How well the twin predicts one channel of the simulator's log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// Channel.
    pub channel: String,
    /// 1 - (mean square of the innovations)/(variance of the readings), one reading ahead.
    pub explained_one_step: f64,
    /// Mean normalised innovation squared; 1 is expected.
    pub nis_mean: f64,
    /// Interval of that in 95 % of runs where the innovations are white and normal.
    pub nis_mean_bounds95: [f64; 2],
    /// Correlation of successive normalised innovations; 0 is expected.
    pub lag_one: f64,
    /// Number of readings.
    pub readings: usize,
}

/// A twin.
#[derive(Debug, Clone)]
pub struct Twin {
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Parameter>,
    /// One-step predictions by channel.
    pub channels: Vec<ChannelFit>,
    /// Errors of the twin over horizons on the simulator's log (`before`), and on its own logs (`floor`).
    pub horizons: Vec<Metric>,
    /// Effects that the simulator has and the nominal model has not.
    pub effects: Vec<TwinEffect>,
    /// Verdict of the diagnosis of the simulator's log against the twin with its effects: `none` where nothing is left.
    pub left: Option<Verdict>,
    /// Part of the gap to the nominal model that the effects leave.
    pub remainder: Option<Remainder>,
    /// Forms without a name that are left, most probable first.
    pub free_forms: Vec<String>,
    /// Number of runs of the simulator.
    pub runs: usize,
    /// Assumptions, and what the log cannot tell, in sentences.
    pub notes: Vec<String>,
    /// The twin as a configuration.
    pub config: Config,
    /// Diagnosis of the simulator's log against it.
    pub(super) account: Option<Answer>,
    /// The fit; none at rest.
    pub(super) fitting: Option<Fitting>,
}

impl Twin {
    /// As commands write it: parameters, how well it does, effects of the simulator.
    #[must_use]
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "parameters": self.parameters,
            "fit": {
                "channels": self.channels,
                "horizons": self.horizons,
                "left": self.left,
                "remainder": self.remainder,
                "free_forms": self.free_forms,
            },
            "effects": self.effects,
            "runs": self.runs,
            "notes": self.notes,
        })
    }
}
