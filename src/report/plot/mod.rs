//! Pictures of results, as SVG or PNG, the same on every machine (the font is built in).
//!
//! Every figure is a pure function from plain numbers to a [`Picture`]: [`fit::FitFigure`], [`drive::TrackFigure`],
//! [`drive::ErrorFigure`], [`drive::DriveFigure`], those of `study`. Other figures are made of [`Chart`]s, [`HeatMap`]s and
//! [`Page`]s.
//!
//! A chart's data may hold NaN (a missing value: lines break there), but nothing infinite; figures of long logs are
//! drawn from envelopes and block means, so that files stay small whatever the length.

pub(in crate::report) mod axis;
pub(in crate::report) mod bars;
pub(crate) mod bench;
pub(in crate::report) mod chart;
pub(in crate::report) mod correction;
pub(crate) mod drive;
pub(in crate::report) mod envelope;
pub(crate) mod fit;
mod font;
pub(crate) mod gap;
mod geometry;
pub(in crate::report) mod heat;
pub(in crate::report) mod layout;
pub(crate) mod noise;
mod page;
pub(crate) mod palette;
pub(in crate::report) mod path;
mod picture;
pub(in crate::report) mod quantity;
mod scene;
pub(crate) mod study;

pub(crate) use axis::Axis;
pub(crate) use bars::BarChart;
pub(crate) use chart::Chart;
pub(crate) use heat::HeatMap;
pub(crate) use page::{Page, Panel};
pub(crate) use palette::{Color, Stroke};
pub(crate) use picture::{Format, Picture};

use crate::error::{Error, ErrorKind};

/// Larger numbers are no measurements, and their differences would overflow on the way to the page.
const LARGEST: f64 = 1e100;

/// An error in the numbers that a figure was given.
fn bad(place: impl std::fmt::Display, found: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Value, "figure", found).at(place)
}

#[cfg(test)]
mod tests;
