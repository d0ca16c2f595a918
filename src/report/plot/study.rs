//! The study of filters over many simulated runs: errors over time, one run, consistency, and sensitivities.
//!
//! Filters keep the order, and so the colour, in which they are given: the same order in all figures of a study.

use super::axis::range;
use super::drive::{Dimension, check};
use super::envelope::outline;
use super::quantity::{Quantity, angle, length, time};
use super::{Axis, Chart, Page, Panel, Picture, Stroke, bad, palette};
use crate::error::Result;

/// Points of a line across the page, before extremes stand for the rest.
const COLUMNS: usize = 800;
const WIDTH: u32 = 1200;
const PURE: Quantity = Quantity { unit: "", per_si: 1.0 };
/// Where the largest series is this many times the smallest, a linear axis would hide the smaller.
const DECADES_FROM: f64 = 15.0;

/// A value of each time, or of each lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Values, SI; NaN where there is none.
    pub values: &'a [f64],
}

/// Sample autocorrelation of residuals, one strip for each averaging time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct AutocorrelationFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Autocorrelations from lag 0, with the name of what was correlated.
    pub strips: &'a [Line<'a>],
    /// 95 % of white noise lies within ± this, for each strip.
    pub bounds: &'a [f64],
}

impl AutocorrelationFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is no lag to draw, a bound is missing or not positive, or a number is
    /// infinite; it names the strip.
    pub(crate) fn draw(&self) -> Result<Picture> {
        check("bounds", self.bounds, self.strips.len())?;
        let last = self.strips.iter().map(|s| s.values.len()).max().unwrap_or(0) as f64 - 0.4;
        let charts: Vec<Chart> =
            self.strips.iter().zip(self.bounds).map(|(s, b)| strip(s, *b, last)).collect::<Result<_>>()?;
        stack(self.title, self.subtitle, "Autocorrelation", charts)
    }
}

fn strip(line: &Line, bound: f64, last: f64) -> Result<Chart> {
    check(line.name, line.values, line.values.len())?;
    if line.values.len() < 2 {
        return Err(bad(line.name, "has no lag beyond 0"));
    }
    if !(bound > 0.0) {
        return Err(bad(line.name, format!("{bound} is not a positive bound")));
    }
    let lags = || line.values.iter().enumerate().skip(1).map(|(k, r)| [k as f64, 0.0, *r]);
    let edge = 1.1 * lags().fold(1.2 * bound, |m, [_, _, r]| m.max(r.abs()));
    Ok(Chart::new(Axis::linear("Lag", "").limits(0.0, last), Axis::linear("", "").limits(-edge, edge))
        .title(line.name)
        .band("95 % of white noise", [0.0, last].map(|x| [x, -bound, bound]), palette::GREY, 0.18)
        .bars("", lags().filter(|l| l[2].abs() <= bound), palette::BLUE.stroke(5.0))
        .bars("", lags().filter(|l| l[2].abs() > bound), palette::VERMILION.stroke(5.0))
        .at_y("", 0.0, palette::GREY.stroke(1.0)))
}

/// One quantity of several filters against time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TimeRow<'a> {
    /// Name of the quantity, for the axis: "RMS error of x".
    pub label: &'a str,
    /// Its dimension.
    pub dimension: Dimension,
    /// The filters.
    pub filters: &'a [Line<'a>],
}

/// Root mean square errors over many runs, against time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RmsFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Times, s.
    pub time_s: &'a [f64],
    /// Quantities from the top.
    pub rows: &'a [TimeRow<'a>],
}

impl RmsFigure<'_> {
    /// Draws the page. Where filters differ by more than a decade, y is logarithmic.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, lengths differ, or a number is infinite; it names the
    /// filter.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let clock = clock(self.time_s)?;
        let mut charts = Vec::new();
        for row in self.rows {
            for filter in row.filters {
                check(&format!("{}, {}", row.label, filter.name), filter.values, self.time_s.len())?;
            }
            let greatest: Vec<f64> = row.filters.iter().map(|f| largest(f.values)).collect();
            let unit = unit(row.dimension, greatest.iter().copied().fold(0.0, f64::max));
            // errors begin at zero: of the way down to there, a decade and a half is shown
            let (axis, shown) = size_axis(row.label, unit, &greatest, 30.0);
            let mut chart = Chart::new(Axis::linear("Time", clock.unit), axis);
            for (i, filter) in row.filters.iter().enumerate() {
                let points = curve(self.time_s, filter.values, clock, unit).into_iter().map(|p| [p[0], shown(p[1])]);
                chart = chart.line(legend(charts.len(), filter.name), points, stroke(i));
            }
            charts.push(chart);
        }
        stack(self.title, self.subtitle, "", charts)
    }
}

