//! The trail of a diagnosis: everything that was tried between the recording and the verdict, and why it was taken or not.

use crate::effects::Library;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Stage of the diagnosis, in the order in which a reader follows the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TraceStage {
    /// Rows and readings that are used, filled in or removed.
    Data,
    /// Time offsets between streams.
    Clocks,
    /// Each effect and free form added alone to the nominal simulator.
    Screening,
    /// Noise levels as the residuals have them, and single readings far off.
    Readings,
    /// The same recording read in another way: lost ticks restored, late streams put back in time, two levels.
    Preprocessing,
    /// Distribution of the samples, and their level over time, once the set's spectrum is taken out.
    Samples,
    /// Sets of effects, compared by their evidence.
    Sets,
    /// Each further effect or free form beside the best set.
    Additions,
    /// Each effect of the best set left out, all others refitted.
    LeaveOneOut,
    /// Probabilities of the causes.
    Probabilities,
    /// Log score on the recording on which the gap is measured.
    HoldOut,
    /// Names: what of all that was found is told, leads, and is written into the augmented simulator.
    Naming,
}

/// Outcome of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// Goes on to the next stage.
    Taken,
    /// Goes no further.
    Rejected,
    /// Was taken out of the data or out of the account.
    Removed,
    /// A quantity that was estimated.
    Estimated,
    /// A fact that the following stages rest on.
    Noted,
}

/// A constant that decided.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Meaning, in words.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Unit; empty for a ratio.
    pub unit: String,
}

/// One thing that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Stage.
    pub stage: TraceStage,
    /// Ids of the effects, the stream, or the readings.
    pub subject: String,
    /// Outcome.
    pub decision: Decision,
    /// Evidence for it over the alternative, nats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nats: Option<f64>,
    /// The constant that it was held against.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<Limit>,
    /// Reason, in a sentence.
    pub reason: String,
}

impl Step {
    /// A step that no evidence and no constant decided.
    #[must_use]
    pub(crate) fn new(stage: TraceStage, subject: &str, decision: Decision, reason: impl Into<String>) -> Self {
        Self { stage, subject: subject.to_owned(), decision, nats: None, limit: None, reason: reason.into() }
    }

    /// With its evidence, nats; none where there is none, or no finite number.
    #[must_use]
    pub(crate) fn nats(self, nats: impl Into<Option<f64>>) -> Self {
        Self { nats: nats.into().filter(|nats| nats.is_finite()), ..self }
    }

    /// With the constant that decided.
    #[must_use]
    pub(crate) fn limit(self, name: &str, value: f64, unit: &str) -> Self {
        Self { limit: Some(Limit { name: name.into(), value, unit: unit.into() }), ..self }
    }
}

/// Name of a set without effects.
pub(crate) const NOMINAL: &str = "nominal simulator";

/// Notes on a recording as steps of the stage [`TraceStage::Data`].
pub(crate) fn of_notes<'a>(notes: impl IntoIterator<Item = &'a String>) -> impl Iterator<Item = Step> {
    notes.into_iter().map(|note| Step::new(TraceStage::Data, "recording", Decision::Noted, note.as_str()))
}

/// Effects that the user left out of the library, as steps of the stage [`TraceStage::Screening`].
pub(crate) fn of_withheld(library: &Library) -> impl Iterator<Item = Step> {
    let why = "left out of the library by the user";
    library.withheld().map(move |id| Step::new(TraceStage::Screening, id, Decision::Removed, why))
}

/// The largest gain of each id, nats, largest first.
pub(super) fn largest<'a>(gains: impl IntoIterator<Item = (&'a str, f64)>) -> Vec<(&'a str, f64)> {
    let mut by_id: BTreeMap<&str, f64> = BTreeMap::new();
    for (id, gain) in gains {
        by_id.entry(id).and_modify(|known| *known = known.max(gain)).or_insert(gain);
    }
    let mut all: Vec<(&str, f64)> = by_id.into_iter().collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}

/// Steps of the stage [`TraceStage::Additions`]: ids with the gain in ln weight beside the best set, nats.
pub(super) fn of_additions<'a>(gains: impl IntoIterator<Item = (&'a str, f64)>) -> Vec<Step> {
    let one = |(id, gain): (&str, f64)| {
        let reason = if gain > 0.0 {
            "gain where it starts; not added, for its fit gains less or the set is full"
        } else {
            "gain in ln weight beside the best set, with the prior odds of one more"
        };
        let step = Step::new(TraceStage::Additions, id, Decision::Rejected, reason).nats(gain);
        step.limit("gain above which it would be added", 0.0, "nats")
    };
    largest(gains).into_iter().map(one).collect()
}
