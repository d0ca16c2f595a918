//! The score of a bench: labels unsealed, the commitment checked, every answer judged.

use super::bands::{Band, bands};
use super::folder::{COMMITMENT, SEALED, names};
use super::intervals::{BINS, Middle, Rate, Roc, bin, expected_calibration_error, perfect_calibration_p95, roc};
use super::judge::{Judged, Wanted, judge};
use super::oracle::OfOracle;
use super::runner::Timing;
use super::seal::{Labels, SealKey, unseal};
use super::worlds::Label;
use crate::error::{Error, ErrorKind, Result};
use crate::math::robust::quantile;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Opens the labels of the bench in `folder`, and holds them against the commitment that was `published`, else against
/// the one in the folder.
///
/// # Errors
/// [`ErrorKind::Io`]; [`ErrorKind::Checksum`] if the key is another, or labels or commitment were changed.
pub(crate) fn labels(folder: &Path, key: &SealKey, published: Option<&str>) -> Result<Labels> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).map_err(|e| Error::io(&path, &e))
    };
    let committed = match published {
        Some(published) => published.to_lowercase(),
        None => String::from_utf8_lossy(&read(COMMITMENT)?).into_owned(),
    };
    let labels = unseal(&read(SEALED)?, key, &committed, &folder.join(SEALED).display().to_string())?;
    let there = names(folder)?;
    if let Some(name) = there.iter().find(|n| !labels.labels.contains_key(*n)) {
        return Err(Error::new(ErrorKind::Checksum, folder.display(), "holds a case that is not in the sealed labels")
            .at(name)
            .hint("score the folder as it was made"));
    }
    Ok(labels)
}

/// Labels for a diagnosis whose library lacks `ids`: the single effect of a case then counts as unlisted, and cases
/// with two effects, one of them in `ids`, are dropped.
#[must_use]
pub(crate) fn left_out(labels: BTreeMap<String, Label>, ids: &[String]) -> BTreeMap<String, Label> {
    let lacks = |label: &Label| label.effects.keys().any(|id| ids.contains(id));
    labels
        .into_iter()
        .filter(|(_, label)| label.effects.len() < 2 || !lacks(label))
        .map(|(name, mut label)| {
            if lacks(&label) {
                label.effects = label.effects.into_keys().map(|id| (format!("x.{id}"), BTreeMap::new())).collect();
                label.places = label.places.into_iter().map(|(id, place)| (format!("x.{id}"), place)).collect();
            }
            // an effect that the library lacks cannot be named as a background effect either
            label.background.retain(|id| !ids.contains(id));
            (name, label)
        })
        .collect()
}

/// Reads the answers to the cases of `labels`, a JSON file each; cases without a file are missing in the result.
///
/// # Errors
/// [`ErrorKind::Io`], [`ErrorKind::Format`] for a file that is no JSON.
pub(crate) fn answers(folder: &Path, labels: &BTreeMap<String, Label>) -> Result<BTreeMap<String, Value>> {
    let mut out = BTreeMap::new();
    for name in labels.keys() {
        let path = folder.join(format!("{name}.json"));
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
            Err(e) => return Err(Error::io(&path, &e)),
        };
        let value = serde_json::from_slice(&bytes).map_err(|e| {
            Error::new(ErrorKind::Format, path.display(), format!("is no answer: {e}"))
                .hint("answer the case again with gyroid gap bench run")
        })?;
        out.insert(name.clone(), value);
    }
    Ok(out)
}

/// Reads the durations of the answers, s; empty where the run did not write them.
#[must_use]
pub(crate) fn seconds(folder: &Path) -> Vec<f64> {
    let read = || {
        let bytes = std::fs::read(folder.join("timings.json")).ok()?;
        serde_json::from_slice::<BTreeMap<String, Timing>>(&bytes).ok()
    };
    read().map(|all| all.values().map(|t| t.seconds).collect()).unwrap_or_default()
}

/// A case that was answered wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Miss {
    /// The answer, judged.
    #[serde(flatten)]
    pub judged: Judged,
    /// Kind of miss, in words.
    pub cause: String,
}

