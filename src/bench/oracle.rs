//! share = (after - before) of the answer / (after - before) of an oracle
//!
//! The oracle is told which effects a case holds, and only fits their parameters; both gains are in the log score of
//! the hold-out recording. Where a case holds small amounts of other effects, the oracle is told of these too, if it
//! does better with them.

use super::intervals::Middle;
use super::runner::case_logs;
use super::workers::each;
use super::worlds::Label;
use crate::effects::Library;
use crate::error::Result;
use crate::gap::known_gain;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Gains in log score of the answer and of the oracle, nats a row of the hold-out recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Gains {
    /// Gain with the effects of the answer.
    pub answer: f64,
    /// Gain with the effects of the label.
    pub oracle: f64,
}

/// Gains of answers relative to an oracle's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct OfOracle {
    /// Answer's gain over the oracle's: median and quartiles over the cases.
    pub share: Middle,
    /// Summed gain of all answers over that of all oracles.
    pub total: f64,
    /// Cases without a ratio: the oracle gains nothing, cannot be fitted, or the answer has no log score.
    pub without: usize,
}

/// Gains in log score of answers and oracle, for every case with listed effects and an answer, `jobs` at a time (0: one
/// a core); none for a case without a ratio. `progress` is called with (done, all).
///
/// # Errors
/// Errors of reading a case.
pub(crate) fn oracle(
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
    let found = each(&cases, jobs, progress, |_, (name, label)| {
        let (config, fit, hold) = case_logs(&folder.join(name))?;
        let main: Vec<&str> = label.effects.keys().map(String::as_str).collect();
        let beside = label.background.iter().map(String::as_str).filter(known);
        let all: Vec<&str> = main.iter().copied().chain(beside).collect();
        let told = if all.len() > main.len() { vec![main, all] } else { vec![main] };
        // an effect that the recording cannot show cannot be fitted
        let gain = |ids: &Vec<&str>| known_gain(&config, &fit, hold.as_ref()?, &library, ids).ok();
        let oracle = told.iter().filter_map(gain).filter(|g| *g > 0.0).reduce(f64::max);
        let gains = oracle.zip(answered(&answers[*name])).map(|(oracle, answer)| Gains { answer, oracle });
        Ok(((*name).clone(), gains))
    })?;
    Ok(found.into_iter().collect())
}

/// Gain of an answer in log score, nats a row; none where it states none.
fn answered(answer: &Value) -> Option<f64> {
    let score = answer["gap"].as_array()?.iter().find(|m| m["metric"] == "log_score")?;
    Some(score["after"].as_f64()? - score["before"].as_f64()?)
}

impl OfOracle {
    /// Over all cases; none without any ratio.
    #[must_use]
    pub(crate) fn of(gains: &BTreeMap<String, Option<Gains>>) -> Option<Self> {
        let there: Vec<Gains> = gains.values().copied().flatten().collect();
        let share = Middle::of(there.iter().map(|g| g.answer / g.oracle))?;
        let total = there.iter().map(|g| g.answer).sum::<f64>() / there.iter().map(|g| g.oracle).sum::<f64>();
        Some(Self { share, total, without: gains.len() - there.len() })
    }
}
