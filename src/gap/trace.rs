//! The trail of a diagnosis: everything that was tried between the recording and the verdict, and why it was taken or not.

use super::findings::{Findings, Main, Part, WeightedSet};
use serde::{Deserialize, Serialize};

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
    /// A quantity that was estimated, and is used from here on.
    Estimated,
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

    /// With its evidence, nats; none where that is no finite number.
    #[must_use]
    pub(crate) fn nats(self, nats: f64) -> Self {
        Self { nats: nats.is_finite().then_some(nats), ..self }
    }

    /// With the constant that decided.
    #[must_use]
    pub(crate) fn limit(self, name: &str, value: f64, unit: &str) -> Self {
        Self { limit: Some(Limit { name: name.into(), value, unit: unit.into() }), ..self }
    }
}

/// Most sets that are told.
const TOLD: usize = 12;
/// Name of a set without effects.
pub(crate) const NOMINAL: &str = "nominal simulator";

/// Notes on a recording as steps of the stage [`TraceStage::Data`].
pub(super) fn of_notes<'a>(notes: impl IntoIterator<Item = &'a String>) -> impl Iterator<Item = Step> {
    notes.into_iter().map(|note| Step::new(TraceStage::Data, "recording", Decision::Estimated, note.as_str()))
}

/// Ids of the parts of a set, largest share first.
fn subject(parts: &[Part]) -> String {
    let mut all: Vec<&Part> = parts.iter().collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    let ids: Vec<&str> = all.iter().map(|p| p.id.as_str()).collect();
    if ids.is_empty() { NOMINAL.into() } else { ids.join(" + ") }
}

impl Findings {
    /// Steps of the stages that recordings at rest and drives have in common: sets, leaving one out, probabilities.
    #[must_use]
    pub(crate) fn steps(&self) -> Vec<Step> {
        let mut steps = Vec::new();
        let Some(best) = self.sets.first() else { return steps };
        let told = |(i, set): (usize, &WeightedSet)| {
            let decision = if i == 0 { Decision::Taken } else { Decision::Rejected };
            let reason = format!("probability {:.3}", set.probability);
            Step::new(TraceStage::Sets, &subject(&set.parts), decision, reason).nats(set.ln_weight - best.ln_weight)
        };
        // the nominal simulator, however improbable
        let is_told = |(i, set): &(usize, &WeightedSet)| {
            *i == 0 || set.parts.is_empty() || *i < TOLD && set.probability > LEAST_SET
        };
        let (those, rest): (Vec<_>, Vec<_>) = self.sets.iter().enumerate().partition(is_told);
        steps.extend(those.into_iter().map(told));
        let nearest = rest.iter().map(|(_, set)| set.ln_weight).reduce(f64::max);
        steps.extend(nearest.map(|nearest| {
            let probability: f64 = rest.iter().map(|(_, set)| set.probability).sum();
            let reason = format!("together probability {probability:.3}; nats of the best of them");
            let step = Step::new(TraceStage::Sets, &format!("{} further sets", rest.len()), Decision::Rejected, reason);
            step.nats(nearest - best.ln_weight)
        }));
        for part in best.parts.iter().filter(|p| p.named) {
            let presence = self.presence(&part.id);
            let worth = self.is_worth_naming(part.missed_nats, presence);
            let decision = if worth { Decision::Taken } else { Decision::Rejected };
            let reason = match part.missed_nats {
                Some(_) => "evidence that the account loses without it",
                None if part.certain => "read off the numbers themselves",
                None => "not asked: it stands or falls with the probability of being present",
            };
            let step = Step::new(TraceStage::LeaveOneOut, &part.id, decision, reason);
            let step = part.missed_nats.into_iter().fold(step, Step::nats);
            steps.push(step.limit("price of one more effect", self.least_nats, "nats"));
        }
        let top = self.top();
        for (main, probability) in self.mains() {
            let (name, decision) = (
                match &main {
                    Main::None => NOMINAL,
                    Main::Unknown => "a free form: unknown",
                    Main::Effect(id) => id,
                },
                if main == top { Decision::Taken } else { Decision::Rejected },
            );
            if probability < LEAST_TOLD && main != top {
                continue;
            }
            let step = Step::new(
                TraceStage::Probabilities,
                name,
                decision,
                format!("probability {probability:.3} of being the largest part of the gap"),
            );
            steps.push(if main == Main::None {
                step.limit("a gap is asserted where none is less probable than", Self::LEAST_NONE, "")
            } else {
                step
            });
        }
        if self.doubt > 0.0 && !best.parts.is_empty() {
            let reason = format!("probability {:.3}, from how often such answers are wrong", self.doubt);
            let subject = "none of what was compared";
            steps.push(Step::new(TraceStage::Probabilities, subject, Decision::Estimated, reason));
        }
        steps
    }
}

