//! The report of the noise of many logs: a line a log, gyro and axis, then what they have in common.

use super::numbers::{known_digits, significant};
use super::population::{Names, equals, on_one_line, percent, percents, taken};
use crate::noise::TermKind;
use crate::population::{NoisePopulation, NoiseRow, failed, noise_populations};
use serde_json::{Value, json};
use std::fmt::Write;

/// The rows of many logs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseTableReport {
    /// One a log, gyro and axis.
    pub rows: Vec<NoiseRow>,
    /// Rows whose log was read now.
    pub fitted: usize,
    /// Rows that were taken over from earlier results.
    pub resumed: usize,
}

/// Terms with a column of their own.
const SHOWN: [TermKind; 4] =
    [TermKind::Quantization, TermKind::AngleRandomWalk, TermKind::BiasInstability, TermKind::RateRandomWalk];

impl NoiseTableReport {
    /// Rows without a result.
    #[must_use]
    pub(crate) fn failed(&self) -> usize {
        failed(&self.rows)
    }

    /// The page for a terminal.
    #[must_use]
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        let names = Names::new(self.rows.iter().map(|r| &r.source));
        let heads: Vec<String> =
            SHOWN.iter().map(|k| format!("{:>12}", format!("{} {}", k.symbol(), short(*k)))).collect();
        // writing to a String cannot fail
        let _ = writeln!(out, "{}  {}  terms    verdict", names.head(), heads.join("  "));
        for row in &self.rows {
            row_text(row, &names, &mut out);
        }
        let taken = taken(self.resumed);
        let _ = writeln!(out, "\n{} read{taken}; {} failed", self.fitted, self.failed());
        for population in noise_populations(&self.rows).iter().filter(|p| p.logs > 1) {
            population_text(population, &mut out);
        }
        out
    }

    /// The documented JSON of `gyroid noise` of many logs. What is not known is null.
    #[must_use]
    pub(crate) fn json(&self) -> Value {
        json!({
            "rows": self.rows,
            "populations": noise_populations(&self.rows),
            "fitted": self.fitted,
            "resumed": self.resumed,
            "failed": self.failed(),
        })
    }
}

/// The unit, short enough for the head of a column.
fn short(kind: TermKind) -> &'static str {
    match kind {
        TermKind::Quantization => "rad",
        TermKind::AngleRandomWalk => "rad/√s",
        TermKind::RateRandomWalk => "rad/s/√s",
        TermKind::RateRamp => "rad/s²",
        TermKind::Bandwidth => "Hz",
        TermKind::BiasInstability | TermKind::GaussMarkov | TermKind::NarrowBandNoise => "rad/s",
    }
}

fn row_text(row: &NoiseRow, names: &Names, out: &mut String) {
    let name = names.of(&row.source);
    if let Some(error) = &row.source.error {
        let _ = writeln!(out, "{name}  error: {}", on_one_line(error));
        return;
    }
    let cell = |kind: &TermKind| -> String {
        let [size, std, upper] = row.term(*kind);
        let text = match (size, std, upper) {
            (Some(size), std, _) => known_digits(size, std.unwrap_or(0.0)),
            (None, _, Some(upper)) => format!("< {}", significant(upper, 2)),
            _ => "-".into(),
        };
        format!("{text:>12}")
    };
    let cells: Vec<String> = SHOWN.iter().map(cell).collect();
    let verdict = if row.fits == Some(true) { "fits" } else { "terms do not explain it" };
    let _ = writeln!(out, "{name}  {}  {:<7}  {verdict}", cells.join("  "), row.terms.as_deref().unwrap_or_default());
}

fn population_text(p: &NoisePopulation, out: &mut String) {
    let topic = p.topic.as_ref().map_or(String::new(), |t| format!("topic {t}, "));
    let _ = writeln!(out, "\n{topic}axis {}: {} logs, {} of them explained by their terms", p.axis, p.logs, p.fitting);
    let _ = writeln!(out, "  from log to log, net of their own errors (95 % intervals in brackets)");
    for term in &p.terms {
        let found = format!("  {:<3} in {} of {}", term.id.symbol(), term.found, p.logs);
        let (Some(mean), Some(ends), Some(spread), Some(ci95), Some(p_value)) =
            (term.mean, term.mean_ci95, term.relative_spread, term.relative_spread_ci95, term.p_value)
        else {
            let _ = writeln!(out, "{found}");
            continue;
        };
        let half = 0.5 * (ends[1] - ends[0]);
        let [low, high] = ends.map(|v| known_digits(v, half));
        let _ = writeln!(
            out,
            "{found}: mean {} [{low}, {high}] {}; spread {} {}; p {} if there were none",
            known_digits(mean, half),
            short(term.id),
            percent(spread),
            percents(ci95),
            equals(p_value)
        );
    }
}
