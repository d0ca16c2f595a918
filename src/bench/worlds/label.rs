//! Label of a case: the truth that a diagnosis is scored against.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parameters by name, the unit in the name.
pub(crate) type Parameters = BTreeMap<String, f64>;

/// How clearly the weakest main effect shows, by its expected log-likelihood ratio over the log of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Strength {
    /// No effect.
    None,
    /// 4 to 12 nats.
    Weak,
    /// 12 to 100 nats.
    Medium,
    /// 100 to 3000 nats.
    Strong,
}

impl Strength {
    /// Its nats, from and to.
    #[must_use]
    pub(crate) fn nats(self) -> [f64; 2] {
        match self {
            Self::None => [0.0, 0.0],
            Self::Weak => [4.0, 12.0],
            Self::Medium => [12.0, 100.0],
            Self::Strong => [100.0, 3000.0],
        }
    }

    /// Its name in labels.
    #[must_use]
    pub(crate) fn id(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Weak => "weak",
            Self::Medium => "medium",
            Self::Strong => "strong",
        }
    }
}

/// Where an effect shows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Place {
    /// Channel.
    pub channel: String,
    /// From when to when, s, as in the fit log.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<[f64; 2]>,
    /// From which to which frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frequency_hz: Option<[f64; 2]>,
    /// Variable that the effect follows, such as `speed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<String>,
}

impl Place {
    /// In the gyro's channel.
    pub(super) fn gyro() -> Self {
        Self { channel: "gyro".into(), ..Self::default() }
    }

    /// In the gyro's channel, following `condition`.
    pub(super) fn following(condition: &str) -> Self {
        Self { condition: Some(condition.into()), ..Self::gyro() }
    }
}

/// A clock that disagrees with the gyro's in one recording (in a log without a gyro: with the wheels').
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClockOffset {
    /// `wheels` or `pose`.
    pub channel: String,
    /// `fit` or `hold`.
    pub recording: String,
    /// By how much the channel is stamped late, s; negative: early.
    pub offset_s: f64,
}

/// The label of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Label {
    /// Small amounts of other effects beside the main ones.
    #[serde(default)]
    pub background: Vec<String>,
    /// Main effects with their parameters; unlisted ones have none.
    pub effects: BTreeMap<String, Parameters>,
    /// `stationary` or `driving`.
    pub kind: String,
    /// Expected log-likelihood ratio of each main effect, alone, over the log of the fit, nats.
    #[serde(default)]
    pub nats: BTreeMap<String, f64>,
    /// Strength of the weakest main effect.
    pub strength: Strength,
    /// Where each main effect shows.
    #[serde(rename = "where")]
    pub places: BTreeMap<String, Place>,
    /// Channels that the log lacks.
    #[serde(default)]
    pub without: Vec<String>,
    /// Clocks that disagree; no effect.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub time_offsets: Vec<ClockOffset>,
    /// Habits with which the logs are kept; no effects: `printed`, `csv`, `apart`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<String>,
}
