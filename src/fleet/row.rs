//! One recording as a row: its diagnosis, and the sizes of the effects that are asked about.

use crate::effects::Parameters;
use crate::error::Result;
use crate::gap::{Answer, Explanations, Verdict};
use crate::population::{Kind, Record, Source};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;

/// One recording with its diagnosis. Effects are kept as JSON, in the units of `docs/src/effects.md`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct DriveRow {
    /// The recording, and options of the reader and the diagnosis.
    #[serde(flatten)]
    pub source: Source,
    /// Its verdict.
    pub verdict: Option<Verdict>,
    /// Effects that it judges present and not idle, apart by commas.
    pub named: Option<String>,
    /// The one that explains most.
    pub main: Option<String>,
    /// Its probability.
    pub main_probability: Option<f64>,
    /// Probability that nothing is lacking.
    pub none_probability: Option<f64>,
    /// Probability that the cause is not in the library.
    pub unknown_probability: Option<f64>,
    /// Share of the gap in log score that the main effect closes.
    pub gap_closed: Option<f64>,
    /// Length, s.
    pub span_s: Option<f64>,
    /// Effects with their probabilities and parameters: `[{"id": "wheel.slip", "probability": 0.95, "parameters": {…}, "std": {…}, …}]`.
    pub effects: Option<String>,
    /// Effects that were fitted together, whether they are named or not: `{"asked": […], "effects": {"wheel.slip": {…}}}`.
    pub fitted: Option<String>,
    /// Notes of the reader and of the diagnosis, joined by `; `.
    pub notes: Option<String>,
}

impl Record for DriveRow {
    const COMMAND: &'static str = "gap fleet";
    const TYPES: &'static [(&'static str, Kind)] = &[
        ("verdict", Kind::Text),
        ("named", Kind::Text),
        ("main", Kind::Text),
        ("effects", Kind::Text),
        ("fitted", Kind::Text),
        ("notes", Kind::Text),
    ];

    fn source(&self) -> &Source {
        &self.source
    }

    fn source_mut(&mut self) -> &mut Source {
        &mut self.source
    }
}

/// Effects that were fitted together to a recording.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Fitted {
    /// Those that were asked for.
    pub asked: Vec<String>,
    /// Gain and parameters of each that the recording shows.
    pub effects: BTreeMap<String, FittedEffect>,
}

/// An effect that was fitted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct FittedEffect {
    /// Gain in ln likelihood, nats.
    pub gain_nats: f64,
    /// Parameters.
    pub parameters: Parameters,
    /// Their standard deviations.
    pub std: Parameters,
}

impl DriveRow {
    /// Fills in the diagnosis.
    pub(super) fn fill(&mut self, answer: &Answer, span_s: f64, notes: &[String]) {
        self.verdict = Some(answer.verdict);
        self.named = Some(answer.together.join(","));
        self.main.clone_from(&answer.main);
        self.main_probability = answer.main.is_some().then_some(answer.main_probability);
        self.none_probability = Some(answer.none_probability);
        self.unknown_probability = Some(answer.unknown_probability);
        let main = answer.effects.iter().find(|e| Some(&e.id) == answer.main.as_ref());
        self.gap_closed = main.and_then(|e| e.gap_closed);
        self.span_s = Some(span_s);
        self.effects = Some(json!(answer.effects).to_string());
        let notes: Vec<&str> = notes.iter().chain(&answer.notes).map(String::as_str).collect();
        self.notes = (!notes.is_empty()).then(|| notes.join("; "));
    }

    /// Keeps the fit of `asked`, or why there is none.
    pub(super) fn keep(&mut self, asked: &[String], found: Result<Explanations>) {
        let found = found.map_or_else(
            |why| {
                let notes = self.notes.iter().cloned().chain([format!("{} are not fitted: {why}", asked.join(", "))]);
                self.notes = Some(notes.collect::<Vec<_>>().join("; "));
                Vec::new()
            },
            |found| found.effects,
        );
        let effects = found.iter().map(|e| {
            let parameters = e.parameters.iter().map(|(name, p)| (name.clone(), p.estimate)).collect();
            let std = e.parameters.iter().map(|(name, p)| (name.clone(), p.std)).collect();
            (e.id.clone(), FittedEffect { gain_nats: e.gain_nats, parameters, std })
        });
        let fitted = Fitted { asked: asked.to_vec(), effects: effects.collect() };
        self.fitted = Some(json!(fitted).to_string());
    }

    /// The fit; empty where nothing was asked for.
    #[must_use]
    pub(crate) fn fitted(&self) -> Fitted {
        self.fitted.as_deref().and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
    }

    /// Ids of the effects that the diagnosis names.
    pub(crate) fn named(&self) -> impl Iterator<Item = &str> {
        self.named.as_deref().unwrap_or_default().split(',').filter(|id| !id.is_empty())
    }
}
