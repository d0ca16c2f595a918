//! Corrections that the equations of a drive need, over time and against their best regressors.

use super::quantity::{self, Quantity};
use super::{Axis, Chart, Panel, palette};
use crate::gap::answer::{Correction, EquationAnswer};
use crate::report::gap::words::{LITTLE, capitalised, without_kind};

/// Half the width of a 95 % band in standard deviations.
const BAND: f64 = 1.96;

/// A row of corrections over time, and below it each against its best regressor; `None` without corrections.
pub(super) fn rows(equations: &[EquationAnswer]) -> Option<[Vec<Panel>; 2]> {
    let all = equations.iter().filter_map(|e| Some((short(&e.equation), e.correction.as_ref()?)));
    let (over_time, against): (Vec<Panel>, Vec<Panel>) =
        all.map(|(name, c)| (over_time(name, c), goes_with(name, c))).unzip();
    (!over_time.is_empty()).then_some([over_time, against])
}

/// The same without its article, for titles.
pub(in crate::report) fn short(equation: &str) -> &str {
    let last = without_kind(equation);
    last.strip_prefix("the ").unwrap_or(last)
}

fn y_axis(correction: &Correction) -> (Axis, Quantity) {
    let largest =
        correction.values.iter().zip(&correction.std).map(|(v, s)| v.abs() + BAND * s).fold(0.0_f64, f64::max);
    let si = |unit| Quantity { unit, per_si: 1.0 };
    let quantity = match correction.unit.as_str() {
        "rad/s" => quantity::rate(largest, None),
        "m" => quantity::length(largest),
        "rad" => quantity::angle(largest),
        "m/s" => si("m/s"),
        "m/s²" => si("m/s²"),
        "rad/s²" => si("rad/s²"),
        _ => si(""),
    };
    let label = if correction.about_mean { "Correction about its mean" } else { "Correction" };
    (Axis::linear(label, quantity.unit).include(0.0), quantity)
}

fn over_time(name: &str, correction: &Correction) -> Panel {
    let (y, unit) = y_axis(correction);
    let Correction { times_s, values, std, starts, .. } = correction;
    // drives one after the other, a gap between
    let mut shift = 0.0;
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(times_s.len() + starts.len());
    for k in 0..times_s.len() {
        if k > 0 && starts.contains(&k) {
            points.push([f64::NAN; 3]);
            shift += times_s[k - 1] - times_s[k] + (times_s[k - 1] - times_s[k - 2]);
        }
        points.push([times_s[k] + shift, values[k], std[k]]);
    }
    let last = points.iter().map(|p| p[0]).filter(|t| !t.is_nan()).fold(0.0_f64, |m, t| m.max(t.abs()));
    let time = quantity::time(last);
    let label = if starts.is_empty() { "Time" } else { "Time, drive after drive" };
    let at = |p: &[f64; 3]| time.of(p[0]);
    let band = points.iter().map(|p| [at(p), unit.of(p[1] - BAND * p[2]), unit.of(p[1] + BAND * p[2])]);
    let line = points.iter().map(|p| [at(p), unit.of(p[1])]);
    Chart::new(Axis::linear(label, time.unit), y)
        .title(format!("{}: what it lacks", capitalised(name)))
        .band("95 %", band, palette::SKY, 0.45)
        .at_y("", 0.0, palette::GREY.stroke(1.0))
        .line("smoothed correction", line, palette::BLUE.stroke(1.5))
        .into()
}

fn goes_with(name: &str, correction: &Correction) -> Panel {
    let Some(against) = &correction.against else {
        return Panel::Notice {
            title: capitalised(name),
            text: "its correction goes with no state and no input".into(),
        };
    };
    let (y, unit) = y_axis(correction);
    let words = against.name.replace('_', " ");
    let share = correction.regressors.first().map_or(0.0, |r| r.share);
    let percent = format!("{:.0} %", 100.0 * share);
    let title = if share < LITTLE {
        format!("It goes with little: {percent} with {words}")
    } else {
        format!("{percent} of it goes with {words}")
    };
    let x_unit = match against.unit.as_str() {
        "rad" => Quantity { unit: "°", per_si: 1f64.to_degrees() },
        "s" => quantity::time(against.values.iter().fold(0.0_f64, |m, v| m.max(v.abs()))),
        _ => Quantity { unit: "", per_si: 1.0 },
    };
    let name_of_unit = if x_unit.unit.is_empty() { against.unit.as_str() } else { x_unit.unit };
    let points = || against.values.iter().zip(&correction.values).zip(&correction.std);
    let bars = points().map(|((x, v), s)| [x_unit.of(*x), unit.of(v - BAND * s), unit.of(v + BAND * s)]);
    let dots = points().map(|((x, v), _)| [x_unit.of(*x), unit.of(*v)]);
    Chart::new(Axis::linear(capitalised(&words), name_of_unit), y)
        .title(title)
        .bars("95 %", bars, palette::SKY.tint(0.6).stroke(1.5))
        .at_y("", 0.0, palette::GREY.stroke(1.0))
        .dots("correction at a knot", dots, palette::BLUE, 3.0)
        .into()
}
