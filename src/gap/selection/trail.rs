//! Steps of the trail that recordings at rest and drives have in common: sets, leaving one out, probabilities

use super::findings::Findings;
use super::sets::{Main, Part};
use crate::gap::trace::{Decision, NOMINAL, Step, TraceStage};
use std::collections::BTreeMap;

/// Sets less probable than this are counted, not told.
const LEAST_SET: f64 = 5e-4;
/// Causes less probable than this are not told.
const LEAST_TOLD: f64 = 0.005;
/// Most sets that are told.
const TOLD: usize = 12;

/// Ids of the parts of a set, but for those that every set has.
fn subject(parts: &[Part]) -> String {
    let mut ids: Vec<&str> = parts.iter().filter(|p| !p.certain).map(|p| p.id.as_str()).collect();
    ids.sort_unstable();
    if ids.is_empty() { NOMINAL.into() } else { ids.join(" + ") }
}

impl Findings {
    /// Steps of the stages that recordings at rest and drives have in common: sets, leaving one out, probabilities.
    #[must_use]
    pub(super) fn steps(&self) -> Vec<Step> {
        [self.of_sets(), self.of_leaving_out(), self.of_probabilities(TraceStage::Probabilities)].concat()
    }

    /// The sets, those of the same effects as one; nats: ln odds against the most probable.
    fn of_sets(&self) -> Vec<Step> {
        struct Same {
            probability: f64,
            ln_weight: f64,
        }
        let mut by_subject: BTreeMap<String, Same> = BTreeMap::new();
        for set in &self.sets {
            let same = by_subject
                .entry(subject(&set.parts))
                .or_insert(Same { probability: 0.0, ln_weight: f64::NEG_INFINITY });
            same.probability += set.probability;
            same.ln_weight = same.ln_weight.max(set.ln_weight);
        }
        let mut all: Vec<(String, Same)> = by_subject.into_iter().collect();
        all.sort_by(|a, b| b.1.probability.total_cmp(&a.1.probability).then(b.1.ln_weight.total_cmp(&a.1.ln_weight)));
        let Some(Same { probability: most, ln_weight: top }) = all.first().map(|(_, same)| Same { ..*same }) else {
            return Vec::new();
        };
        // what is too improbable for a number of its own stands by its weight
        let odds = |same: &Same| {
            Some((same.probability / most).ln()).filter(|o| o.is_finite()).unwrap_or(same.ln_weight - top)
        };
        let is_told = |(i, (subject, same)): &(usize, (String, Same))| {
            *i == 0 || subject == NOMINAL || *i < TOLD && same.probability > LEAST_SET
        };
        let (those, rest): (Vec<_>, Vec<_>) = all.into_iter().enumerate().partition(is_told);
        let told = |(i, (subject, same)): &(usize, (String, Same))| {
            let decision = if *i == 0 { Decision::Taken } else { Decision::Estimated };
            Step::new(TraceStage::Sets, subject, decision, format!("probability {:.3}", same.probability))
                .nats(odds(same))
        };
        let mut steps: Vec<Step> = those.iter().map(told).collect();
        if let Some((_, (_, nearest))) = rest.first() {
            let probability: f64 = rest.iter().map(|(_, (_, same))| same.probability).sum();
            let reason = format!("together probability {probability:.3}; nats of the most probable of them");
            let step =
                Step::new(TraceStage::Sets, &format!("{} further sets", rest.len()), Decision::Estimated, reason);
            steps.push(step.nats(odds(nearest)));
        }
        steps
    }

