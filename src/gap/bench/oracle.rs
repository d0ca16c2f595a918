//! share = (after - before) of the answer / (after - before) of an oracle
//!
//! The oracle is told which effects a case holds, and only fits how large they are; both gains are of the log score on the
//! recording kept back. Where small amounts of others lie beside the main effects the oracle is told of these too, if it does
//! better with them.

use super::runner::case_logs;
use super::score::Middle;
use super::workers::each;
use crate::effects::Library;
use crate::error::Result;
use crate::gap::known_gain;
use crate::reality::Label;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What the answer gains and what the oracle does, nats a row of the recording kept back.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gains {
    /// With what was answered.
    pub answer: f64,
    /// With what is there.
    pub oracle: f64,
}

/// Answers beside an oracle's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OfOracle {
    /// Share of the oracle's gain, over the cases.
    pub share: Middle,
    /// Gain of all answers over that of all oracles.
    pub total: f64,
    /// Cases whose effects their recording does not let an oracle gain by, or cannot show.
    pub without: usize,
}

/// Gains in log score of answers and oracle, for every case with listed effects and a recording kept back, `jobs` at a time (0:
/// one a core); none where an oracle gains nothing. `progress` hears (done, all).
///
/// # Errors
/// What reading a case refuses.
pub fn oracle(
    folder: &Path,
    labels: &BTreeMap<String, Label>,
    answers: &BTreeMap<String, Value>,
    jobs: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<BTreeMap<String, Option<Gains>>> {
    let library = Library::new();
    let known = |id: &&str| library.by_id(id).is_some() || library.driving_by_id(id).is_some();
    let listed = |label: &Label| !label.effects.is_empty() && label.effects.keys().all(|id| known(&id.as_str()));
    let cases: Vec<(&String, &Label)> =
        labels.iter().filter(|(name, label)| listed(label) && answers.contains_key(*name)).collect();
    let done = AtomicUsize::new(0);
    let found = each(&cases, jobs, |_, (name, label)| {
        let (config, fit, hold) = case_logs(&folder.join(name))?;
        let main: Vec<&str> = label.effects.keys().map(String::as_str).collect();
        let beside = label.background.iter().map(String::as_str).filter(known);
        let all: Vec<&str> = main.iter().copied().chain(beside).collect();
        let told = if all.len() > main.len() { vec![main, all] } else { vec![main] };
        // what a recording cannot show no oracle can fit
        let gain = |ids: &Vec<&str>| known_gain(&config, &fit, hold.as_ref()?, &library, ids).ok();
        let oracle = told.iter().filter_map(gain).filter(|g| *g > 0.0).reduce(f64::max);
        let gains = oracle.zip(answered(&answers[*name])).map(|(oracle, answer)| Gains { answer, oracle });
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, cases.len());
        Ok(((*name).clone(), gains))
    })?;
    Ok(found.into_iter().collect())
}

/// What an answer gains in log score.
fn answered(answer: &Value) -> Option<f64> {
    let score = answer["gap"].as_array()?.iter().find(|m| m["metric"] == "log_score")?;
    Some(score["after"].as_f64()? - score["before"].as_f64()?)
}

impl OfOracle {
    /// Of all cases; none without any.
    #[must_use]
    pub fn of(gains: &BTreeMap<String, Option<Gains>>) -> Option<Self> {
        let there: Vec<Gains> = gains.values().copied().flatten().collect();
        let share = Middle::of(there.iter().map(|g| g.answer / g.oracle))?;
        let total = there.iter().map(|g| g.answer).sum::<f64>() / there.iter().map(|g| g.oracle).sum::<f64>();
        Some(Self { share, total, without: gains.len() - there.len() })
    }
}