/// One quantity of one run: the truth, what the filters say, and how far they are off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RunFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Name of the quantity, for the axis.
    pub label: &'a str,
    /// Its dimension.
    pub dimension: Dimension,
    /// Times, s.
    pub time_s: &'a [f64],
    /// The truth, SI.
    pub truth: &'a [f64],
    /// Estimates, SI.
    pub filters: &'a [Line<'a>],
}

impl RunFigure<'_> {
    /// Draws the quantity, and under it the errors, which are too small to be told on the scale of the motion.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, lengths differ, or a number is infinite; it names the
    /// filter.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let clock = clock(self.time_s)?;
        check("truth", self.truth, self.time_s.len())?;
        let mut errors = Vec::new();
        for filter in self.filters {
            check(filter.name, filter.values, self.time_s.len())?;
            errors.push(filter.values.iter().zip(self.truth).map(|(e, t)| e - t).collect::<Vec<f64>>());
        }
        let all = self.filters.iter().map(|f| largest(f.values));
        let whole = unit(self.dimension, all.fold(largest(self.truth), f64::max));
        let part = unit(self.dimension, errors.iter().map(|e| largest(e)).fold(0.0, f64::max));
        let axis = || Axis::linear("Time", clock.unit);
        let truth = curve(self.time_s, self.truth, clock, whole);
        let mut upper = Chart::new(axis(), Axis::linear(self.label, whole.unit)).line(
            "truth",
            truth,
            palette::GREY.tint(0.6).stroke(7.0),
        );
        let mut lower = Chart::new(axis(), Axis::linear("Estimate − truth", part.unit)).at_y(
            "",
            0.0,
            palette::GREY.tint(0.6).stroke(3.0),
        );
        for (i, (filter, error)) in self.filters.iter().zip(&errors).enumerate() {
            upper = upper.line(filter.name, curve(self.time_s, filter.values, clock, whole), stroke(i));
            lower = lower.line("", curve(self.time_s, error, clock, part), stroke(i));
        }
        stack(self.title, self.subtitle, "", vec![upper, lower])
    }
}

/// NEES, averaged over runs, against time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NeesFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Times, s.
    pub time_s: &'a [f64],
    /// Its expectation: the number of errors that it counts.
    pub expected: f64,
    /// Between these it lies for 95 % of the time if the filter is consistent.
    pub bounds95: [f64; 2],
    /// The filters.
    pub filters: &'a [Line<'a>],
}

impl NeesFigure<'_> {
    /// Draws the page; the axis is logarithmic, for a NEES of 300 means errors ten times what the filter believes.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, bounds are not positive, lengths differ, or a number is
    /// infinite; it names the filter.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let clock = clock(self.time_s)?;
        let [low, high] = self.bounds95;
        if !(0.0 < low && low < self.expected && self.expected < high && high.is_finite()) {
            return Err(bad("bounds", format!("{} is not between {low} and {high}", self.expected)));
        }
        let mut greatest = high;
        for filter in self.filters {
            check(filter.name, filter.values, self.time_s.len())?;
            greatest = greatest.max(largest(filter.values));
        }
        let ends = self.time_s.first().into_iter().chain(self.time_s.last());
        let band = ends.map(|t| [clock.of(*t), low, high]);
        let axis = Axis::log("NEES, mean over runs", "").limits(0.3 * low, 2.0 * greatest);
        let mut chart = Chart::new(Axis::linear("Time", clock.unit), axis)
            .band("holds 95 % if consistent", band, palette::GREY, 0.3)
            .at_y("", self.expected, palette::GREY.stroke(1.0));
        for (i, filter) in self.filters.iter().enumerate() {
            let points = curve(self.time_s, filter.values, clock, PURE).into_iter().map(|p| [p[0], positive(p[1])]);
            chart = chart.line(filter.name, points, stroke(i));
        }
        // over the lines, which may fill the band
        for edge in self.bounds95 {
            chart = chart.at_y("", edge, palette::BLACK.stroke(1.0).dashed());
        }
        Page::new(self.title).subtitle(self.subtitle).size(WIDTH, 720).row([chart.into()]).draw()
    }
}

/// A filter's number at each setting of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SweepLine<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Setting, value, low and high end of its interval, SI; NaN ends where there is none.
    pub points: &'a [[f64; 4]],
}

/// One quantity of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SweepRow<'a> {
    /// Name of the quantity, for the axis.
    pub label: &'a str,
    /// Its dimension; `None` for pure numbers.
    pub dimension: Option<Dimension>,
    /// The filters.
    pub filters: &'a [SweepLine<'a>],
}

