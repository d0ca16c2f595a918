//! Steps of a drive's trail: what was screened, how the recording was read, what stands for what.

use super::branch::Branch;
use super::fit::Compared;
use crate::gap::trace::{Decision, Step, TraceStage, of_additions};

/// Each effect and free form alone where the comparison begins, most gain first: its ln weight over that of the nominal simulator, to
/// first order.
pub(super) fn screened(compared: &Compared) -> Vec<Step> {
    let mut gains: Vec<(&str, f64)> = Vec::new();
    for ((group, _), gain) in compared.problem.additions(&[]) {
        let id = compared.candidates.groups[group].id.as_str();
        match gains.iter_mut().find(|known| known.0 == id) {
            Some(known) => known.1 = known.1.max(gain),
            None => gains.push((id, gain)),
        }
    }
    gains.sort_by(|a, b| b.1.total_cmp(&a.1));
    let one = |(id, gain): (&str, f64)| {
        let reason = "gain in ln weight over the nominal simulator, alone, to first order; all take part in the search";
        Step::new(TraceStage::Screening, id, Decision::Estimated, reason).nats(gain)
    };
    gains.into_iter().map(one).collect()
}

/// Each effect and free form that is not in the best set of `compared`, beside it.
pub(super) fn added(compared: &Compared) -> Vec<Step> {
    let members = &compared.sets[0].members;
    let groups = &compared.candidates.groups;
    let there = |id: &str| members.iter().any(|m| groups[m.0].id == id);
    let additions = compared.problem.additions(members);
    let gains: Vec<(&str, f64)> =
        additions.iter().map(|((group, _), gain)| (groups[*group].id.as_str(), *gain)).collect();
    let others: Vec<(&str, f64)> = gains.into_iter().filter(|(id, _)| !there(id)).collect();
    of_additions(&others)
}

/// Ways of reading the recording, as it is first: name, and what it came to; none where no such account came near.
pub(super) fn readings(as_is: &Branch, others: &[(String, Option<&Branch>)]) -> Vec<Step> {
    let tops = others.iter().filter_map(|other| other.1.map(Branch::top));
    let best = tops.fold(as_is.top(), f64::max);
    let told = |name: &str, branch: &Branch| {
        let decision = if branch.top() == best { Decision::Taken } else { Decision::Rejected };
        let reason = "ln weight of the best set, the recording read in this way, under that of the best way";
        Step::new(TraceStage::Preprocessing, name, decision, reason).nats(branch.top() - best)
    };
    let other = |(name, branch): &(String, Option<&Branch>)| match branch {
        Some(branch) => told(name, branch),
        None => Step::new(TraceStage::Preprocessing, name, Decision::Rejected, "no account of it comes near"),
    };
    std::iter::once(told("as recorded", as_is)).chain(others.iter().map(other)).collect()
}

impl Branch {
    /// Notes a step, in the place of one of the same stage and subject.
    pub(super) fn note(&mut self, step: Step) {
        self.trace.retain(|s| s.stage != step.stage || s.subject != step.subject);
        self.trace.push(step);
    }
}
