//! Steps of a drive's trail: what was screened, how the recording was read, what stands for what.

use super::fit::Compared;
use super::preprocess::hypothesis::PreprocessingHypothesis;
use super::preprocess::reference_extrinsics::Mounting;
use super::preprocess::torque_bandwidth::BETTER;
use crate::gap::drive::options::LARGE;
use crate::gap::selection::search::Member;
use crate::gap::trace::{Decision, Step, TraceStage, largest, of_additions};

/// Ids of what `problem` may add to a set, each with its gain in ln weight, nats.
fn gains<'a>(compared: &'a Compared, members: &[Member]) -> impl Iterator<Item = (&'a str, f64)> + use<'a> {
    let groups = &compared.candidates.groups;
    compared.problem.additions(members).into_iter().map(|((group, _), gain)| (groups[group].id.as_str(), gain))
}

/// Each effect and free form alone where the comparison begins, most gain first: its ln weight over that of the nominal
/// simulator, to first order.
pub(super) fn screened(compared: &Compared) -> Vec<Step> {
    let one = |(id, gain): (&str, f64)| {
        let reason = "gain alone, to first order about the model where the comparison begins";
        Step::new(TraceStage::Screening, id, Decision::Estimated, reason).nats(gain)
    };
    largest(gains(compared, &[])).into_iter().map(one).collect()
}

/// Each effect and free form that is still considered and not in the best set of `compared`, beside it.
pub(super) fn added(compared: &Compared) -> Vec<Step> {
    let members = &compared.sets[0].fitted;
    let there = |id: &str| members.iter().any(|m| compared.candidates.groups[m.0].id == id);
    of_additions(gains(compared, members).filter(|(id, _)| !there(id)))
}

/// Share of the torque noise that changes within a step, where it is not constant there.
pub(super) fn torque_bandwidth(best: &PreprocessingHypothesis) -> impl Iterator<Item = Step> + use<> {
    let all = best.record.belief.torque_noise_n_m_sqrt_s.powi(2);
    let share = best.noise.process.ripple / all;
    let reason = format!("{share:.2} of its variance changes within a step: the pose tells");
    let step = Step::new(TraceStage::Readings, "torque noise", Decision::Estimated, reason);
    (share > 0.0).then(|| step.limit("least gain of another share", BETTER, "nats")).into_iter()
}

/// Free forms that are compared, where the gap is so large that most are left out.
pub(super) fn promising(best: &PreprocessingHypothesis) -> impl Iterator<Item = Step> + use<> {
    let step = best.promising.as_ref().map(|ids| {
        let forms: Vec<&str> = ids.iter().map(String::as_str).filter(|id| id.starts_with("free.")).collect();
        let reason = format!("of all free forms these are compared from here on: {}", forms.join(", "));
        let step = Step::new(TraceStage::Screening, "free forms", Decision::Taken, reason);
        step.limit("size of the gap from which on most are left out", LARGE, "nats")
    });
    step.into_iter()
}

/// The recording read with its motion as an unknown input; `taken`: no free form is left.
pub(super) fn unknown_input(taken: bool) -> Step {
    let (decision, reason) = if taken {
        (
            Decision::Taken,
            "the motion before each row asks for a free form, what instruments tell of each other in one row does not",
        )
    } else {
        (Decision::Removed, "a free form is needed without the motion before each row too")
    };
    Step::new(TraceStage::Preprocessing, "motion as an unknown input", decision, reason)
}

/// The mounting of the reference.
pub(super) fn reference(mounting: &Mounting) -> Step {
    Step::new(TraceStage::Data, "reference", Decision::Removed, mounting.said())
}

/// Another way of reading the recording.
pub(super) struct Way<'a> {
    pub(super) name: String,
    /// Its ln weight; what it would have had to be, in words, where it is no account.
    pub(super) top: Result<f64, &'a str>,
}

/// Ways of reading the recording, that as it was recorded first.
pub(super) fn readings(ways: &[Way<'_>]) -> Vec<Step> {
    let best = ways.iter().filter_map(|way| way.top.ok()).fold(f64::NEG_INFINITY, f64::max);
    let told = |name: &str, top: f64| {
        let (decision, reason) = if top == best {
            (Decision::Taken, "the best way: noise and rivals are told by it")
        } else {
            (
                Decision::Estimated,
                "ln weight of its best set under that of the best way; its sets take part in the probabilities",
            )
        };
        Step::new(TraceStage::Preprocessing, name, decision, reason).nats(top - best)
    };
    let one = |way: &Way<'_>| match way.top {
        Ok(top) => told(&way.name, top),
        Err(why) => Step::new(TraceStage::Preprocessing, &way.name, Decision::Rejected, why),
    };
    ways.iter().map(one).collect()
}

impl PreprocessingHypothesis {
    /// Notes a step, in the place of one of the same stage and subject.
    pub(super) fn note(&mut self, step: Step) {
        self.trace.retain(|s| s.stage != step.stage || s.subject != step.subject);
        self.trace.push(step);
    }

    /// Notes a step unless there is one of the same stage and subject.
    pub(super) fn note_unless_known(&mut self, step: Step) {
        if self.trace.iter().all(|s| s.stage != step.stage || s.subject != step.subject) {
            self.trace.push(step);
        }
    }
}