/// Errors against a setting: friction, number of runs, a wrong parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SweepFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Name of the swept setting, for the axis; its scale is logarithmic.
    pub setting: &'a str,
    /// Settings with a name of their own.
    pub named: &'a [(f64, &'a str)],
    /// A value to compare with, SI: a line across.
    pub reference: Option<f64>,
    /// Whether intervals are drawn as a band, which suits a setting that is a size; else as bars.
    pub band: bool,
    /// Quantities from the top.
    pub rows: &'a [SweepRow<'a>],
}

impl SweepFigure<'_> {
    /// Draws the page. Where filters differ by more than a decade, y is logarithmic.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, a setting is not positive, or a number is infinite; it
    /// names the filter.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let charts: Vec<Chart> =
            self.rows.iter().enumerate().map(|(i, row)| self.row(i, row)).collect::<Result<_>>()?;
        stack(self.title, self.subtitle, "", charts)
    }

    fn row(&self, at: usize, row: &SweepRow) -> Result<Chart> {
        let mut greatest = Vec::new();
        for filter in row.filters {
            let name = format!("{}, {}", row.label, filter.name);
            for column in 0..4 {
                let values: Vec<f64> = filter.points.iter().map(|p| p[column]).collect();
                check(&name, &values, filter.points.len())?;
                if column == 0 && !values.iter().all(|v| *v > 0.0) {
                    return Err(bad(name, "settings must be positive"));
                }
            }
            greatest.push(filter.points.iter().flat_map(|p| [p[1], p[3]]).fold(0.0, f64::max));
        }
        let unit = row.dimension.map_or(PURE, |d| unit(d, greatest.iter().copied().fold(0.0, f64::max)));
        // a sweep may span decades where its filters do not differ
        let values = row.filters.iter().flat_map(|f| f.points.iter().map(|p| p[1])).filter(|v| *v > 0.0);
        greatest.extend(values);
        greatest.extend(self.reference);
        let (axis, shown) = size_axis(row.label, unit, &greatest, 1.6);
        let settings = range(row.filters.iter().flat_map(|f| f.points.iter().map(|p| p[0])));
        let mut chart = Chart::new(Axis::log(self.setting, "").limits(settings[0] / 1.1, settings[1] * 1.1), axis);
        for (i, filter) in row.filters.iter().enumerate() {
            let color = palette::series(i);
            // side by side where they would cover each other
            let aside = if self.band { 1.0 } else { 1.0 + 0.012 * (i as f64 - 0.5 * (row.filters.len() - 1) as f64) };
            let ends = || filter.points.iter().map(|p| [p[0] * aside, shown(unit.of(p[2])), shown(unit.of(p[3]))]);
            let middle = || filter.points.iter().map(|p| [p[0] * aside, shown(unit.of(p[1]))]);
            chart =
                if self.band { chart.band("", ends(), color, 0.2) } else { chart.bars("", ends(), color.stroke(3.0)) };
            chart = chart.line(legend(at, filter.name), middle(), stroke(i)).dots("", middle(), color, 4.5);
        }
        if let Some(reference) = self.reference {
            chart = chart.at_y("", unit.of(reference), palette::GREY.stroke(1.5));
        }
        for (setting, name) in self.named {
            // names stand above the first row only: the others share its axis
            let label = if at == 0 { *name } else { "" };
            chart = chart.at_x("", *setting, palette::GREY.stroke(1.0).dashed(), label);
        }
        Ok(chart)
    }
}

/// Slip of a wheel: true, and as a filter estimates it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlipRow<'a> {
    /// Which wheel.
    pub wheel: &'a str,
    /// True slip.
    pub truth: &'a [f64],
    /// Estimated slip.
    pub estimate: &'a [f64],
    /// Standard deviation of the estimate.
    pub std: &'a [f64],
}

/// Slip of the wheels in one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlipFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Times, s.
    pub time_s: &'a [f64],
    /// The wheels.
    pub wheels: &'a [SlipRow<'a>],
}

