//! A page: a title, a few words under it, and panels in rows.

use super::bad;
use super::bars::BarChart;
use super::chart::Chart;
use super::font;
use super::geometry::Rect;
use super::heat::HeatMap;
use super::layout::{LABEL, Placed, Shared, TITLE};
use super::palette::{BLACK, GREY};
use super::picture::Picture;
use super::scene::{Align, Scene};
use crate::error::Result;

const PAGE_TITLE: f64 = 26.0;
const SUBTITLE: f64 = 18.0;
const MARGIN: f64 = 24.0;
const BETWEEN: f64 = 30.0;
/// Smaller pages have no room for labels, larger ones need gigabytes.
const SIDES: std::ops::RangeInclusive<u32> = 200..=5000;

/// Content of one place of a page.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Panel {
    /// One chart.
    Chart(Chart),
    /// Charts above one another that share their x axis, under one title; the label of y is common to all.
    Stack {
        /// Title above the charts.
        title: String,
        /// Label of y.
        label: String,
        /// Charts from the top; only the lowest shows labels along x.
        charts: Vec<Chart>,
    },
    /// A matrix.
    HeatMap(HeatMap),
    /// Bars with names.
    Bars(BarChart),
    /// Words in the place of a chart that could not be made, and why.
    Notice {
        /// Title of the missing chart.
        title: String,
        /// Why it is not.
        text: String,
    },
}

impl From<Chart> for Panel {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<HeatMap> for Panel {
    fn from(map: HeatMap) -> Self {
        Self::HeatMap(map)
    }
}

impl From<BarChart> for Panel {
    fn from(bars: BarChart) -> Self {
        Self::Bars(bars)
    }
}

/// Panels in rows under a title.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Page {
    title: String,
    subtitle: String,
    width: u32,
    height: u32,
    rows: Vec<Vec<Panel>>,
}

impl Page {
    /// An empty page of 1600 by 1200 pixels.
    #[must_use]
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), subtitle: String::new(), width: 1600, height: 1200, rows: Vec::new() }
    }

    /// A sentence under the title.
    #[must_use]
    pub(crate) fn subtitle(mut self, subtitle: impl Into<String>) -> Self {
        self.subtitle = subtitle.into();
        self
    }

    /// Size in pixels, 200 to 5000 a side.
    #[must_use]
    pub(crate) fn size(mut self, width: u32, height: u32) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Adds a row of panels of equal width; all rows are equally high.
    #[must_use]
    pub(crate) fn row(mut self, panels: impl IntoIterator<Item = Panel>) -> Self {
        self.rows.push(panels.into_iter().collect());
        self
    }

    /// The panels, row by row.
    pub(in crate::report) fn into_panels(self) -> Vec<Panel> {
        self.rows.into_iter().flatten().collect()
    }

    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if a chart has no finite data, or a value that cannot be shown; it names the chart.
    pub(crate) fn draw(&self) -> Result<Picture> {
        for side in [self.width, self.height] {
            if !SIDES.contains(&side) {
                let found = format!("{side} pixels are not between {} and {}", SIDES.start(), SIDES.end());
                return Err(bad("page size", found));
            }
        }
        let mut scene = Scene::new(self.width, self.height);
        let page = Rect { left: 0.0, top: 0.0, right: f64::from(self.width), bottom: f64::from(self.height) };
        let mut inner = page.inset(MARGIN);
        for (text, size, color, most) in
            [(&self.title, PAGE_TITLE, BLACK, 1), (&self.subtitle, SUBTITLE, BLACK.towards(GREY, 0.3), 2)]
        {
            for line in font::wrap(text, size, inner.width(), most)? {
                scene.text((inner.left, inner.top + 0.85 * size), &line, size, color, Align::Start);
                inner.top += 1.4 * size;
            }
        }
        if inner.top > MARGIN {
            inner.top += 10.0;
        }
        let height = divided(inner.height(), self.rows.len());
        for (i, row) in self.rows.iter().enumerate() {
            let top = inner.top + i as f64 * (height + BETWEEN);
            let width = divided(inner.width(), row.len());
            for (j, panel) in row.iter().enumerate() {
                let left = inner.left + j as f64 * (width + BETWEEN);
                panel.draw(Rect { left, top, right: left + width, bottom: top + height }, &mut scene)?;
            }
        }
        Ok(Picture { scene, title: self.title.clone(), panels: self.rows.concat() })
    }
}

/// Size of one of `parts` with gaps between them.
fn divided(length: f64, parts: usize) -> f64 {
    let parts = parts.max(1) as f64;
    (length - (parts - 1.0) * BETWEEN) / parts
}

impl Panel {
    /// The panel with this title.
    pub(in crate::report) fn titled(mut self, name: &str) -> Self {
        match &mut self {
            Self::Chart(Chart { title, .. })
            | Self::Stack { title, .. }
            | Self::Notice { title, .. }
            | Self::HeatMap(HeatMap { title, .. })
            | Self::Bars(BarChart { title, .. }) => name.clone_into(title),
        }
        self
    }

    fn draw(&self, place: Rect, scene: &mut Scene) -> Result<()> {
        match self {
            Self::Chart(chart) => Placed::new(chart, place, Shared::default())?.draw(scene),
            Self::HeatMap(map) => map.draw(place, scene),
            Self::Bars(bars) => bars.draw(place, scene),
            Self::Stack { title, label, charts } => stack(title, label, charts, place, scene),
            Self::Notice { title, text } => {
                scene.text((place.left, place.top + TITLE), title, TITLE, BLACK, Align::Start);
                let lines = font::wrap(text, LABEL, 0.8 * place.width(), 4)?;
                let (x, y) = place.center();
                for (i, line) in lines.iter().enumerate() {
                    scene.text((x, y + 1.4 * LABEL * i as f64), line, LABEL, GREY, Align::Middle);
                }
                Ok(())
            }
        }
    }
}

/// Charts above one another with their frames in line.
fn stack(title: &str, label: &str, charts: &[Chart], place: Rect, scene: &mut Scene) -> Result<()> {
    // the label along x of the lowest chart takes the height of two lines of text
    const X_LABELS: f64 = 48.0;
    let label_room = if label.is_empty() { 0.0 } else { 1.4 * LABEL };
    let title_room = if title.is_empty() { 0.0 } else { 1.5 * TITLE };
    let inner = Rect { left: place.left + label_room, top: place.top + title_room, ..place };
    let height = (inner.height() - X_LABELS) / charts.len().max(1) as f64;
    let places = |i: usize| Rect {
        top: inner.top + i as f64 * height,
        bottom: inner.top + (i + 1) as f64 * height + if i + 1 == charts.len() { X_LABELS } else { 0.0 },
        ..inner
    };
    let shared = |i: usize, left| Shared { left, hide_x: i + 1 != charts.len(), small_title: true };
    let mut left = 0.0_f64;
    for (i, chart) in charts.iter().enumerate() {
        left = left.max(Placed::new(chart, places(i), shared(i, None))?.left());
    }
    for (i, chart) in charts.iter().enumerate() {
        Placed::new(chart, places(i), shared(i, Some(left)))?.draw(scene)?;
    }
    let text = font::fit(title, TITLE, inner.width() - left)?;
    scene.text((inner.left + left, place.top + TITLE), &text, TITLE, BLACK, Align::Start);
    let text = font::fit(label, LABEL, inner.height())?;
    let middle = 0.5 * (inner.top + inner.bottom - X_LABELS);
    scene.upright_text((place.left + LABEL, middle), &text, LABEL, BLACK);
    Ok(())
}
