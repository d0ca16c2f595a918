//! Values of options that name axes and units.

use gyroid::ingest::Axis;
use gyroid::population::AxisChoice;
use gyroid::units::{RateUnit, TimeUnit};

/// Heading, in the help, of the options that say how to read a log.
pub(super) const LOG_OPTIONS: &str = "Log options";

/// One axis or several.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct AxisList(pub(super) Vec<AxisChoice>);

/// `all`, or axes apart by commas, none of them twice.
pub(super) fn parse_axes(text: &str) -> std::result::Result<AxisList, String> {
    let text = if text.trim() == "all" { "x,y,z" } else { text };
    let axes: Vec<AxisChoice> = text
        .split(',')
        .map(|one| parse_axis(one.trim()))
        .collect::<std::result::Result<_, _>>()
        .map_err(|e| format!("{e}, or all"))?;
    let twice = |(i, a): (usize, &AxisChoice)| axes[..i].iter().any(|b| b.axis == a.axis);
    if axes.iter().enumerate().any(twice) {
        return Err("an axis is named twice".to_string());
    }
    Ok(AxisList(axes))
}

/// An axis, and whether it points the other way.
pub(super) fn parse_axis(text: &str) -> std::result::Result<AxisChoice, String> {
    let (name, reversed) = match text.strip_prefix('-') {
        Some(name) => (name, true),
        None => (text.strip_prefix('+').unwrap_or(text), false),
    };
    let axis = Axis::parse(name).ok_or_else(|| "no axis; there are x, y, z, -x, -y, -z".to_string())?;
    Ok(AxisChoice { axis, reversed })
}

pub(super) fn parse_rate_unit(text: &str) -> std::result::Result<RateUnit, String> {
    RateUnit::parse(text).ok_or_else(|| {
        let all: Vec<String> = RateUnit::ALL.iter().map(ToString::to_string).collect();
        format!("no unit of rate; there are {}", all.join(", "))
    })
}

pub(super) fn parse_time_unit(text: &str) -> std::result::Result<TimeUnit, String> {
    TimeUnit::parse(text).ok_or_else(|| "no unit of time; there are s, ms, us, ns".to_string())
}
