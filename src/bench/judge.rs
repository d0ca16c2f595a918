//! right = the effect that was named is in the case; or the verdict is none, or unknown, where that is the truth
//!
//! One answer against one label, by the contract's rules: what an answer leaves out is read as the rules read it, so that
//! answers of other tools can be scored too.

use super::worlds::{ClockOffset, Label, Place};
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Ids of effects that are in no list begin so.
const UNLISTED: &str = "x.";

/// Two radii, written in two ways: where any two of these are in a robot, each of the others is another name for them.
const RADII: [&str; 4] = ["wheel.radius_left", "wheel.radius_right", "wheel.radius_scale", "wheel.radius_mismatch"];

/// The verdict that would be right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Wanted {
    /// There is no effect.
    None,
    /// There are effects of the library.
    Identified,
    /// There is an effect that is in no list.
    Unknown,
}

/// An answer, judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Judged {
    /// The case.
    pub name: String,
    /// The verdict that would be right.
    pub wanted: Wanted,
    /// Main effects of the case.
    pub truth: Vec<String>,
    /// How strong the weakest of them is: `weak`, `medium`, `strong`, `none`.
    pub strength: &'static str,
    /// Expected log-likelihood ratio of the weakest of them, alone, nats; none where the label does not state it.
    pub nats: Option<f64>,
    /// Whether small amounts of others lie beside them.
    pub messy: bool,
    /// The effect that was named, or the verdict; `missing` without an answer.
    pub answered: String,
    /// Whether that is right.
    pub right: bool,
    /// Right, or said none, or in a class of at most three with the truth that the answer says it cannot separate.
    pub fair: bool,
    /// Whether all main effects were named, and nothing that is not there.
    pub exact: bool,
    /// Whether nothing was named that is not there.
    pub clean: bool,
    /// Whether the channel is right, where the effect is.
    pub channel: Option<bool>,
    /// Whether frequency or condition is right, where the effect is and has one.
    pub place: Option<bool>,
    /// Relative error of each parameter, 1 at most, where the effect is right.
    pub errors: BTreeMap<String, f64>,
    /// Share of the gap that the named effect closed.
    pub gap_closed: Option<f64>,
    /// Probability that the answer gives its own verdict.
    pub confidence: Option<f64>,
    /// Probability that the answer gives 'unknown'.
    pub unknown_probability: Option<f64>,
    /// Of each clock's offset in the case, whether the answer has it; none without an answer.
    pub offsets: Vec<bool>,
    /// Probability that the answer gives each true effect.
    pub truth_probability: BTreeMap<String, f64>,
}

/// Judges `answer` (none: there is no answer) to the case `name` with this `label`.
#[must_use]
pub(crate) fn judge(name: &str, label: &Label, answer: Option<&Value>) -> Judged {
    let missing = serde_json::json!({"verdict": "missing", "effects": []});
    let answer = answer.unwrap_or(&missing);
    let truth: Vec<String> = label.effects.keys().cloned().collect();
    let wanted = match truth.first() {
        None => Wanted::None,
        Some(id) if id.starts_with(UNLISTED) => Wanted::Unknown,
        Some(_) => Wanted::Identified,
    };
    let verdict = answer["verdict"].as_str().unwrap_or("missing");
    let probability = |e: &Value| e["probability"].as_f64().unwrap_or(0.0);
    let mut ranked: Vec<&Value> = answer["effects"].as_array().into_iter().flatten().collect();
    ranked.sort_by(|a, b| probability(b).total_cmp(&probability(a)));
    let of = |id: &str| ranked.iter().find(|e| e["id"] == id).copied();

    let main = answer["main"].as_str().filter(|m| !m.is_empty()).or_else(|| ranked.first()?["id"].as_str());
    let answered = match main {
        Some(main) if verdict == "identified" => main,
        _ => verdict,
    }
    .to_string();
    let is_in = |id: &str| truth.iter().any(|t| t == id);
    let right = match wanted {
        Wanted::None => verdict == "none",
        Wanted::Unknown => verdict == "unknown",
        Wanted::Identified => is_in(&answered),
    };

    let ids = |v: &Value| -> BTreeSet<String> {
        v.as_array().into_iter().flatten().filter_map(|id| id.as_str().map(String::from)).collect()
    };
    let mut named = ids(&answer["together"]);
    if named.is_empty() && verdict == "identified" {
        named.insert(answered.clone());
    }
    let there = |id: &str| is_in(id) || label.background.iter().any(|b| b == id);
    let both_radii = RADII.iter().filter(|id| there(id)).count() >= 2;
    let allowed = |id: &String| there(id) || (both_radii && RADII.contains(&id.as_str()));
    let clean = named.iter().all(allowed);
    let exact = clean && truth.iter().all(|t| named.contains(t));
    let in_class = answer["cannot_tell_apart"].as_array().into_iter().flatten().any(|class| {
        let (length, class) = (class.as_array().map_or(0, Vec::len), ids(class));
        length <= 3 && class.contains(&answered) && truth.iter().any(|t| class.contains(t))
    });

    let found = (wanted == Wanted::Identified && right).then(|| label.places.get(&answered)).flatten();
    let place = &answer["where"];
    let confidence = match (verdict, answer.get("main_probability")) {
        ("identified", Some(p)) => p.as_f64(),
        ("identified", None) => of(&answered).map(probability),
        _ => answer[format!("{verdict}_probability")].as_f64(),
    };
    let truth_probability = truth.iter().filter_map(|t| Some((t.clone(), of(t)?["probability"].as_f64()?))).collect();
    Judged {
        name: name.into(),
        wanted,
        strength: label.strength.id(),
        nats: label.nats.values().copied().reduce(f64::min),
        messy: !label.background.is_empty(),
        right,
        fair: right || answered == "none" || in_class,
        exact,
        clean,
        channel: found.map(|t| wheels(place["channel"].as_str().unwrap_or("")) == wheels(&t.channel)),
        place: found.and_then(|t| placed(place, t)),
        errors: if found.is_some() { errors(&label.effects[&answered], of(&answered)) } else { BTreeMap::new() },
        gap_closed: of(&answered).and_then(|e| e["gap_closed"].as_f64()),
        confidence,
        unknown_probability: answer["unknown_probability"].as_f64(),
        offsets: if verdict == "missing" { Vec::new() } else { offsets(label, answer) },
        truth_probability,
        truth,
        answered,
    }
}

