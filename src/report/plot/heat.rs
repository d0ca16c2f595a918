//! A matrix as coloured cells with their numbers: confusion matrices, correlations.

use super::axis::number;
use super::font;
use super::geometry::Rect;
use super::layout::{CAP, LABEL, TICK, TITLE};
use super::palette::{BLACK, BLUE, VERMILION, WHITE};
use super::scene::{Align, Scene};
use super::{LARGEST, bad};
use crate::error::Result;

/// Cells with a number each, row by row from the top. NaN is an empty cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HeatMap {
    pub(in crate::report) title: String,
    pub(in crate::report) rows: Vec<String>,
    pub(in crate::report) columns: Vec<String>,
    pub(in crate::report) labels: [String; 2],
    pub(in crate::report) values: Vec<f64>,
    pub(in crate::report) places: usize,
}

impl HeatMap {
    /// A matrix of `rows.len()` × `columns.len()` cells; `values` row by row.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if there are no cells, their number does not fit, or one is infinite.
    pub(crate) fn new(
        rows: impl IntoIterator<Item = impl Into<String>>,
        columns: impl IntoIterator<Item = impl Into<String>>,
        values: Vec<f64>,
    ) -> Result<Self> {
        let rows: Vec<String> = rows.into_iter().map(Into::into).collect();
        let columns: Vec<String> = columns.into_iter().map(Into::into).collect();
        if values.is_empty() || values.len() != rows.len() * columns.len() {
            let found = format!("{} values for {} rows and {} columns", values.len(), rows.len(), columns.len());
            return Err(bad("heat map", found));
        }
        if let Some(i) = values.iter().position(|v| v.abs() > LARGEST) {
            let place = format!("heat map, row {:?}, column {:?}", rows[i / columns.len()], columns[i % columns.len()]);
            return Err(bad(place, format!("{:e} cannot be shown", values[i])));
        }
        Ok(Self { title: String::new(), rows, columns, labels: Default::default(), values, places: 2 })
    }

    /// The title above the matrix.
    #[must_use]
    pub(crate) fn title(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Sets the labels of rows and columns.
    #[must_use]
    pub(crate) fn labels(mut self, rows: impl Into<String>, columns: impl Into<String>) -> Self {
        self.labels = [rows.into(), columns.into()];
        self
    }

    /// Decimal places of the numbers in the cells; 2 unless told.
    #[must_use]
    pub(crate) fn places(mut self, places: usize) -> Self {
        self.places = places;
        self
    }

    pub(super) fn draw(&self, outer: Rect, scene: &mut Scene) -> Result<()> {
        let most = 0.35 * outer.width();
        let names: Vec<String> = self.rows.iter().map(|r| font::fit(r, TICK, most)).collect::<Result<_>>()?;
        let widths: Vec<f64> = names.iter().map(|n| font::width_em(n)).collect::<Result<_>>()?;
        let frame = Rect {
            left: outer.left + 1.5 * LABEL + 20.0 + TICK * widths.iter().copied().fold(0.0, f64::max),
            top: outer.top + if self.title.is_empty() { 4.0 } else { 1.6 * TITLE },
            right: outer.right - 4.0,
            bottom: outer.bottom - 1.5 * TICK - 1.5 * LABEL,
        };
        frame.check(&self.title)?;
        let title = font::fit(&self.title, TITLE, outer.right - frame.left)?;
        scene.text((frame.left, outer.top + TITLE), &title, TITLE, BLACK, Align::Start);
        let (wide, high) = (frame.width() / self.columns.len() as f64, frame.height() / self.rows.len() as f64);
        // symmetric about zero, so that the colour shows the sign
        let largest = self.values.iter().filter(|v| !v.is_nan()).fold(0.0_f64, |m, v| m.max(v.abs()));
        for (i, value) in self.values.iter().enumerate() {
            let (row, column) = ((i / self.columns.len()) as f64, (i % self.columns.len()) as f64);
            let cell = Rect {
                left: frame.left + column * wide,
                top: frame.top + row * high,
                right: frame.left + (column + 1.0) * wide,
                bottom: frame.top + (row + 1.0) * high,
            };
            if value.is_nan() {
                continue;
            }
            let share = if largest > 0.0 { value.abs() / largest } else { 0.0 };
            let color = if *value < 0.0 { VERMILION } else { BLUE }.tint(share);
            scene.rect(cell.inset(1.0), color, 1.0);
            let text = number(*value, self.places);
            let size = TICK.min(0.6 * high).min(0.9 * wide / font::width_em(&text)?.max(0.1));
            if size >= 7.0 {
                let (x, y) = cell.center();
                let ink = if color.lightness() > 0.55 { BLACK } else { WHITE };
                scene.text((x, y + 0.5 * CAP * size), &text, size, ink, Align::Middle);
            }
        }
        for (i, name) in names.iter().enumerate() {
            let y = frame.top + (i as f64 + 0.5) * high;
            scene.text((frame.left - 8.0, y + 0.5 * CAP * TICK), name, TICK, BLACK, Align::End);
        }
        for (i, name) in self.columns.iter().enumerate() {
            let name = font::fit(name, TICK, wide - 6.0)?;
            let x = frame.left + (i as f64 + 0.5) * wide;
            scene.text((x, frame.bottom + 1.2 * TICK), &name, TICK, BLACK, Align::Middle);
        }
        let [rows, columns] = &self.labels;
        let rows = font::fit(rows, LABEL, frame.height())?;
        let columns = font::fit(columns, LABEL, frame.width())?;
        scene.upright_text((outer.left + LABEL, frame.center().1), &rows, LABEL, BLACK);
        scene.text((frame.center().0, outer.bottom - 0.25 * LABEL), &columns, LABEL, BLACK, Align::Middle);
        Ok(())
    }
}
