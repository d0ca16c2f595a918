//! The page of effects that were fitted without asking whether they are at work.

use super::document::{Document, Origin, Table, Tone};
use crate::error::Result;
use crate::gap::rest::explain::Explanations;
use crate::report::gap::words::{about_of, name_and_unit_of, title};
use crate::report::numbers::{known_digits, significant};
use crate::report::plot::{Axis, Chart, palette};

/// The page of `found`, the effects fitted to the recording called `recording`.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if a number cannot be shown.
pub(crate) fn explain_page(recording: &str, found: &Explanations, notes: &[String], origin: &Origin) -> Result<String> {
    let names: Vec<&str> = found.effects.iter().map(|e| title(&e.id)).collect();
    let verdict = match names.is_empty() {
        true => "NOTHING FITTED: the recording shows none of these effects".into(),
        false => format!("FITTED TOGETHER: {}", names.join(", ")),
    };
    let tone = if names.is_empty() { Tone::Bad } else { Tone::Open };
    let of = format!("Recording: {recording}. Whether these effects are at work was not asked.");
    let mut page = Document::new(&format!("Effects fitted to {recording}"), tone, &verdict, &of);
    let cards = found.effects.iter().map(|e| {
        let beside = e.time_s.map(|[from, to]| format!("from {from:.1} to {to:.1} s")).unwrap_or_default();
        [title(&e.id).to_string(), format!("{} nats", significant(e.gain_nats, 3)), beside]
    });
    page.numbers(cards);
    for effect in &found.effects {
        page.section(title(&effect.id));
        if let Some(about) = about_of(&effect.id) {
            page.paragraph(about.equation);
        }
        let mut table = Table::new(["parameter", "estimate", "std", "95 % interval", "unit"]);
        for (parameter, e) in &effect.parameters {
            let (name, unit) = name_and_unit_of(&effect.id, parameter);
            let [low, high] = e.ci95.map(|end| known_digits(end, e.std));
            let estimate = known_digits(e.estimate, e.std);
            table.row([name, estimate, significant(e.std, 2), format!("{low} to {high}"), unit.to_string()]);
        }
        page.table(&table);
        if let Some(about) = about_of(&effect.id) {
            page.paragraph(&format!("What to do: {}", about.remedy));
        }
    }
    if let Some(chart) = intervals(found) {
        page.figure(
            chart.into(),
            "intervals that are short beside their distance from zero: the recording knows these parameters.",
        );
    }
    page.section("What cannot be told");
    page.list(found.notes.iter().chain(notes));
    page.finish(origin)
}

/// Each parameter over its standard deviation, with its interval.
fn intervals(found: &Explanations) -> Option<Chart> {
    let all: Vec<(&String, _)> = found.effects.iter().flat_map(|e| &e.parameters).filter(|p| p.1.std > 0.0).collect();
    let over = |v: f64, std: f64| (v / std).clamp(-1e6, 1e6);
    let row = |i: usize| 1.0 + i as f64;
    let bars = all.iter().enumerate().map(|(i, (_, e))| [row(i), over(e.ci95[0], e.std), over(e.ci95[1], e.std)]);
    let bars: Vec<[f64; 3]> = bars.collect();
    let dots = all.iter().enumerate().map(|(i, (_, e))| [row(i), over(e.estimate, e.std)]);
    let x = Axis::linear("Parameter, in the order of the tables", "").limits(0.5, all.len() as f64 + 0.5);
    (!all.is_empty()).then(|| {
        Chart::new(x, Axis::linear("Estimate over its standard deviation", ""))
            .title("How well each parameter is known")
            .at_y("zero", 0.0, palette::GREY.stroke(1.5))
            .bars("95 % interval", bars, palette::SKY.stroke(5.0))
            .dots("estimate", dots, palette::BLUE, 4.0)
    })
}
