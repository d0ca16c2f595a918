//! Drives as recorded and as both simulators have them: the path, the channels, and what is between them.

use super::document::Document;
use crate::gap::{DriveTraces, Trace};
use crate::report::plot::palette::{AFTER, BEFORE};
use crate::report::plot::path::{path, trace};
use crate::report::plot::quantity::{self, Quantity};
use crate::report::plot::{Axis, Chart, Panel, palette};
use crate::signal::names;

/// Drives that are shown.
const DRIVES: usize = 2;

/// Path, channels and differences of the first drives of `all`.
pub(super) fn figures(page: &mut Document, all: &[DriveTraces], held_out: bool) {
    if all.is_empty() {
        page.paragraph("The drive was not simulated.");
        return;
    }
    let what = if all.iter().all(|d| d.by_torques) { "the recorded torques" } else { "the recorded wheel speeds" };
    let of = if held_out { "held out" } else { "diagnosed from" };
    page.paragraph(&format!(
        "The drive {of}, in pieces of 20 s: at the beginning of each the simulators are put on the recorded pose and speed, and then \
         {what} alone move them. Before is the nominal simulator, after the one with the effects found."
    ));
    for drive in all.iter().take(DRIVES) {
        let name = if all.len() > 1 { format!(" of {}", drive.source) } else { String::new() };
        if let Some(path) = path(drive, &name) {
            page.figure(path, "the path after lies on the recorded one up to the end of each piece.");
        }
        if let Some([channels, differences]) = over_time(drive, &name) {
            page.figure(channels, "the line after covers the recorded one.");
            page.figure(differences, "the line after scatters about zero without a course of its own.");
        }
    }
    if all.len() > DRIVES {
        page.paragraph(&format!("{} more drives were measured.", all.len() - DRIVES));
    }
}

/// Label and unit of a channel over time.
fn axis(trace: &Trace, largest: f64) -> (&'static str, Quantity) {
    let rad_s = Quantity { unit: "rad/s", per_si: 1.0 };
    match trace.channel {
        names::GYRO_Z => ("Yaw rate, gyro", quantity::rate(largest, None)),
        names::WHEEL_LEFT => ("Left wheel", rad_s),
        names::WHEEL_RIGHT => ("Right wheel", rad_s),
        names::HEADING => ("Heading", quantity::angle(largest)),
        _ => ("Position", quantity::length(largest)),
    }
}

/// The channels over time, and recorded less simulated.
fn over_time(drive: &DriveTraces, name: &str) -> Option<[Panel; 2]> {
    let shown = [names::GYRO_Z, names::WHEEL_LEFT, names::WHEEL_RIGHT];
    let last = drive.times_s.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    let clock = quantity::time(last);
    let largest = |values: &[f64]| values.iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    let line = |values: &[f64], unit: Quantity| -> Vec<[f64; 2]> {
        let there = drive.times_s.iter().zip(values).filter(|(_, v)| v.is_finite());
        there.map(|(t, v)| [clock.of(*t), unit.of(*v)]).collect()
    };
    let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
    let (mut channels, mut differences) = (Vec::new(), Vec::new());
    for t in shown.iter().filter_map(|channel| trace(drive, channel)) {
        let (label, unit) = axis(t, largest(&t.recorded));
        let mut chart = Chart::new(Axis::linear("Time", clock.unit), Axis::linear(label, unit.unit))
            .line("recorded", line(&t.recorded, unit), palette::BLUE.stroke(3.0))
            .line("before", line(&t.before, unit), BEFORE.stroke(1.5));
        let before = less(&t.recorded, &t.before);
        let (_, apart) = axis(t, largest(&before));
        let mut beside = Chart::new(Axis::linear("Time", clock.unit), Axis::linear(label, apart.unit))
            .at_y("", 0.0, palette::BLACK.stroke(1.0))
            .line("recorded less before", line(&before, apart), BEFORE.stroke(1.5));
        if !t.after.is_empty() {
            chart = chart.line("after", line(&t.after, unit), AFTER.stroke(1.5));
            let after = less(&t.recorded, &t.after);
            beside = beside.line("recorded less after", line(&after, apart), AFTER.stroke(1.5));
        }
        channels.push(chart);
        differences.push(beside);
    }
    let stack = |title: String, charts| Panel::Stack { title, label: String::new(), charts };
    (!channels.is_empty()).then(|| {
        [
            stack(format!("Recorded and simulated over time{name}"), channels),
            stack(format!("Recorded less simulated over time{name}"), differences),
        ]
    })
}
