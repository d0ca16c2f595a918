//! The report of the drives of many robots: a line a drive, then each effect over the robots.

use super::numbers::{known_digits, significant};
use super::population::{NAME, ending, on_one_line, taken};
use crate::fleet::{DriveRow, FleetEffect, HAS, Reach};
use crate::population::failed;
use serde_json::{Value, json};
use std::fmt::Write;

/// The rows of many drives, and the effects over the robots.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FleetReport {
    /// One a recording.
    pub rows: Vec<DriveRow>,
    pub effects: Vec<FleetEffect>,
    /// Rows whose recording was read now.
    pub fitted: usize,
    /// Rows that were taken over from earlier results.
    pub resumed: usize,
}

/// Robots that are named in a line.
const NAMED: usize = 8;

impl FleetReport {
    /// Rows without a diagnosis.
    #[must_use]
    pub(crate) fn failed(&self) -> usize {
        failed(&self.rows)
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        let width = self.rows.iter().map(|r| r.source.path.chars().count()).max().unwrap_or(0).clamp(9, NAME);
        // writing to a String cannot fail
        let _ = writeln!(out, "{:<width$}  verdict      named", "recording");
        for row in &self.rows {
            let name = ending(&row.source.path, width);
            if let Some(error) = &row.source.error {
                let _ = writeln!(out, "{name:<width$}  error: {}", on_one_line(error));
                continue;
            }
            let verdict = row.verdict.map_or(String::new(), |v| v.to_string());
            let main = row.main.as_deref().zip(row.main_probability);
            let main = main.map_or(String::new(), |(id, p)| format!("{id} {p:.2}"));
            let others: Vec<&str> = row.named().filter(|id| Some(*id) != row.main.as_deref()).collect();
            let all: Vec<&str> = [main.as_str()].into_iter().filter(|m| !m.is_empty()).chain(others).collect();
            let _ = writeln!(out, "{name:<width$}  {:<11}  {}", verdict, all.join(", "));
        }
        let taken = taken(self.resumed);
        let _ = writeln!(out, "\n{} diagnosed{taken}; {} failed", self.fitted, self.failed());
        for effect in &self.effects {
            effect_text(effect, self.rows.len(), &mut out);
        }
        out
    }

    /// The documented JSON of `gyroid gap fleet`. What is not known is null.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({
            "rows": self.rows,
            "effects": self.effects,
            "fitted": self.fitted,
            "resumed": self.resumed,
            "failed": self.failed(),
        })
    }
}

fn effect_text(e: &FleetEffect, recordings: usize, out: &mut String) {
    let have: Vec<&str> = e
        .units
        .iter()
        .zip(&e.shared.units)
        .filter(|(_, u)| u.probability >= HAS)
        .map(|(name, _)| name.as_str())
        .collect();
    let robots = e.units.len() + e.untold.len();
    let said = match e.reach {
        Reach::Common => format!("common to all {robots} robots (probability {:.2})", e.shared.all),
        Reach::Some => format!("in {} of {robots} robots: {}", have.len(), listed(&have)),
        Reach::CannotTell => format!("in none of {robots} robots beyond doubt"),
    };
    let _ = writeln!(out, "\n{} ({}), named in {} of {recordings} recordings: {said}", e.title, e.id, e.named);
    if let (Some(mean), Some(std)) = (e.shared.mean, e.shared.mean_std) {
        let spread = e.shared.spread.zip(e.shared.spread_ci95).map_or(String::new(), |(spread, [low, high])| {
            let [spread, low, high] = [spread, low, high].map(|v| significant(v, 2));
            format!("; from robot to robot {spread} [{low}, {high}]")
        });
        let _ = writeln!(out, "  {} {} ± {}{spread}", e.parameter, known_digits(mean, std), significant(std, 2));
    }
    let _ = writeln!(out, "    probability  size, robot by robot");
    for (name, unit) in e.units.iter().zip(&e.shared.units) {
        let size = format!("{} ± {}", known_digits(unit.size, unit.std), significant(unit.std, 2));
        let _ = writeln!(out, "           {:.2}  {size:<22}  {}", unit.probability, ending(name, NAME));
    }
    if !e.untold.is_empty() {
        let untold: Vec<&str> = e.untold.iter().map(String::as_str).collect();
        let _ = writeln!(out, "  no recording tells it of {}", listed(&untold));
    }
}

/// The first names, and how many more there are.
fn listed(names: &[&str]) -> String {
    let more = names.len().saturating_sub(NAMED);
    let first = names[..names.len() - more].join(", ");
    if more > 0 { format!("{first} and {more} more") } else { first }
}