/// An offset of a clock is right within so many of its standard deviations, and within so much, s: rows tell no more.
const OFFSET_STDS: f64 = 4.0;
const OFFSET_S: f64 = 0.03;

/// Whether each clock's offset is in the answer; one that is not there is taken as zero.
fn offsets(label: &Label, answer: &Value) -> Vec<bool> {
    let told: Vec<&Value> = answer["time_offsets"].as_array().into_iter().flatten().collect();
    let one = |truth: &ClockOffset| {
        let is_it = |o: &&&Value| o["channel"] == truth.channel.as_str() && o["recording"] == truth.recording.as_str();
        let found = told.iter().find(is_it);
        let number = |name: &str| found.and_then(|o| o[name].as_f64()).unwrap_or(0.0);
        (number("offset_s") - truth.offset_s).abs() <= (OFFSET_STDS * number("std_s")).max(OFFSET_S)
    };
    label.time_offsets.iter().map(one).collect()
}

/// Both wheels are one channel.
fn wheels(channel: &str) -> &str {
    if matches!(channel, "wheel_left" | "wheel_right") { "wheels" } else { channel }
}

/// Whether the frequency of a tone, or the condition, is right; none where the truth has neither.
fn placed(place: &Value, truth: &Place) -> Option<bool> {
    // a line: a band is as wide as the noise in it
    if let Some([at, _]) = truth.frequency_hz.filter(|[low, high]| low == high) {
        let band = &place["frequency_hz"];
        let low = band.as_f64().or_else(|| band[0].as_f64()).unwrap_or(f64::NAN);
        let high = band.as_f64().or_else(|| band[1].as_f64()).unwrap_or(f64::NAN);
        return Some(low * 0.98 <= at && at <= high * 1.02 && high <= 1.5 * low + 1e-3);
    }
    truth.condition.as_ref().map(|c| place["condition"].as_str() == Some(c))
}

/// Relative errors, 1 at most; one that is missing counts as 1. Headings count in radians on the circle.
fn errors(truth: &BTreeMap<String, f64>, answer: Option<&Value>) -> BTreeMap<String, f64> {
    let one = |(name, value): (&String, &f64)| {
        let guess = answer.and_then(|e| e["parameters"][name].as_f64());
        let error = guess.map_or(f64::INFINITY, |guess| {
            let off = (guess - value).abs();
            if name.ends_with("heading_rad") {
                let turn = std::f64::consts::TAU;
                (off - turn * (off / turn).round_ties_even()).abs()
            } else {
                off / if *value == 0.0 { 1.0 } else { value.abs() }
            }
        });
        (name.clone(), error.min(1.0))
    };
    truth.iter().map(one).collect()
}