    /// The effects of the most probable set, and the evidence that is lost without each.
    fn of_leaving_out(&self) -> Vec<Step> {
        let named = self.sets.first().into_iter().flat_map(|best| best.parts.iter().filter(|p| p.named));
        let one = |part: &Part| {
            let presence = self.presence(&part.id);
            let worth = self.is_worth_naming(part.missed_nats, presence);
            let decision = if worth { Decision::Taken } else { Decision::Rejected };
            match part.missed_nats {
                Some(nats) => {
                    let reason = "evidence that the account loses without it";
                    let step = Step::new(TraceStage::LeaveOneOut, &part.id, decision, reason).nats(nats);
                    step.limit("price of one more effect", self.least_nats, "nats")
                }
                None if part.certain => {
                    Step::new(TraceStage::LeaveOneOut, &part.id, decision, "read off the numbers themselves")
                }
                None => {
                    let reason = format!("not left out: probability {presence:.3} of being present");
                    let step = Step::new(TraceStage::LeaveOneOut, &part.id, decision, reason);
                    step.limit("least probability of being present", self.least_presence(), "")
                }
            }
        };
        named.map(one).collect()
    }

    /// Probability of each largest cause, as steps of `stage`.
    #[must_use]
    pub(crate) fn of_probabilities(&self, stage: TraceStage) -> Vec<Step> {
        let top = self.top();
        let mains = self.mains();
        let none = mains.iter().find(|m| m.0 == Main::None).map_or(0.0, |m| m.1);
        let mut steps = Vec::new();
        for (main, probability) in mains.iter().filter(|m| m.1 >= LEAST_TOLD || m.0 == top) {
            let decision = if *main == top { Decision::Taken } else { Decision::Rejected };
            let of_cause = format!("probability {probability:.3} that it is the largest part of the gap");
            let step = match main {
                Main::None => {
                    let reason = format!("probability {probability:.3} that there is no gap");
                    Step::new(stage, NOMINAL, decision, reason)
                }
                Main::Unknown => Step::new(stage, "a free form: unknown", decision, of_cause),
                Main::Effect(id) => Step::new(stage, id, decision, of_cause),
            };
            let is_none = *main == Main::None;
            let limit = "probability of no gap from which on none is asserted";
            steps.push(if is_none { step.limit(limit, Self::LEAST_NONE, "") } else { step });
        }
        let left = self.doubt * (1.0 - none);
        if left >= LEAST_TOLD {
            let reason = format!("probability {left:.3}, from how often such answers are wrong");
            steps.push(Step::new(stage, "none of what was compared", Decision::Estimated, reason));
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::selection::sets::WeightedSet;
    use crate::gap::{Calibration, Prior};

    #[test]
    fn a_trail_says_what_was_taken_and_what_it_was_held_against() {
        let part = |id: &str, missed: f64| Part { missed_nats: Some(missed), ..Part::new(id, true, missed) };
        let set = |parts: Vec<Part>, ln_weight| WeightedSet { parts, ln_weight, probability: 0.0 };
        let sets = vec![
            set(Vec::new(), 0.0),
            set(vec![part("small", 1.0), part("large", 40.0)], 44.0),
            set(vec![part("large", 40.0)], 40.0),
            set(vec![part("large", 40.0)], 40.0),
        ];
        let prior = Prior::default();
        let findings = Findings::new(sets, &prior, &Calibration::default(), Vec::new());
        let steps = findings.steps();
        let of = |stage| steps.iter().filter(move |s| s.stage == stage).collect::<Vec<_>>();
        // sets of the same effects are one, and the nominal simulator is told however improbable
        let sets = of(TraceStage::Sets);
        assert_eq!((sets.len(), sets[0].subject.as_str(), sets[1].subject.as_str()), (3, "large + small", "large"));
        assert_eq!(sets.iter().filter(|s| s.decision == Decision::Taken).count(), 1);
        assert!(sets[0].nats == Some(0.0) && sets[2].subject == NOMINAL, "{sets:?}");
        assert!(sets.iter().is_sorted_by(|a, b| a.nats >= b.nats) && sets[2].nats.unwrap() < -30.0, "{sets:?}");
        let left_out = of(TraceStage::LeaveOneOut);
        assert_eq!(left_out.iter().map(|s| s.decision).collect::<Vec<_>>(), [Decision::Rejected, Decision::Taken]);
        for step in left_out {
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
