//! Path of a drive: recorded, and as the simulators before and after have it.

use super::palette::{AFTER, BEFORE};
use super::quantity::{self, Quantity};
use super::{Axis, Chart, Panel, palette};
use crate::gap::{DriveTraces, Trace};
use crate::signal::names;

/// A channel of a drive, where it was recorded.
pub(in crate::report) fn trace<'a>(drive: &'a DriveTraces, channel: &str) -> Option<&'a Trace> {
    drive.traces.iter().find(|t| t.channel == channel)
}

/// Both coordinates where both are known, broken where a piece begins.
fn points(drive: &DriveTraces, x: &[f64], y: &[f64], unit: Quantity, broken: bool) -> Vec<[f64; 2]> {
    let mut begins = drive.begins.iter().copied().peekable();
    let mut out = Vec::new();
    for (k, (x, y)) in x.iter().zip(y).enumerate() {
        let mut new = false;
        while begins.next_if(|begin| *begin <= k).is_some() {
            new = true;
        }
        if new && broken && !out.is_empty() {
            out.push([f64::NAN; 2]);
        }
        if x.is_finite() && y.is_finite() {
            out.push([unit.of(*x), unit.of(*y)]);
        }
    }
    out
}

/// The path as recorded, and as both simulators have it from the beginning of each piece to its end.
pub(in crate::report) fn path(drive: &DriveTraces, name: &str) -> Option<Panel> {
    let (x, y) = (trace(drive, names::X)?, trace(drive, names::Y)?);
    let extent = x.recorded.iter().chain(&y.recorded).filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    let unit = quantity::length(extent);
    let line = |x: &[f64], y: &[f64], broken| points(drive, x, y, unit, broken);
    let mut chart = Chart::new(Axis::linear("x", unit.unit), Axis::linear("y", unit.unit))
        .title(format!("Path{name}"))
        .equal_axes()
        .line("recorded", line(&x.recorded, &y.recorded, false), palette::BLUE.tint(0.35).stroke(6.0))
        .line("simulated, before", line(&x.before, &y.before, true), BEFORE.stroke(2.0));
    if !x.after.is_empty() {
        chart = chart.line("simulated, after", line(&x.after, &y.after, true), AFTER.stroke(2.0));
    }
    Some(chart.into())
}
