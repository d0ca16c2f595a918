//! A panel of a picture as part of a page: charts, stacks of them, heat maps, bars, words.

use super::chart::{self, Shown};
use super::ink;
use super::text::escape;
use crate::error::Result;
use crate::report::plot::axis::number;
use crate::report::plot::palette::{BLACK, BLUE, VERMILION, WHITE};
use crate::report::plot::{BarChart, HeatMap, Panel};
use std::fmt::Write;

/// Heights of pictures.
const CHART: f64 = 330.0;
const MAP: f64 = 560.0;
const STRIP: f64 = 190.0;

/// Title of the panel; empty where it has none.
pub(super) fn title(panel: &Panel) -> &str {
    match panel {
        Panel::Chart(chart) => &chart.title,
        Panel::Stack { title, .. } | Panel::Notice { title, .. } => title,
        Panel::HeatMap(map) => &map.title,
        Panel::Bars(bars) => &bars.title,
    }
}

/// The panel without its title; `points`: points of a series that the script gets.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if a value cannot be shown.
pub(super) fn html(panel: &Panel, points: usize, id: &str) -> Result<String> {
    match panel {
        Panel::Chart(one) => {
            let height = if one.equal { MAP } else { CHART };
            chart::html(one, Shown { height, points, as_above: false }, id)
        }
        Panel::Stack { charts, label, .. } => {
            let mut out = String::from("<div class=\"stack\">");
            for (i, one) in charts.iter().enumerate() {
                let mut one = one.clone();
                if one.y.label.is_empty() {
                    one.y.label.clone_from(label);
                }
                if !one.title.is_empty() {
                    let _ = write!(out, "<p class=\"strip\">{}</p>", escape(&one.title));
                }
                let as_above = i > 0 && chart::names(&one).eq(chart::names(&charts[i - 1]));
                let height = if charts.len() == 1 { CHART } else { STRIP };
                out += &chart::html(&one, Shown { height, points, as_above }, &format!("{id}-{i}"))?;
            }
            Ok(out + "</div>")
        }
        Panel::HeatMap(map) => Ok(heat(map, id)),
        Panel::Bars(chart) => Ok(bars(chart)),
        Panel::Notice { text, .. } => Ok(format!("<p class=\"notice\">{}</p>", escape(text))),
    }
}

/// Cells as SVG; each says its row, column and value.
fn heat(map: &HeatMap, id: &str) -> String {
    const CELL: [f64; 2] = [74.0, 30.0];
    const DIGIT: f64 = 7.4;
    let most = |all: &[String]| all.iter().map(|n| n.chars().count()).max().unwrap_or(0) as f64;
    let left = 30.0 + DIGIT * most(&map.rows);
    let wide = CELL[0].max(DIGIT * most(&map.columns) + 10.0);
    let width = left + wide * map.columns.len() as f64 + 4.0;
    let height = CELL[1] * map.rows.len() as f64 + 50.0;
    let mut out = String::new();
    let [rows, columns] = &map.labels;
    let _ = write!(
        out,
        "<div class=\"heat\"><svg viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" role=\"img\" \
         aria-labelledby=\"{id}-t {id}-d\"><title id=\"{id}-t\">{}</title><desc id=\"{id}-d\">{} by {}</desc>",
        escape(&map.title),
        escape(rows),
        escape(columns)
    );
    // symmetric about zero, so that the colour shows the sign
    let largest = map.values.iter().filter(|v| !v.is_nan()).fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, value) in map.values.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
        let (row, column) = (i / map.columns.len(), i % map.columns.len());
        let share = if largest > 0.0 { value.abs() / largest } else { 0.0 };
        let color = if *value < 0.0 { VERMILION } else { BLUE }.tint(share);
        let ink = if color.lightness() > 0.55 { BLACK } else { WHITE };
        let (x, y) = (left + wide * column as f64, 4.0 + CELL[1] * row as f64);
        let text = number(*value, map.places);
        let _ = write!(
            out,
            "<g><title>{}, {}: {text}</title><rect class=\"mark area\" style=\"{}\" x=\"{x:.0}\" y=\"{y:.0}\" \
             width=\"{:.0}\" height=\"{:.0}\"/><text class=\"mark area\" style=\"{}\" x=\"{:.0}\" y=\"{:.0}\" \
             text-anchor=\"middle\">{text}</text></g>",
            escape(&map.rows[row]),
            escape(&map.columns[column]),
            ink::style(color),
            wide - 2.0,
            CELL[1] - 2.0,
            ink::style(ink),
            x + 0.5 * wide,
            y + 19.0
        );
    }
    let bottom = 4.0 + CELL[1] * map.rows.len() as f64;
    for (i, name) in map.rows.iter().enumerate() {
        let y = 4.0 + CELL[1] * (i as f64 + 0.5) + 4.0;
        let _ = write!(out, "<text x=\"{:.0}\" y=\"{y:.0}\" text-anchor=\"end\">{}</text>", left - 8.0, escape(name));
    }
    for (i, name) in map.columns.iter().enumerate() {
        let x = left + wide * (i as f64 + 0.5);
        let _ =
            write!(out, "<text x=\"{x:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>", bottom + 16.0, escape(name));
    }
    let (middle, foot) = (left + 0.5 * wide * map.columns.len() as f64, bottom + 38.0);
    let _ = write!(
        out,
        "<text class=\"axis\" x=\"{middle:.0}\" y=\"{foot:.0}\" text-anchor=\"middle\">{}</text><text class=\"axis\" \
         transform=\"translate(14 {:.0}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg></div>",
        escape(columns),
        0.5 * bottom,
        escape(rows)
    );
    out
}

/// Bars as a table, which can be copied and read aloud.
fn bars(chart: &BarChart) -> String {
    let mut out = String::new();
    if !chart.legend.is_empty() {
        out.push_str("<ul class=\"legend\">");
        for (name, color) in &chart.legend {
            let (style, name) = (ink::style(*color), escape(name));
            let _ = write!(
                out,
                "<li><svg width=\"14\" height=\"12\" aria-hidden=\"true\"><rect class=\"mark area\" style=\"{style}\" \
                 width=\"12\" height=\"12\"/></svg> {name}</li>"
            );
        }
        out.push_str("</ul>");
    }
    out.push_str("<table class=\"bars\">");
    for (name, bars) in &chart.rows {
        let _ = write!(out, "<tr><th scope=\"row\">{}</th><td>", escape(name));
        for bar in bars {
            let _ = write!(
                out,
                "<div><i class=\"mark bar\" style=\"{};--w:{:.3}\"></i><span>{}</span></div>",
                ink::style(bar.color),
                bar.length,
                escape(&bar.text)
            );
        }
        out.push_str("</td></tr>");
    }
    out + "</table>"
}
