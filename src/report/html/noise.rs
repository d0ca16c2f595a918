//! The page of a noise model.

use super::document::{Document, Origin, Table, Tone};
use super::fit::lines;
use crate::error::Result;
use crate::math::NORMAL_975;
use crate::noise::Deviation;
use crate::report::noise::NoiseReport;
use crate::report::numbers::{known_digits, probability, significant};
use crate::report::plot::{Axis, Chart, palette};
use crate::units::{RAD_S_PER_DEG_H, duration_text};

/// The page of `report`.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if no deviation can be shown.
pub(crate) fn noise_page(report: &NoiseReport, origin: &Origin) -> Result<String> {
    let m = &report.model;
    let tone = if report.fits() { Tone::Good } else { Tone::Bad };
    let of = format!(
        "{}, column {}: {} samples at {} Hz, {}",
        report.log.name,
        report.log.column,
        m.samples,
        significant(1.0 / m.step_s, 4),
        duration_text(m.span_s),
    );
    let mut page = Document::new(&format!("Noise of {}", report.log.name), tone, &report.verdict_line(), &of);
    let cards = m.terms.iter().take(6).map(|t| {
        let unit = t.id.datasheet_units()[0];
        let of = |v: f64| v * unit.per_si;
        let value = format!("{} ± {}", known_digits(of(t.estimate), of(t.std)), significant(of(t.std), 2));
        let words = t.id.id().replace('_', " ");
        [format!("{}, {words}", t.id.symbol()), format!("{value} {}", unit.name), String::new()]
    });
    page.numbers(cards);
    for panel in report.picture()?.panels {
        page.figure(
            panel.titled("Allan deviation, and what its terms make of it"),
            "the black line runs through the dots and their band at all averaging times.",
        );
    }

    page.section("What else is there");
    let mut terms = Table::new(["term", "estimate", "std", "95 % interval", "unit", "in datasheets' units"]);
    for t in &m.terms {
        let [low, high] = t.ci95.map(|end| known_digits(end, t.std));
        let unit = t.id.datasheet_units()[0];
        terms.row([
            format!("{}, {}", t.id.symbol(), t.id.id().replace('_', " ")),
            known_digits(t.estimate, t.std),
            significant(t.std, 2),
            format!("{low} to {high}"),
            t.id.unit().to_string(),
            format!("{} {}", known_digits(t.estimate * unit.per_si, t.std * unit.per_si), unit.name),
        ]);
    }
    page.table(&terms);
    page.list(lines(|out| report.warm_up_text(out)));
    page.list(lines(|out| report.datasheet_text(out)));
    page.table(&ledger(report));
    let mut sets = Table::new(["set of terms", "probability", "ln evidence below the best", "BIC above the best"]);
    for set in m.selection.iter().take(8) {
        let names: Vec<_> = set.terms.iter().map(|k| k.symbol()).collect();
        sets.row([
            names.join(" + "),
            probability(set.probability),
            format!("{:.1}", set.ln_evidence_below_best),
            format!("{:.1}", set.bic_above_best),
        ]);
    }
    page.table(&sets);

    page.section("What is left: the goodness of fit");
    if let Some(chart) = bands(report) {
        page.figure(chart, "19 dots of 20 lie inside the grey band about 1: at no frequency is there more or less power than the model's.");
    }
    page.paragraph(&format!(
        "p = {} by {} logs drawn from the model.",
        probability(m.goodness.p_value),
        m.goodness.draws
    ));

    page.section("What cannot be told");
    page.list(lines(|out| report.refusals_text(out)));
    page.list(&report.log.notes);
    let mut deviations = Table::new(["averaged over", "Allan deviation, °/h", "95 % interval", "degrees of freedom"]);
    let allan = m.deviations.iter().find(|f| f.0 == Deviation::Overlapping).map_or(&[][..], |f| f.1.as_slice());
    let deg_h = |v: f64| significant(v / RAD_S_PER_DEG_H, 4);
    for p in allan {
        let [low, high] = p.ci95.map(deg_h);
        let freedom = significant(p.degrees_of_freedom, 3);
        deviations.row([duration_text(p.tau_s), deg_h(p.deviation_rad_s), format!("{low} to {high}"), freedom]);
    }
    page.folded_table("Table of the Allan deviation", &deviations);
    page.folded("The same as text", &report.text());
    page.finish(origin)
}

/// Heading error without correction, by cause.
fn ledger(report: &NoiseReport) -> Table {
    let l = &report.model.ledger;
    let after = format!("heading error after {}, °", duration_text(l.horizon_s));
    let mut table = Table::new(["cause", after.as_str(), "share"]);
    for e in &l.entries {
        let size = e.heading_std_rad.map_or_else(|| "not known".into(), |v| significant(v.to_degrees(), 3));
        let share = if e.counted { format!("{:.1} %", 100.0 * e.share) } else { "beside".into() };
        table.row([e.cause.to_string(), size, share]);
    }
    table.row(["all that count".into(), significant(l.heading_std_rad.to_degrees(), 3), String::new()]);
    table
}

/// Power over the model's in bands of frequency.
fn bands(report: &NoiseReport) -> Option<crate::report::plot::Panel> {
    let all = &report.model.goodness.bands;
    let middle = |from: f64, to: f64| (from.max(1e-12) * to.max(1e-12)).sqrt();
    let there = || all.iter().filter(|b| b.ratio > 0.0 && b.to_hz > 0.0);
    let dots: Vec<[f64; 2]> = there().map(|b| [middle(b.from_hz, b.to_hz), b.ratio]).collect();
    // the logarithm of the ratio has about this standard deviation
    let chance = there().map(|b| {
        let factor = (NORMAL_975 * (2.0 / b.coefficients).sqrt()).exp();
        [middle(b.from_hz, b.to_hz), 1.0 / factor, factor]
    });
    let chance: Vec<[f64; 3]> = chance.collect();
    (!dots.is_empty()).then(|| {
        Chart::new(Axis::log("Frequency", "Hz"), Axis::log("Power over the model's", "").include(0.5).include(2.0))
            .title("Power of the log over that of the model, by frequency")
            .band("95 % by chance", chance, palette::GREY, 0.2)
            .at_y("as much as the model makes", 1.0, palette::GREY.stroke(1.5))
            .line("", dots.clone(), palette::BLUE.stroke(1.5))
            .dots("recorded over modelled", dots, palette::BLUE, 3.0)
            .into()
    })
}
