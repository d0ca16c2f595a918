//! The page of a twin: its parameters, how well it predicts the simulator's log, and what the simulator has beside it.

use super::gap::words::{name_and_unit_of, title};
use super::numbers::{known_digits, significant};
use crate::gap::answer::Verdict;
use crate::gap::twin::{Parameter, Provenance, Twin, TwinEffect};
use std::fmt::Write;

/// A twin for people.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwinReport<'a> {
    /// Name of the simulator's log.
    pub log: &'a str,
    /// The twin.
    pub twin: &'a Twin,
}

impl TwinReport<'_> {
    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let twin = self.twin;
        let runs = if twin.runs == 1 { "one run".to_string() } else { format!("{} runs", twin.runs) };
        let mut out = format!("TWIN of the simulator of {} ({runs})\n", self.log);
        for (name, parameter) in &twin.parameters {
            let _ = write!(out, "\n  {}", row(name, parameter));
        }
        if !twin.channels.is_empty() {
            let _ = write!(
                out,
                "\n\n  {:<20}{:>20}{:>26}{:>12}",
                "channel", "explained one step", "innovations squared", "lag one"
            );
            for c in &twin.channels {
                let [low, high] = c.nis_mean_bounds95;
                let nis = format!("{:.3} ({low:.3} to {high:.3})", c.nis_mean);
                let explained = format!("{:.4} %", 100.0 * c.explained_one_step);
                let _ = write!(out, "\n  {:<20}{explained:>20}{nis:>26}{:>12.3}", c.channel, c.lag_one);
            }
            out.push_str(
                "\n  A twin that holds has innovations squared inside its bounds and a lag one near zero; more: it is too sure of itself.",
            );
        }
        for (i, m) in twin.horizons.iter().enumerate() {
            let _ = write!(
                out,
                "{}\n  {:<32}{:>12}   on its own logs {}",
                if i == 0 { "\n" } else { "" },
                m.metric,
                significant(m.before, 3),
                significant(m.floor, 3)
            );
        }
        out.push_str("\n\nWhat the simulator has and the nominal model has not\n");
        if twin.effects.is_empty() {
            out.push_str("\n  nothing that has a name");
        }
        for effect in &twin.effects {
            let _ = write!(out, "\n  {}", effect_line(effect));
        }
        out.push_str(match twin.left {
            Some(Verdict::None) => "\n  Diagnosed against this twin, the simulator's log has no gap.",
            Some(Verdict::Identified) => {
                "\n  Diagnosed against this twin, the simulator's log still shows an effect that no twin can hold."
            }
            Some(Verdict::Unknown) => "\n  Diagnosed against this twin, the simulator's log has a gap without a name.",
            Some(Verdict::CannotTell) | None => "",
        });
        if !twin.free_forms.is_empty() {
            let _ = write!(out, " It follows {}.", twin.free_forms.join(", "));
        }
        for (i, note) in twin.notes.iter().enumerate() {
            let _ = write!(out, "{}\n  note: {note}", if i == 0 { "\n" } else { "" });
        }
        out
    }
}

fn row(name: &str, p: &Parameter) -> String {
    let source = match p.source {
        Provenance::Log => "",
        Provenance::Given => "given, not told by the log",
        Provenance::Convention => "by convention, not told by the log",
    };
    let text = match (p.std, p.ci95) {
        (Some(std), Some([low, high])) if std > 0.0 => {
            let [low, high] = [low, high].map(|end| known_digits(end, std));
            format!("{name:<34}{:>14} {:<12} 95 %: {low} to {high}", known_digits(p.value, std), p.unit)
        }
        _ => format!("{name:<34}{:>14} {:<12} {source}", significant(p.value, 4), p.unit),
    };
    text.trim_end().to_string()
}

fn effect_line(effect: &TwinEffect) -> String {
    let parameters = effect.parameters.iter().map(|(name, value)| {
        let (short, unit) = name_and_unit_of(&effect.id, name);
        let text = match effect.std.get(name).filter(|s| **s > 0.0) {
            Some(std) => format!("{} ± {} {unit}", known_digits(*value, *std), significant(*std, 2)),
            None => format!("{} {unit}", significant(*value, 3)),
        };
        format!("{short} {}", text.trim_end())
    });
    let held = if effect.in_twin { "" } else { " (another in each run: not in the twin)" };
    format!("{} ({}): {}{held}", title(&effect.id), effect.id, parameters.collect::<Vec<_>>().join(", "))
}
