//! The report of units over their power-ons: a line a gyro, and of each that changed the parameters that did.

use super::levels::{self, words};
use super::numbers::{equals, known_digits, probability, significant};
use crate::population::{FleetLevels, Standing, Tracked, TrackedParameter};
use serde_json::{Value, json};
use std::fmt::Write;

/// The gyros of a fleet, each with its last power-on against the earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackReport {
    /// One a unit, topic and axis.
    pub gyros: Vec<Tracked>,
    /// By what the power-ons of all differ, one a topic and axis.
    pub fleet: Vec<FleetLevels>,
    /// Power-ons in which a unit that is as ever raises at most one false alarm.
    pub per_year: f64,
    /// Rows whose path names no unit.
    pub without_unit: usize,
}

/// The verdict in words.
pub(super) fn standing(gyro: &Tracked) -> &'static str {
    match gyro.standing {
        Standing::Inside => "as ever",
        Standing::Outside => "OUTSIDE",
        Standing::Drifting => "DRIFTING",
        Standing::NotJudged => "not judged",
        Standing::TooFew => "too few power-ons",
    }
}

/// Change of one parameter, in a sentence; none where it is as ever.
pub(super) fn finding(gyro: &Tracked, p: &TrackedParameter) -> Option<String> {
    let (symbol, unit, relative) = words(p.name);
    let half = 0.5 * (p.interval[1] - p.interval[0]);
    let [value, low, high] = [p.value, p.interval[0], p.interval[1]].map(|v| known_digits(v, half));
    if p.outside {
        return Some(format!(
            "{symbol} is {value} {unit}; the earlier power-ons predict {low} to {high} (t = {}, p {})",
            significant(p.t, 3),
            equals(&probability(p.p_value))
        ));
    }
    let per = if gyro.in_days { "a day" } else { "a power-on" };
    let (times, unit) = if relative { (100.0, "%") } else { (1.0, unit) };
    p.drifting.then(|| {
        let [slope, std] = [p.slope, p.slope_std].map(|v| times * v);
        format!(
            "{symbol} drifts by {} ± {} {unit} {per} (p {})",
            known_digits(slope, std),
            significant(std, 2),
            equals(&probability(p.slope_p_value))
        )
    })
}

impl TrackReport {
    /// Gyros that are outside, or drift.
    pub(crate) fn changed(&self) -> impl Iterator<Item = &Tracked> {
        self.gyros.iter().filter(|g| matches!(g.standing, Standing::Outside | Standing::Drifting))
    }

    /// The verdict in one line.
    pub(super) fn verdict_line(&self) -> String {
        let judged =
            self.gyros.iter().filter(|g| !matches!(g.standing, Standing::NotJudged | Standing::TooFew)).count();
        format!(
            "{} of {judged} gyros changed; {} could not be judged",
            self.changed().count(),
            self.gyros.len() - judged
        )
    }

    /// The agreed number of false alarms, in a sentence.
    pub(super) fn promise(&self) -> String {
        format!("A unit that is as ever is told to have changed at most once in {} power-ons.", self.per_year)
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let width = self.gyros.iter().map(|g| g.unit.chars().count()).max().unwrap_or(0).max(4);
        // writing to a String cannot fail
        let mut out = String::new();
        let _ = writeln!(out, "{:<width$}  axis  power-ons  {:<20}  verdict", "unit", "last");
        for gyro in &self.gyros {
            let last = gyro.last_started.as_deref().map_or("-", |t| t.get(..19).unwrap_or(t));
            let topic = gyro.topic.as_ref().map_or(String::new(), |t| format!("  {t}"));
            let _ = writeln!(
                out,
                "{:<width$}  {:<4}  {:>9}  {last:<20}  {}{topic}",
                gyro.unit,
                gyro.axis,
                gyro.power_ons,
                standing(gyro)
            );
            for said in gyro.parameters.iter().filter_map(|p| finding(gyro, p)).chain(gyro.why.clone()) {
                let _ = writeln!(out, "{:width$}  {said}", "");
            }
            if gyro.set_aside > 0 {
                let were = if gyro.set_aside == 1 { "power-on was" } else { "power-ons were" };
                let _ = writeln!(out, "{:width$}  {} earlier {were} outside and count no more", "", gyro.set_aside);
            }
        }
        let _ = writeln!(out, "\n{}\n{}", self.verdict_line(), self.promise());
        if self.without_unit > 0 {
            let _ = writeln!(out, "{} rows are left out: --unit finds no unit in their paths", self.without_unit);
        }
        levels::text(&self.fleet, &mut out);
        out
    }

    /// The documented JSON of `gyroid track`.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({
            "gyros": self.gyros,
            "fleet": self.fleet,
            "changed": self.changed().count(),
            "per_year": self.per_year,
            "rows_without_unit": self.without_unit,
            "method": "last power-on against the earlier ones of its unit: moderated t (Smyth 2004), Bonferroni over gyros, parameters and tests; \
                fleet: nested random effects, Paule-Mandel estimates, generalised confidence intervals",
        })
    }
}