impl SlipFigure<'_> {
    /// Draws for each wheel its slip, and under it how far the estimate is off, beside the doubt of the filter.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, lengths differ, or a number is infinite; it names the
    /// wheel.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let clock = clock(self.time_s)?;
        let percent = Quantity { unit: "%", per_si: 100.0 };
        let mut charts: Vec<Chart> = Vec::new();
        for SlipRow { wheel, truth, estimate, std } in self.wheels {
            for values in [truth, estimate, std] {
                check(wheel, values, self.time_s.len())?;
            }
            let first = charts.is_empty();
            let name = |name: &'static str| if first { name } else { "" };
            let axis = |label: &str, [low, high]: [f64; 2]| {
                Axis::linear(format!("{label}, {wheel}"), percent.unit).limits(percent.of(low), percent.of(high))
            };
            let time = || Axis::linear("Time", clock.unit);
            charts.push(
                Chart::new(time(), axis("Slip", shown_range(truth.iter().chain(*estimate).copied())))
                    .line(name("truth"), curve(self.time_s, truth, clock, percent), palette::VERMILION.stroke(2.6))
                    .line(name("estimate"), curve(self.time_s, estimate, clock, percent), palette::BLUE.stroke(1.3)),
            );
            let error: Vec<f64> = estimate.iter().zip(*truth).map(|(e, t)| e - t).collect();
            let edges = || std.iter().flat_map(|s| [-2.0 * s, 2.0 * s]);
            // every so many rows: both edges of a band must share their times
            let every = std.len().div_ceil(2 * COLUMNS).max(1);
            let band = self.time_s.iter().zip(*std).step_by(every);
            let band = band.map(|(t, s)| [clock.of(*t), percent.of(-2.0 * s), percent.of(2.0 * s)]);
            charts.push(
                Chart::new(time(), axis("Error", shown_range(error.iter().copied().chain(edges()))))
                    .band(name("± 2 std"), band, palette::SKY.tint(0.6), 1.0)
                    .line(
                        name("estimate − truth"),
                        curve(self.time_s, &error, clock, percent),
                        palette::BLUE.stroke(1.3),
                    ),
            );
        }
        stack(self.title, self.subtitle, "", charts)
    }
}

/// Range to show of values that leap at standstill: from the 0.5 % to the 99.5 % quantile, and some room.
fn shown_range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut all: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    all.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| all.get((share * all.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0);
    let [low, high] = [at(0.005), at(0.995)];
    let room = (0.15 * (high - low)).max(1e-4);
    [low - room, high + room]
}

/// The axis for series whose greatest values are `greatest`, SI: linear from zero, or in decades from the least of them
/// over `depth`; and the function that makes a value NaN where the axis cannot show it.
fn size_axis(label: &str, unit: Quantity, greatest: &[f64], depth: f64) -> (Axis, fn(f64) -> f64) {
    let there = || greatest.iter().copied().filter(|g| *g > 0.0);
    let (low, high) = there().fold((f64::INFINITY, 0.0_f64), |(l, h), g| (l.min(g), h.max(g)));
    if high > DECADES_FROM * low {
        (Axis::log(label, unit.unit).limits(unit.of(low) / depth, unit.of(high) * 1.6), positive)
    } else {
        (Axis::linear(label, unit.unit).include(0.0), |value| value)
    }
}

/// The line of filter `i`: the first unbroken, those drawn over it dashed, so that equal ones are all seen.
fn stroke(i: usize) -> Stroke {
    let stroke = palette::series(i).stroke(2.0);
    if i == 0 { Stroke { width: 2.6, ..stroke } } else { stroke.dashed() }
}

fn positive(value: f64) -> f64 {
    if value > 0.0 { value } else { f64::NAN }
}

fn unit(dimension: Dimension, largest: f64) -> Quantity {
    match dimension {
        Dimension::Length => length(largest),
        Dimension::Angle => angle(largest),
    }
}

fn clock(time_s: &[f64]) -> Result<Quantity> {
    check("time", time_s, time_s.len())?;
    Ok(time(largest(time_s)))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().filter(|v| !v.is_nan()).fold(0.0, |m, v| m.max(v.abs()))
}

/// A line through `values`, in units of the axes.
fn curve(time_s: &[f64], values: &[f64], clock: Quantity, unit: Quantity) -> Vec<[f64; 2]> {
    let line = outline(values.len(), |i| [time_s[i], values[i]], COLUMNS);
    line.iter().map(|p| [clock.of(p[0]), unit.of(p[1])]).collect()
}

/// Filters are named in the first chart of a stack.
fn legend(row: usize, name: &str) -> &str {
    if row == 0 { name } else { "" }
}

fn stack(title: &str, subtitle: &str, label: &str, charts: Vec<Chart>) -> Result<Picture> {
    if charts.is_empty() {
        return Err(bad(title, "has nothing to draw"));
    }
    let height = 180 + (if charts.len() == 1 { 520 } else { 340 }) * charts.len().min(10) as u32;
    let panel = Panel::Stack { title: String::new(), label: label.into(), charts };
    Page::new(title).subtitle(subtitle).size(WIDTH, height).row([panel]).draw()
}

#[cfg(test)]
mod tests;
