//! Drives: paths on a map, and errors over time with the filter's own standard deviations.

use super::envelope::outline;
use super::geometry::{Point, thin};
use super::quantity::{Quantity, angle, length, time};
use super::{Axis, Chart, LARGEST, Page, Panel, Picture, bad, palette};
use crate::error::Result;

/// One path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Track<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Positions, m; NaN breaks the path.
    pub x_m: &'a [f64],
    /// Positions, m; as many as `x_m`.
    pub y_m: &'a [f64],
}

/// Paths of one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrackFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Where the robot was, drawn broad underneath the others.
    pub reference: Option<Track<'a>>,
    /// Where it was held to be.
    pub tracks: &'a [Track<'a>],
}

/// Points of a line across the page, before extremes stand for the rest.
const COLUMNS: usize = 1000;

impl TrackFigure<'_> {
    /// Draws the map: both axes have the same scale.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is no position, lengths differ, or a number is infinite; it names the track.
    pub(crate) fn draw(&self) -> Result<Picture> {
        Page::new(self.title).subtitle(self.subtitle).size(1200, 1000).row([self.chart()?.into()]).draw()
    }

    fn chart(&self) -> Result<Chart> {
        let all = || self.reference.iter().chain(self.tracks);
        let mut extent = 0.0_f64;
        for track in all() {
            check(track.name, track.x_m, track.y_m.len())?;
            check(track.name, track.y_m, track.x_m.len())?;
            let positions = track.x_m.iter().chain(track.y_m).filter(|v| !v.is_nan());
            extent = positions.fold(extent, |m, v| m.max(v.abs()));
        }
        let unit = length(extent);
        let mut chart = Chart::new(Axis::linear("x", unit.unit), Axis::linear("y", unit.unit)).equal_axes();
        let broad = palette::GREY.tint(0.6).stroke(6.0);
        let strokes = (0..).map(|i| {
            let stroke = palette::series(i).stroke(width(i));
            if i == 0 { stroke } else { stroke.dashed() }
        });
        let under = self.reference.iter().map(|track| (track, broad));
        let mut begin = None;
        for (track, stroke) in under.chain(self.tracks.iter().zip(strokes)) {
            let path = path(track, unit, extent);
            begin = begin.or(path.iter().copied().find(|p| !p[0].is_nan()));
            chart = chart.line(track.name, path, stroke);
        }
        Ok(chart.dots("start", begin, palette::BLACK, 6.0))
    }
}

/// Later lines are thinner, so that one that they cover still shows at their sides.
fn width(i: usize) -> f64 {
    (2.6 - 0.5 * i as f64).max(1.0)
}

/// The path, without points that no page is large enough to tell apart.
fn path(track: &Track, unit: Quantity, extent: f64) -> Vec<[f64; 2]> {
    const PIXELS: f64 = 2000.0;
    let scale = if extent > 0.0 { PIXELS / extent } else { 1.0 };
    let points: Vec<Point> = track.x_m.iter().zip(track.y_m).map(|(x, y)| (x * scale, y * scale)).collect();
    let mut out = Vec::new();
    for run in points.split(|p| p.0.is_nan() || p.1.is_nan()) {
        if !out.is_empty() {
            out.push([f64::NAN; 2]);
        }
        out.extend(thin(run).into_iter().map(|(x, y)| [unit.of(x / scale), unit.of(y / scale)]));
    }
    out
}

/// Dimension of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Dimension {
    /// Metres.
    Length,
    /// Radians.
    Angle,
}

/// One filter's error in one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ErrorSeries<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Estimate less truth, SI; NaN where there is no truth.
    pub error: &'a [f64],
    /// The filter's own standard deviation, SI: ±2 of it are drawn as a band.
    pub std: Option<&'a [f64]>,
}

/// Errors in one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ErrorRow<'a> {
    /// Name of the quantity, for the axis: "Heading error".
    pub label: &'a str,
    /// Its dimension.
    pub dimension: Dimension,
    /// One or more filters.
    pub series: &'a [ErrorSeries<'a>],
}

