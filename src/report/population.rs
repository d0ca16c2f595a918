//! The report of many logs: a line a log, gyro and axis, then what they have in common.

use super::numbers::{known_digits, probability, significant};
use crate::population::{Parameter, Population, Row, Source, failed};
use serde_json::{Value, json};
use std::fmt::Write;

/// The rows of many logs and their populations.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PopulationReport {
    /// One a log, gyro and axis.
    pub rows: Vec<Row>,
    /// One a gyro and axis.
    pub populations: Vec<Population>,
    /// Rows whose log was read and fitted now.
    pub fitted: usize,
    /// Rows that were taken over from earlier results.
    pub resumed: usize,
}

/// Names longer than this lose their beginning, which logs of a folder share.
pub(super) const NAME: usize = 48;

impl PopulationReport {
    /// Rows without a fit.
    #[must_use]
    pub(crate) fn failed(&self) -> usize {
        failed(&self.rows)
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        let names = Names::new(self.rows.iter().map(|r| &r.source));
        // writing to a String cannot fail
        let _ = writeln!(
            out,
            "{}  {:>12} {:>9}  {:>12} {:>9}  {:>9} {:>8}  verdict",
            names.head(),
            "C1 rad/s",
            "std",
            "C2 rad/s",
            "std",
            "T s",
            "std"
        );
        for row in &self.rows {
            row_text(row, &names, &mut out);
        }
        let taken = taken(self.resumed);
        let _ = writeln!(out, "\n{} read{taken}; {} failed", self.fitted, self.failed());
        if let Some(earth) = self.rows.iter().find_map(|r| r.earth_rate_rad_s) {
            let _ = writeln!(
                out,
                "C2 holds {} rad/s of the Earth's rotation; the gyro's own bias is C2 less that",
                significant(earth, 4)
            );
        }
        // several gyros of one log are no population
        for population in self.populations.iter().filter(|p| p.topic.is_none() || p.logs > 1) {
            self.population_text(population, &mut out);
        }
        out
    }

    fn population_text(&self, p: &Population, out: &mut String) {
        let topic = p.topic.as_ref().map_or(String::new(), |t| format!("topic {t}, "));
        let _ = writeln!(out, "\n{topic}axis {}: {} of {} logs count", p.axis, p.counted.len(), p.logs);
        for l in &p.left_out {
            let _ = writeln!(out, "  left out: {}: {}", self.rows[l.row].source.path, l.why);
        }
        if p.counted.len() < 2 {
            let _ = writeln!(out, "  too few for a population");
            return;
        }
        let _ = writeln!(out, "  from log to log, net of their own errors (95 % intervals in brackets)");
        for (name, unit, what, parameter) in [
            ("C1", "rad/s", "spread", &p.c1),
            ("C2", "rad/s", "turn-on repeatability", &p.c2),
            ("T", "s", "spread", &p.time_constant),
        ] {
            if let Some(parameter) = parameter {
                parameter_text(name, unit, what, parameter, out);
            }
        }
        if let Some(w) = &p.warm_up {
            let _ = writeln!(
                out,
                "  warm-up repeatability, C1 and T together: {} {}; p {} if there were none",
                percent(w.relative_std),
                percents(w.ci95),
                equals(w.p_value)
            );
        }
        if !p.outlying_tested {
            let _ = writeln!(out, "  outlying logs: not looked for, it takes five that are fit for use");
            return;
        }
        let none = if p.outlying.is_empty() { " none" } else { "" };
        let level = significant(p.level, 2);
        let _ =
            writeln!(out, "  outlying logs (an ordinary population has any with probability {level} at most):{none}");
        for o in &p.outlying {
            let counted = p.counted.contains(&o.row);
            let _ = writeln!(
                out,
                "    {}: {} lies {} robust standard deviations from the median (p {}){}",
                self.rows[o.row].source.path,
                symbol(o.parameter),
                significant(o.studentized, 3),
                equals(o.p_value),
                if counted { "" } else { "; left out, --keep-outlying counts it" }
            );
        }
    }

    /// The documented JSON of `gyroid fit` of many logs. What is not known or not bounded is null.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({
            "rows": self.rows,
            "populations": self.populations,
            "fitted": self.fitted,
            "resumed": self.resumed,
            "failed": self.failed(),
            "method": {
                "spread": "random effects: Paule-Mandel estimate, Q-profile interval; Hartung-Knapp interval of the mean",
                "outlying": "largest deviation from the weighted median over the Qn spread, calibrated by simulation",
            },
        })
    }
}

