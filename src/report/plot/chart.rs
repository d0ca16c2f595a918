//! A chart: two axes, elements between them, and a legend above, clear of the data.

use super::axis::Axis;
use super::palette::{Color, Stroke};
use super::{LARGEST, bad};
use crate::error::Result;

/// Elements of a chart, in the units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::report) enum Mark {
    /// A line through points.
    Line { points: Vec<[f64; 2]>, stroke: Stroke },
    /// Dots.
    Dots { points: Vec<[f64; 2]>, color: Color, radius: f64 },
    /// The area between low and high: [x, low, high].
    Band { points: Vec<[f64; 3]>, color: Color, alpha: f64 },
    /// Vertical bars [x, low, high].
    Bars { points: Vec<[f64; 3]>, stroke: Stroke },
    /// A straight line across the chart at one x, and a name for it above the frame.
    AtX { x: f64, stroke: Stroke, label: String },
    /// A straight line across the chart at one y.
    AtY { y: f64, stroke: Stroke },
    /// The area between two x, over the whole height.
    SpanX { from: f64, to: f64, color: Color, alpha: f64 },
}

/// One entry of a chart. An empty name stays out of the legend.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::report) struct Series {
    pub name: String,
    pub mark: Mark,
}

/// Axes and the elements between them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chart {
    pub(in crate::report) title: String,
    pub(in crate::report) x: Axis,
    pub(in crate::report) y: Axis,
    pub(in crate::report) series: Vec<Series>,
    pub(in crate::report) equal: bool,
}

impl Chart {
    /// An empty chart.
    #[must_use]
    pub(crate) fn new(x: Axis, y: Axis) -> Self {
        Self { title: String::new(), x, y, series: Vec::new(), equal: false }
    }

    /// The title above the chart.
    #[must_use]
    pub(crate) fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// A unit of x is as long as a unit of y: for maps. Both axes must be linear.
    #[must_use]
    pub(crate) fn equal_axes(mut self) -> Self {
        self.equal = true;
        self
    }

    /// A line through `[x, y]`; NaN breaks it. An empty `name` keeps an entry out of the legend, here and below.
    #[must_use]
    pub(crate) fn line(
        self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = [f64; 2]>,
        stroke: Stroke,
    ) -> Self {
        self.push(name, Mark::Line { points: points.into_iter().collect(), stroke })
    }

    /// A dot at each `[x, y]`; radius in pixels.
    #[must_use]
    pub(crate) fn dots(
        self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = [f64; 2]>,
        color: Color,
        radius: f64,
    ) -> Self {
        self.push(name, Mark::Dots { points: points.into_iter().collect(), color, radius })
    }

    /// The area between low and high along `[x, low, high]`; `alpha` is its opacity; NaN breaks it.
    #[must_use]
    pub(crate) fn band(
        self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = [f64; 3]>,
        color: Color,
        alpha: f64,
    ) -> Self {
        self.push(name, Mark::Band { points: points.into_iter().collect(), color, alpha })
    }

    /// A vertical bar for each `[x, low, high]`: error bars, or the lags of a correlation.
    #[must_use]
    pub(crate) fn bars(
        self,
        name: impl Into<String>,
        points: impl IntoIterator<Item = [f64; 3]>,
        stroke: Stroke,
    ) -> Self {
        self.push(name, Mark::Bars { points: points.into_iter().collect(), stroke })
    }

    /// A vertical line across the chart, with `label` above the frame. NaN draws none, here and below.
    #[must_use]
    pub(crate) fn at_x(self, name: impl Into<String>, x: f64, stroke: Stroke, label: impl Into<String>) -> Self {
        self.push(name, Mark::AtX { x, stroke, label: label.into() })
    }

    /// A horizontal line across the chart.
    #[must_use]
    pub(crate) fn at_y(self, name: impl Into<String>, y: f64, stroke: Stroke) -> Self {
        self.push(name, Mark::AtY { y, stroke })
    }

    /// The area between two x over the whole height; an end may be infinite, which means: to the edge.
    #[must_use]
    pub(crate) fn span_x(self, name: impl Into<String>, [from, to]: [f64; 2], color: Color, alpha: f64) -> Self {
        self.push(name, Mark::SpanX { from, to, color, alpha })
    }

    fn push(mut self, name: impl Into<String>, mark: Mark) -> Self {
        self.series.push(Series { name: name.into(), mark });
        self
    }

    /// Refuses infinite and absurdly large numbers by the name of their series, and maps in decades.
    pub(in crate::report) fn check(&self) -> Result<()> {
        if self.equal && (self.x.is_logarithmic() || self.y.is_logarithmic()) {
            return Err(bad(format!("chart {:?}", self.title), "equal axes must both be linear"));
        }
        for Series { name, mark } in &self.series {
            let flat: Box<dyn Iterator<Item = f64>> = match mark {
                Mark::Line { points, .. } | Mark::Dots { points, .. } => Box::new(points.iter().flatten().copied()),
                Mark::Band { points, .. } | Mark::Bars { points, .. } => Box::new(points.iter().flatten().copied()),
                Mark::AtX { x: v, .. } | Mark::AtY { y: v, .. } => Box::new(std::iter::once(*v)),
                // infinite ends are allowed here
                Mark::SpanX { .. } => Box::new(std::iter::empty()),
            };
            if let Some(value) = { flat }.find(|v| v.abs() > LARGEST) {
                return Err(bad(
                    format!("chart {:?}, series {name:?}", self.title),
                    format!("{value:e} cannot be shown"),
                ));
            }
        }
        Ok(())
    }

    /// All x of the data, for the scale; lines across follow the data and do not stretch it.
    pub(in crate::report) fn xs(&self) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(|s| -> Box<dyn Iterator<Item = f64>> {
            match &s.mark {
                Mark::Line { points, .. } | Mark::Dots { points, .. } => Box::new(points.iter().map(|p| p[0])),
                Mark::Band { points, .. } | Mark::Bars { points, .. } => Box::new(points.iter().map(|p| p[0])),
                _ => Box::new(std::iter::empty()),
            }
        })
    }

    /// All y of the data, for the scale.
    pub(in crate::report) fn ys(&self) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(|s| -> Box<dyn Iterator<Item = f64>> {
            match &s.mark {
                Mark::Line { points, .. } | Mark::Dots { points, .. } => Box::new(points.iter().map(|p| p[1])),
                Mark::Band { points, .. } | Mark::Bars { points, .. } => {
                    Box::new(points.iter().flat_map(|p| [p[1], p[2]]))
                }
                Mark::AtY { y, .. } => Box::new(std::iter::once(*y)),
                _ => Box::new(std::iter::empty()),
            }
        })
    }
}