/// Steps of the stage [`TraceStage::Additions`]: ids with the gain in ln weight beside the best set, nats.
pub(super) fn of_additions(gains: &[(&str, f64)]) -> Vec<Step> {
    let one = |(id, gain): &(&str, f64)| {
        let reason = "gain in ln weight beside the best set, with the prior odds of one more";
        let step = Step::new(TraceStage::Additions, id, Decision::Rejected, reason).nats(*gain);
        step.limit("gain above which it would be added", 0.0, "nats")
    };
    let mut largest: Vec<(&str, f64)> = Vec::new();
    for (id, gain) in gains {
        match largest.iter_mut().find(|known| known.0 == *id) {
            Some(known) => known.1 = known.1.max(*gain),
            None => largest.push((id, *gain)),
        }
    }
    largest.sort_by(|a, b| b.1.total_cmp(&a.1));
    largest.iter().map(one).collect()
}

/// Sets less probable than this are counted, not told.
const LEAST_SET: f64 = 5e-4;
/// Causes less probable than this are not told.
const LEAST_TOLD: f64 = 0.005;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::{Calibration, Prior};

    #[test]
    fn a_trail_says_what_was_taken_and_what_it_was_held_against() {
        let part = |id: &str, missed: f64| Part { missed_nats: Some(missed), ..Part::new(id, true, missed) };
        let set = |parts: Vec<Part>, ln_weight| WeightedSet { parts, ln_weight, probability: 0.0 };
        let sets = vec![
            set(Vec::new(), 0.0),
            set(vec![part("small", 1.0), part("large", 40.0)], 41.0),
            set(vec![part("large", 40.0)], 40.0),
        ];
        let prior = Prior::default();
        let findings = Findings::new(sets, &prior, &Calibration::default(), Vec::new());
        let steps = findings.steps();
        let of = |stage| steps.iter().filter(move |s| s.stage == stage).collect::<Vec<_>>();
        let sets = of(TraceStage::Sets);
        assert_eq!(sets.len(), 3);
        assert_eq!(sets.iter().filter(|s| s.decision == Decision::Taken).count(), 1);
        assert!(sets[2].subject == NOMINAL && sets[2].nats.is_some_and(|n| n < -39.0), "{sets:?}");
        for step in of(TraceStage::LeaveOneOut) {
            let limit = step.limit.as_ref().unwrap();
            assert_eq!(limit.value, -prior.ln_named);
            assert_eq!(step.decision == Decision::Taken, step.nats.unwrap() >= limit.value, "{step:?}");
        }
        let taken: Vec<_> =
            of(TraceStage::Probabilities).into_iter().filter(|s| s.decision == Decision::Taken).collect();
        assert_eq!((taken.len(), taken[0].subject.as_str()), (1, "large"));
        // what is written is read back
        let text = serde_json::to_string(&steps).unwrap();
        assert_eq!(serde_json::from_str::<Vec<Step>>(&text).unwrap(), steps);
    }
}