/// One bin of the reliability diagram.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Bin {
    /// Mean confidence of its answers.
    pub confidence: f64,
    /// Share of its answers that are right.
    #[serde(flatten)]
    pub rate: Rate,
}

/// Reliability of the stated confidence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Calibration {
    /// Expected calibration error over ten bins; none without confidences.
    pub ece: Option<f64>,
    /// 95th percentile of the ECE that a perfectly calibrated method would score with the same confidences.
    pub ece_perfect_p95: Option<f64>,
    /// Number of answers with a confidence.
    pub of: usize,
    /// Bins that hold an answer.
    pub bins: Vec<Bin>,
    /// Answers with a confidence of 0.9 and more that are right.
    pub confident: Rate,
}

/// Answers to cases with one effect, by effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ByEffect {
    /// The effect.
    pub id: String,
    /// Rate over all strengths.
    pub all: Rate,
    /// By strength: `weak`, `medium`, `strong`.
    pub strengths: BTreeMap<&'static str, Rate>,
    /// Relative error of each parameter where the effect was named.
    pub parameter_errors: BTreeMap<String, Middle>,
}

/// Confusion matrix of cases with one effect, none, or an unlisted one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Confusion {
    /// Truths, the rows.
    pub truths: Vec<String>,
    /// Answers, the columns.
    pub answers: Vec<String>,
    /// Counts, row by row.
    pub counts: Vec<usize>,
}

/// The score of a bench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Score {
    /// Cases.
    pub cases: usize,
    /// Cases without an answer; they count as wrong.
    pub missing: usize,
    /// Rates by name, in the order of the report: words, rate.
    pub rates: Vec<(&'static str, Rate)>,
    /// One effect, by its nats, beside an oracle; empty where the labels do not state them.
    pub by_nats: Vec<Band>,
    /// Two effects, by the nats of the weaker one, in the same way.
    pub pairs_by_nats: Vec<Band>,
    /// One effect, by effect and strength.
    pub by_effect: Vec<ByEffect>,
    /// Unlisted effects, with the rate of answers of unknown, by effect.
    pub unlisted: Vec<(String, Rate)>,
    /// Calibration of the confidence in the verdict.
    pub calibration: Calibration,
    /// `unknown_probability` against the truth.
    pub unknown_roc: Option<Roc>,
    /// Share of the gap closed by right answers.
    pub gap_closed_right: Option<Middle>,
    /// Share of the gap closed by wrong answers.
    pub gap_closed_wrong: Option<Middle>,
    /// Gains relative to an oracle that is told the effects; none where not computed.
    pub of_oracle: Option<OfOracle>,
    /// Relative error over all parameters of effects that were named right.
    pub parameter_error: Option<Middle>,
    /// Seconds a case: median and 95th percentile.
    pub seconds: Option<[f64; 2]>,
    /// Confusion matrix.
    pub confusion: Confusion,
    /// Wrong answers.
    pub misses: Vec<Miss>,
}

/// Seed of the simulated perfectly calibrated methods, fixed so that equal answers have equal scores.
const PERFECT_SEED: u64 = 1;

/// Judges the answer to each case of `labels`; one that is not there is judged too.
#[must_use]
pub(crate) fn judged(labels: &BTreeMap<String, Label>, answers: &BTreeMap<String, Value>) -> Vec<Judged> {
    labels.iter().map(|(name, label)| judge(name, label, answers.get(name))).collect()
}

