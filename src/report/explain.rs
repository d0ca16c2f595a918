//! The page of effects that were fitted together: each parameter by its name, with its unit, interval and meaning.

use super::gap::words::{about_of, name_and_unit_of, title};
use super::numbers::{known_digits, significant};
use crate::gap::Explanations;
use std::fmt::Write;

/// Effects that were fitted to a recording, for people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExplainReport<'a> {
    /// Name of the recording.
    pub recording: &'a str,
    /// Effects that were fitted, with their parameters.
    pub found: &'a Explanations,
    /// Decisions of the reader of the recording, a sentence each.
    pub notes: &'a [String],
}

impl ExplainReport<'_> {
    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let titles: Vec<&str> = self.found.effects.iter().map(|e| title(&e.id)).collect();
        let mut out = format!(
            "{}: {}{}",
            self.recording,
            titles.join(" + "),
            if titles.len() > 1 { ", fitted together" } else { "" }
        );
        for effect in &self.found.effects {
            let about = about_of(&effect.id);
            let _ = write!(out, "\n\n{} ({}), gains {:.1} nats", title(&effect.id), effect.id, effect.gain_nats);
            if let Some(about) = about {
                let _ = write!(out, "\n  {}", about.equation);
            }
            for (parameter, e) in &effect.parameters {
                let (name, unit) = name_and_unit_of(&effect.id, parameter);
                let meaning =
                    about.and_then(|a| a.parameters.iter().find(|p| p.name == parameter)).map_or("", |p| p.meaning);
                let estimate = format!("{} ± {} {unit}", known_digits(e.estimate, e.std), significant(e.std, 2));
                let [low, high] = e.ci95.map(|end| known_digits(end, e.std));
                let _ = write!(out, "\n  {name:<22} {estimate:<36} 95 %: {:<24} {meaning}", format!("{low} to {high}"));
                out.truncate(out.trim_end().len());
            }
            if let Some([from, to]) = effect.time_s {
                let _ = write!(out, "\n  from {from:.1} to {to:.1} s");
            }
        }
        let notes: Vec<&String> = self.found.notes.iter().chain(self.notes).collect();
        for (i, note) in notes.iter().enumerate() {
            let _ = write!(out, "\n{}note: {note}", if i == 0 { "\n" } else { "" });
        }
        out
    }
}