/// Errors of one drive against time, a row for each quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ErrorFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// A sentence under it.
    pub subtitle: &'a str,
    /// Times, s.
    pub time_s: &'a [f64],
    /// Quantities from the top.
    pub rows: &'a [ErrorRow<'a>],
}

impl ErrorFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there is nothing to draw, lengths differ, or a number is infinite; it names the
    /// series.
    #[cfg(test)]
    pub(crate) fn draw(&self) -> Result<Picture> {
        let stack = self.stack()?;
        let height = 160 + 270 * self.rows.len().clamp(1, 12) as u32;
        Page::new(self.title).subtitle(self.subtitle).size(1200, height).row([stack]).draw()
    }

    fn stack(&self) -> Result<Panel> {
        check("time", self.time_s, self.time_s.len())?;
        let clock = time(self.time_s.iter().fold(0.0, |m, t| m.max(t.abs())));
        let charts: Vec<Chart> = self.rows.iter().map(|row| self.row(row, clock)).collect::<Result<_>>()?;
        Ok(Panel::Stack { title: String::new(), label: String::new(), charts })
    }

    fn row(&self, row: &ErrorRow, clock: Quantity) -> Result<Chart> {
        let mut largest = 0.0_f64;
        for series in row.series {
            for values in [Some(series.error), series.std].into_iter().flatten() {
                check(&format!("{}, {}", row.label, series.name), values, self.time_s.len())?;
                largest = values.iter().filter(|v| !v.is_nan()).fold(largest, |m, v| m.max(v.abs()));
            }
        }
        let unit = match row.dimension {
            Dimension::Length => length(largest),
            Dimension::Angle => angle(largest),
        };
        let mut chart = Chart::new(Axis::linear("Time", clock.unit), Axis::linear(row.label, unit.unit)).at_y(
            "",
            0.0,
            palette::GREY.stroke(1.0),
        );
        for (i, series) in row.series.iter().enumerate() {
            if let Some(std) = series.std {
                let edge = outline(std.len(), |i| [self.time_s[i], std[i]], COLUMNS);
                let band = edge.iter().map(|p| [clock.of(p[0]), -2.0 * unit.of(p[1]), 2.0 * unit.of(p[1])]);
                chart = chart.band(format!("±2σ, {}", series.name), band, palette::series(i), 0.18);
            }
        }
        for (i, series) in row.series.iter().enumerate() {
            let line = outline(series.error.len(), |i| [self.time_s[i], series.error[i]], COLUMNS);
            let points = line.iter().map(|p| [clock.of(p[0]), unit.of(p[1])]);
            chart = chart.line(series.name, points, palette::series(i).stroke(width(i)));
        }
        Ok(chart)
    }
}

/// A drive on one page: its paths, and beside them the errors against time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DriveFigure<'a> {
    /// The paths; title and subtitle are the page's.
    pub tracks: TrackFigure<'a>,
    /// The errors, where there is something to compare with.
    pub errors: Option<ErrorFigure<'a>>,
}

impl DriveFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// As [`TrackFigure::draw`] and [`ErrorFigure::draw`].
    pub(crate) fn draw(&self) -> Result<Picture> {
        let Some(errors) = &self.errors else { return self.tracks.draw() };
        Page::new(self.tracks.title)
            .subtitle(self.tracks.subtitle)
            .size(2000, 1000)
            .row([self.tracks.chart()?.into(), errors.stack()?])
            .draw()
    }
}

pub(super) fn check(name: &str, values: &[f64], rows: usize) -> Result<()> {
    if values.len() != rows {
        return Err(bad(name, format!("{} values on {rows} rows", values.len())));
    }
    match values.iter().position(|v| v.abs() > LARGEST) {
        Some(i) => Err(bad(format!("{name}, row {i}"), format!("{:e} cannot be shown", values[i]))),
        None => Ok(()),
    }
}