/// Scores `answers` (by case; one that is missing is wrong) against `labels`; `seconds` are those of the answers.
#[must_use]
pub(crate) fn score(labels: &BTreeMap<String, Label>, answers: &BTreeMap<String, Value>, seconds: &[f64]) -> Score {
    let judged = judged(labels, answers);
    let identified = || judged.iter().filter(|j| j.wanted == Wanted::Identified);
    let single = || identified().filter(|j| j.truth.len() == 1);
    let pairs = || identified().filter(|j| j.truth.len() == 2);
    let of = |wanted: Wanted| judged.iter().filter(move |j| j.wanted == wanted);
    let weak = || single().filter(|j| j.strength == "weak");
    let clear = |messy: bool| single().filter(move |j| j.strength != "weak" && j.messy == messy);
    let right = |j: &Judged| j.right;
    let rates = vec![
        ("one effect, alone: named", Rate::count(single().filter(|j| !j.messy).map(right))),
        ("one effect, a little of others beside it: named", Rate::count(single().filter(|j| j.messy).map(right))),
        ("one effect, weak: named", Rate::count(weak().map(right))),
        ("one effect, weak: named, or said none, or in a class of three", Rate::count(weak().map(|j| j.fair))),
        ("one effect, medium: named", Rate::count(single().filter(|j| j.strength == "medium").map(right))),
        ("one effect, strong: named", Rate::count(single().filter(|j| j.strength == "strong").map(right))),
        ("one effect, alone: nothing else named", Rate::count(single().filter(|j| !j.messy).map(|j| j.exact))),
        ("one effect, alone, medium or strong: nothing named beside it", Rate::count(clear(false).map(|j| j.clean))),
        ("one effect, a little of others, medium or strong: named", Rate::count(clear(true).map(right))),
        ("two effects: both named, nothing else", Rate::count(pairs().map(|j| j.exact))),
        ("two effects: main one is one of them", Rate::count(pairs().map(right))),
        ("no effect: said none", Rate::count(of(Wanted::None).map(right))),
        ("no effect: an effect or unknown (false alarm)", Rate::count(of(Wanted::None).map(alarms))),
        ("unlisted effect: said unknown", Rate::count(of(Wanted::Unknown).map(right))),
        ("channel right, where the effect is", Rate::count(judged.iter().filter_map(|j| j.channel))),
        ("frequency or condition right, where the effect is", Rate::count(judged.iter().filter_map(|j| j.place))),
        ("clock that disagrees: offset found", Rate::count(judged.iter().flat_map(|j| j.offsets.iter().copied()))),
    ];
    let closed = |right: bool| {
        let named = judged.iter().filter(move |j| j.right == right);
        Middle::of(named.filter_map(|j| j.gap_closed))
    };
    let with_unknown = judged.iter().filter_map(|j| Some((j.unknown_probability?, j.wanted == Wanted::Unknown)));
    let mut seconds = seconds.to_vec();
    Score {
        cases: judged.len(),
        missing: judged.iter().filter(|j| j.answered == "missing").count(),
        rates,
        by_nats: bands(&judged, 1),
        pairs_by_nats: bands(&judged, 2),
        by_effect: by_effect(single()),
        unlisted: unlisted(of(Wanted::Unknown)),
        calibration: calibration(&judged),
        unknown_roc: roc(&with_unknown.collect::<Vec<_>>()),
        gap_closed_right: closed(true),
        gap_closed_wrong: closed(false),
        of_oracle: None,
        parameter_error: Middle::of(judged.iter().flat_map(|j| j.errors.values().copied())),
        seconds: (!seconds.is_empty()).then(|| [0.5, 0.95].map(|p| quantile(&mut seconds, p))),
        confusion: confusion(&judged),
        misses: judged.iter().filter(|j| !j.right).map(miss).collect(),
    }
}

fn by_effect<'a>(single: impl Iterator<Item = &'a Judged>) -> Vec<ByEffect> {
    let mut groups: BTreeMap<&str, Vec<&Judged>> = BTreeMap::new();
    for j in single {
        groups.entry(j.truth[0].as_str()).or_default().push(j);
    }
    let one = |(id, group): (&str, Vec<&Judged>)| {
        let at = |strength| Rate::count(group.iter().filter(|j| j.strength == strength).map(|j| j.right));
        let mut errors: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for (name, error) in group.iter().flat_map(|j| &j.errors) {
            errors.entry(name.clone()).or_default().push(*error);
        }
        ByEffect {
            id: id.into(),
            all: Rate::count(group.iter().map(|j| j.right)),
            strengths: ["weak", "medium", "strong"].map(|s| (s, at(s))).into(),
            parameter_errors: errors.into_iter().filter_map(|(n, v)| Some((n, Middle::of(v)?))).collect(),
        }
    };
    groups.into_iter().map(one).collect()
}

