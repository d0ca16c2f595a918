//! The page of units over their power-ons.

use super::document::{Document, Origin, Table, Tone};
use crate::error::Result;
use crate::population::{Tracked, TrackedParameter};
use crate::report::TrackReport;
use crate::report::levels::{self, words};
use crate::report::plot::{Axis, Chart, palette};
use crate::report::track::{finding, standing};

/// Most figures of a page.
const FIGURES: usize = 12;

/// The page of `report`: the figures are of the parameters that changed; where none did, of the first gyro.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if the page is too large.
pub(crate) fn track_page(report: &TrackReport, origin: &Origin) -> Result<String> {
    let changed = report.changed().count();
    let tone = if changed == 0 { Tone::Good } else { Tone::Bad };
    let mut page = Document::new("Gyros over their power-ons", tone, &report.verdict_line(), &report.promise());
    let all = || report.gyros.iter().flat_map(|g| g.parameters.iter().map(move |p| (g, p)));
    let mut shown: Vec<(&Tracked, &TrackedParameter)> = all().filter(|(_, p)| p.outside || p.drifting).collect();
    if shown.is_empty() {
        shown = all().take(4).collect();
    }
    if shown.len() > FIGURES {
        page.paragraph(&format!("The first {FIGURES} of {} changes are drawn; the table has all.", shown.len()));
    }
    for (gyro, p) in shown.into_iter().take(FIGURES) {
        page.figure(chart(gyro, p).into(), "the last dot lies inside the band, and the dots on no slope.");
    }
    page.section("All gyros");
    let mut table = Table::new(["unit", "topic", "axis", "power-ons", "set aside", "last", "verdict", "why"]);
    for g in &report.gyros {
        let why: Vec<String> = g.parameters.iter().filter_map(|p| finding(g, p)).chain(g.why.clone()).collect();
        table.row([
            g.unit.clone(),
            g.topic.clone().unwrap_or_default(),
            g.axis.clone(),
            g.power_ons.to_string(),
            g.set_aside.to_string(),
            g.last_started.clone().unwrap_or_else(|| g.last.clone()),
            standing(g).to_string(),
            why.join("; "),
        ]);
    }
    page.table(&table);
    for l in report.fleet.iter().filter(|l| !l.parameters.is_empty()) {
        page.section(&levels::heading(l));
        page.paragraph("How they differ, net of the logs' own errors, with 95 % intervals.");
        let mut table = Table::new(["parameter", "", "size", "p if there were none"]);
        levels::lines(l).into_iter().for_each(|line| table.row(line));
        page.table(&table);
        page.paragraph(&levels::belonging(l));
        page.list(levels::apart(l));
    }
    page.folded("The same as text", &report.text());
    page.finish(origin)
}

fn chart(gyro: &Tracked, p: &TrackedParameter) -> Chart {
    let (symbol, unit, _) = words(p.name);
    let x =
        if gyro.in_days { Axis::linear("Time since the first power-on", "d") } else { Axis::linear("Power-on", "") };
    let dots: Vec<[f64; 2]> = gyro.at.iter().zip(&p.history).filter_map(|(x, y)| Some([*x, (*y)?])).collect();
    let ends = [gyro.at.first(), gyro.at.last()].map(|x| x.copied().unwrap_or_default());
    let last = dots.last().copied();
    Chart::new(x, Axis::linear(symbol, unit))
        .title(format!("{symbol} of {}, axis {}: {}", gyro.unit, gyro.axis, standing(gyro)))
        .band("interval for the last one", ends.map(|x| [x, p.interval[0], p.interval[1]]), palette::GREY, 0.2)
        .at_y("predicted by the earlier ones", p.expected, palette::GREY.stroke(1.5))
        .dots("power-ons", dots, palette::BLUE, 3.0)
        .dots("the last one", last, palette::VERMILION, 5.0)
}