fn row_text(row: &Row, names: &Names, out: &mut String) {
    let name = names.of(&row.source);
    if let Some(error) = &row.source.error {
        let _ = writeln!(out, "{name}  error: {}", on_one_line(error));
        return;
    }
    let cell = |value: Option<f64>, std: Option<f64>| value.map_or("-".into(), |v| known_digits(v, std.unwrap_or(0.0)));
    let std = |std: Option<f64>| std.map_or("-".into(), |s| significant(s, 2));
    let verdict = match (row.warm_up_found, row.identifiable, row.white) {
        (Some(false), ..) => "no warm-up",
        (_, Some(false), _) => "T not identifiable",
        (.., Some(false)) => "not white",
        _ => "fit for use",
    };
    let known = row.identifiable == Some(true);
    let time = |text: String| if known { text } else { "-".into() };
    let _ = writeln!(
        out,
        "{name}  {:>12} {:>9}  {:>12} {:>9}  {:>9} {:>8}  {verdict}",
        cell(row.c1_rad_s, row.c1_std_rad_s),
        std(row.c1_std_rad_s),
        cell(row.c2_rad_s, row.c2_std_rad_s),
        std(row.c2_std_rad_s),
        time(cell(row.time_constant_s, row.time_constant_std_s)),
        time(std(row.time_constant_std_s)),
    );
}

fn parameter_text(name: &str, unit: &str, what: &str, p: &Parameter, out: &mut String) {
    let half = 0.5 * (p.mean_ci95[1] - p.mean_ci95[0]);
    let [low, high] = p.mean_ci95.map(|v| known_digits(v, half));
    let spread = |v: f64| significant(v, 3);
    let _ = writeln!(
        out,
        "  {name:<3} mean {} [{low}, {high}] {unit}; {what} {} [{}, {}] {unit}, {} of the mean",
        known_digits(p.mean, half),
        spread(p.spread),
        spread(p.spread_ci95[0]),
        spread(p.spread_ci95[1]),
        percent(p.relative_spread),
    );
}

fn symbol(parameter: &str) -> &str {
    match parameter {
        "c1" => "C1",
        "c2" => "C2",
        _ => "T",
    }
}

pub(super) fn percent(relative: f64) -> String {
    format!("{} %", significant(100.0 * relative, 2))
}

pub(super) fn percents([low, high]: [f64; 2]) -> String {
    format!("[{}, {}]", percent(low), percent(high))
}

pub(super) fn equals(p: f64) -> String {
    super::numbers::equals(&probability(p))
}

/// How many rows came from earlier results.
pub(super) fn taken(resumed: usize) -> String {
    if resumed > 0 { format!(", {resumed} taken from the results") } else { String::new() }
}

/// Columns that name a row: its log, the topic where a log has several, its axis.
pub(super) struct Names {
    path: usize,
    topic: Option<usize>,
}

impl Names {
    /// As wide as the longest of `rows`.
    pub(super) fn new<'a>(rows: impl Iterator<Item = &'a Source> + Clone) -> Self {
        let path = rows.clone().map(|s| s.path.chars().count()).max().unwrap_or(0).clamp(3, NAME);
        let topic = rows.filter_map(|s| s.topic.as_ref()).map(|t| t.chars().count()).max();
        Self { path, topic: topic.map(|w| w.clamp(5, NAME)) }
    }

    pub(super) fn head(&self) -> String {
        self.line("log", "topic", "axis")
    }

    pub(super) fn of(&self, row: &Source) -> String {
        self.line(&row.path, row.topic.as_deref().unwrap_or("-"), &row.axis)
    }

    fn line(&self, path: &str, topic: &str, axis: &str) -> String {
        let topic = self.topic.map_or(String::new(), |w| format!("{:<w$}  ", ending(topic, w)));
        format!("{:<w$}  {topic}{axis:<4}", ending(path, self.path), w = self.path)
    }
}

/// The last `width` characters of a path.
pub(super) fn ending(path: &str, width: usize) -> String {
    let count = path.chars().count();
    if count <= width {
        return path.to_string();
    }
    format!("…{}", path.chars().skip(count + 1 - width).collect::<String>())
}

pub(super) fn on_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