fn unlisted<'a>(cases: impl Iterator<Item = &'a Judged>) -> Vec<(String, Rate)> {
    let mut groups: BTreeMap<&str, Vec<bool>> = BTreeMap::new();
    for j in cases {
        groups.entry(j.truth[0].as_str()).or_default().push(j.right);
    }
    groups.into_iter().map(|(id, right)| (id.to_string(), Rate::count(right))).collect()
}

fn calibration(judged: &[Judged]) -> Calibration {
    let pairs: Vec<(f64, bool)> = judged.iter().filter_map(|j| Some((j.confidence?, j.right))).collect();
    let confidences: Vec<f64> = pairs.iter().map(|p| p.0).collect();
    let bins = (0..BINS).filter_map(|b| {
        let inside: Vec<_> = pairs.iter().filter(|p| bin(p.0) == b).collect();
        let confidence = inside.iter().map(|p| p.0).sum::<f64>() / inside.len() as f64;
        (!inside.is_empty()).then(|| Bin { confidence, rate: Rate::count(inside.iter().map(|p| p.1)) })
    });
    let some = |x: f64| (!pairs.is_empty()).then_some(x);
    Calibration {
        ece: some(expected_calibration_error(&pairs)),
        ece_perfect_p95: some(perfect_calibration_p95(&confidences, PERFECT_SEED)),
        of: pairs.len(),
        bins: bins.collect(),
        confident: Rate::count(pairs.iter().filter(|p| p.0 >= 0.9).map(|p| p.1)),
    }
}

/// Verdict of an answer that tells neither a gap nor none.
const ABSTAINED: &str = "cannot_tell";

/// Row of the confusion matrix: the effect, `none`, or `unknown` for the unlisted.
fn truth_row(j: &Judged) -> Option<&str> {
    match (j.wanted, j.truth.as_slice()) {
        (Wanted::None, _) => Some("none"),
        (Wanted::Unknown, _) => Some("unknown"),
        (Wanted::Identified, [one]) => Some(one),
        _ => None,
    }
}

fn confusion(judged: &[Judged]) -> Confusion {
    let all: Vec<(&str, &str)> = judged.iter().filter_map(|j| Some((truth_row(j)?, j.answered.as_str()))).collect();
    // effects in alphabetical order, verdicts behind them
    let last = ["none", "unknown", "missing"];
    let order = |names: Vec<&str>| -> Vec<String> {
        let mut names = names;
        names.sort_by_key(|n| (last.iter().position(|l| l == n).map_or(0, |i| i + 1), *n));
        names.dedup();
        names.into_iter().map(String::from).collect()
    };
    let truths = order(all.iter().map(|p| p.0).collect());
    // every truth has its column: right answers lie on the diagonal
    let answers = order(all.iter().flat_map(|p| [p.0, p.1]).collect());
    let count = |truth: &String, answer: &String| all.iter().filter(|p| p.0 == truth && p.1 == answer).count();
    let counts = truths.iter().flat_map(|t| answers.iter().map(move |a| count(t, a))).collect();
    Confusion { truths, answers, counts }
}

/// An effect, or a gap without a name: an answer that does not tell is neither.
fn alarms(j: &Judged) -> bool {
    !j.right && j.answered != ABSTAINED
}

fn miss(j: &Judged) -> Miss {
    let cause = match (j.wanted, j.answered.as_str()) {
        (_, "missing") => "no answer".to_string(),
        (Wanted::None, "unknown") => "false alarm: a gap where there is none".into(),
        (Wanted::None, ABSTAINED) => "there is nothing, and the answer does not tell".into(),
        (Wanted::None, other) => format!("false alarm: {other} where there is nothing"),
        (Wanted::Unknown, "none") => "an unlisted effect was not seen".into(),
        (Wanted::Unknown, ABSTAINED) => "an unlisted effect, and the answer does not tell".into(),
        (Wanted::Unknown, other) => format!("an unlisted effect was taken for {other}"),
        (Wanted::Identified, "none") => "not seen".into(),
        (Wanted::Identified, "unknown") => "seen, and its form not recognised".into(),
        (Wanted::Identified, other) if j.fair => format!("taken for {other}, which the answer says it cannot separate"),
        (Wanted::Identified, other) => format!("taken for {other}"),
    };
    Miss { judged: j.clone(), cause }
}
