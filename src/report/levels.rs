//! The report of what the power-ons of a fleet differ by: between power-ons, months, units and types, and with temperature.

use super::numbers::{equals, known_digits, probability, significant};
use super::population::{percent, percents};
use crate::population::{Between, FLEET_LEVEL, FleetLevels, FleetParameter};
use std::fmt::Write;

/// Symbol and unit of a tracked parameter, and whether its slope and spread are relative.
pub(super) fn words(name: &str) -> (&'static str, &'static str, bool) {
    match name {
        "c1_rad_s" => ("C1", "rad/s", false),
        "c2_rad_s" => ("C2", "rad/s", false),
        "time_constant_s" => ("T", "s", true),
        _ => ("N", "rad/√s", true),
    }
}

/// Items of the levels of a spread, as in "between units".
fn items(b: &Between) -> String {
    let word = |level: &&str| match *level {
        "power_on" => "power-ons",
        "month" => "months",
        "unit" => "units",
        _ => "types",
    };
    b.levels.iter().map(word).collect::<Vec<_>>().join(" and ")
}

/// A spread and its interval with their unit.
fn size(p: &FleetParameter, b: &Between) -> String {
    if p.relative {
        return format!("{} {}", percent(b.spread.std), percents(b.spread.ci95));
    }
    let [low, high] = b.spread.ci95.map(|v| significant(v, 3));
    format!("{} [{low}, {high}] {}", significant(b.spread.std, 3), words(p.name).1)
}

/// The slope with temperature and its interval with their unit.
fn per_c(p: &FleetParameter) -> Option<String> {
    let slope = p.per_c?;
    let (times, unit) = if p.relative { (100.0, "%") } else { (1.0, words(p.name).1) };
    let half = 0.5 * (slope.ci95[1] - slope.ci95[0]);
    let [value, low, high] = [slope.value, slope.ci95[0], slope.ci95[1]].map(|v| known_digits(times * v, times * half));
    Some(format!("{value} [{low}, {high}] {unit} a °C"))
}

/// The mean and its interval with their unit.
fn mean(p: &FleetParameter) -> String {
    let half = 0.5 * (p.mean.ci95[1] - p.mean.ci95[0]);
    let [value, low, high] = [p.mean.value, p.mean.ci95[0], p.mean.ci95[1]].map(|v| known_digits(v, half));
    format!("{value} [{low}, {high}] {}", words(p.name).1)
}

fn counted(n: usize, one: &str) -> String {
    format!("{n} {one}{}", if n == 1 { "" } else { "s" })
}

/// Topic, axis, and of how much the power-ons are.
pub(super) fn heading(l: &FleetLevels) -> String {
    let topic = l.topic.as_ref().map_or(String::new(), |t| format!("topic {t}, "));
    let more = [(l.types, "type"), (l.months, "month")];
    let more: String = more.iter().filter_map(|(n, one)| Some(format!(", {}", counted((*n)?, one)))).collect();
    let mean = l
        .temperature_c
        .map_or(String::new(), |t| format!(", lowest temperatures {} °C in the mean", significant(t, 3)));
    format!("{topic}axis {}: {} of {}{more}{mean}", l.axis, counted(l.power_ons, "power-on"), counted(l.units, "unit"))
}

/// Rows of a table: parameter, what, size, p value.
pub(super) fn lines(l: &FleetLevels) -> Vec<[String; 4]> {
    let of = |p: &FleetParameter| {
        let symbol = words(p.name).0.to_string();
        let mut rows = vec![[symbol.clone(), "mean".into(), mean(p), String::new()]];
        rows.extend(
            p.between
                .iter()
                .map(|b| [symbol.clone(), format!("between {}", items(b)), size(p, b), probability(b.spread.p_value)]),
        );
        rows.extend(per_c(p).map(|slope| [symbol, "with temperature".into(), slope, String::new()]));
        rows
    };
    l.parameters.iter().flat_map(of).collect()
}

/// Units that do not belong, a sentence each.
pub(super) fn apart(l: &FleetLevels) -> Vec<String> {
    let one = |p: &FleetParameter| {
        let symbol = words(p.name).0;
        let said = move |a: &crate::population::Apart| {
            format!(
                "{symbol} of {} lies {} robust standard deviations from the median of the units (p {}) and does not count",
                a.unit,
                significant(a.studentized, 3),
                equals(&probability(a.p_value))
            )
        };
        p.apart.iter().map(said).collect::<Vec<_>>()
    };
    l.parameters.iter().flat_map(one).collect()
}

/// Whether units were looked for that do not belong, and how often an ordinary fleet has one.
pub(super) fn belonging(l: &FleetLevels) -> String {
    if !l.parameters.iter().any(|p| p.apart_tested) {
        return "units that do not belong: not looked for, it takes five units of a type".into();
    }
    let none = if apart(l).is_empty() { ": none" } else { ":" };
    format!("units that do not belong (an ordinary fleet has any with probability {FLEET_LEVEL} at most){none}")
}

/// The page for a terminal.
pub(super) fn text(levels: &[FleetLevels], out: &mut String) {
    for l in levels.iter().filter(|l| !l.parameters.is_empty()) {
        // writing to a String cannot fail
        let _ = writeln!(out, "\n{}", heading(l));
        let _ = writeln!(out, "  how they differ, net of the logs' own errors (95 % intervals in brackets)");
        let rows = lines(l);
        let width = |k: usize| rows.iter().map(|r| r[k].chars().count()).max().unwrap_or(0);
        let (what, size) = (width(1), width(2));
        let mut last = "";
        for [symbol, of, value, p] in &rows {
            let shown = if last == symbol { "" } else { symbol };
            let p = if p.is_empty() { String::new() } else { format!("  p {} if there were none", equals(p)) };
            let line = format!("  {shown:<2}  {of:<what$}  {value:<size$}{p}");
            let _ = writeln!(out, "{}", line.trim_end());
            last = symbol;
        }
        let _ = writeln!(out, "  {}", belonging(l));
        apart(l).iter().for_each(|said| {
            let _ = writeln!(out, "    {said}");
        });
    }
}
