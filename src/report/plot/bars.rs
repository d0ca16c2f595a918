//! Horizontal bars with a name before and a text behind each: probabilities, before and after.

use super::bad;
use super::font;
use super::geometry::Rect;
use super::layout::{CAP, TICK, TITLE};
use super::palette::{BLACK, Color, GREY};
use super::scene::{Align, Scene};
use crate::error::Result;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bar {
    /// Length, 0 to 1 of the room there is.
    pub length: f64,
    /// Text after the bar.
    pub text: String,
    /// Its colour.
    pub color: Color,
}

/// Rows of one or more bars.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct BarChart {
    pub(in crate::report) title: String,
    pub(in crate::report) legend: Vec<(String, Color)>,
    pub(in crate::report) rows: Vec<(String, Vec<Bar>)>,
}

const SWATCH: f64 = 14.0;
/// Highest bar, pixels.
const HIGHEST: f64 = 26.0;

impl BarChart {
    /// No rows yet.
    #[must_use]
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Names a colour above the bars.
    #[must_use]
    pub(crate) fn legend(mut self, name: impl Into<String>, color: Color) -> Self {
        self.legend.push((name.into(), color));
        self
    }

    /// Adds a row under those that are there.
    #[must_use]
    pub(crate) fn row(mut self, name: impl Into<String>, bars: impl IntoIterator<Item = Bar>) -> Self {
        self.rows.push((name.into(), bars.into_iter().collect()));
        self
    }

    pub(super) fn draw(&self, outer: Rect, scene: &mut Scene) -> Result<()> {
        let texts = |bars: &[Bar]| bars.iter().map(|b| font::width_em(&b.text)).collect::<Result<Vec<_>>>();
        let mut behind = 0.0_f64;
        for (name, bars) in &self.rows {
            if let Some(bar) = bars.iter().find(|b| !(0.0..=1.0).contains(&b.length)) {
                return Err(bad(format!("bars {:?}, row {name:?}", self.title), format!("length {}", bar.length)));
            }
            behind = texts(bars)?.into_iter().fold(behind, f64::max);
        }
        let most = 0.42 * outer.width();
        let names: Vec<String> =
            self.rows.iter().map(|(name, _)| font::fit(name, TICK, most)).collect::<Result<_>>()?;
        let widths: Vec<f64> = names.iter().map(|n| font::width_em(n)).collect::<Result<_>>()?;
        let left = outer.left + TICK * widths.iter().copied().fold(0.0, f64::max) + 12.0;
        let mut frame = Rect {
            left,
            top: outer.top + 1.6 * TITLE,
            right: outer.right - behind * TICK - 12.0,
            bottom: outer.bottom - 8.0,
        };
        let title = font::fit(&self.title, TITLE, outer.width())?;
        scene.text((outer.left, outer.top + TITLE), &title, TITLE, BLACK, Align::Start);
        if !self.legend.is_empty() {
            let mut x = outer.left;
            for (name, color) in &self.legend {
                let (top, bottom) = (frame.top, frame.top + SWATCH);
                scene.rect(Rect { left: x, top, right: x + SWATCH, bottom }, *color, 1.0);
                x += SWATCH + 8.0;
                let name = font::fit(name, TICK, outer.right - x)?;
                scene.text((x, frame.top + 0.5 * (SWATCH + CAP * TICK)), &name, TICK, BLACK, Align::Start);
                x += font::width_em(&name)? * TICK + 24.0;
            }
            frame.top += 1.9 * TICK;
        }
        frame.check(&self.title)?;
        let high = frame.height() / self.rows.len().max(1) as f64;
        for (i, (name, (_, bars))) in names.iter().zip(&self.rows).enumerate() {
            let count = bars.len().max(1) as f64;
            let bar_height = (0.8 * high / count).min(HIGHEST);
            let top = frame.top + i as f64 * high + 0.5 * (high - bar_height * count);
            let size = TICK.min(1.05 * bar_height);
            let middle = frame.top + (i as f64 + 0.5) * high;
            scene.text((frame.left - 8.0, middle + 0.5 * CAP * TICK), name, TICK, BLACK, Align::End);
            for (j, bar) in bars.iter().enumerate() {
                let top = top + j as f64 * bar_height;
                let right = frame.left + bar.length * frame.width();
                let place = Rect { left: frame.left, top: top + 1.0, right, bottom: top + bar_height - 1.0 };
                if place.width() > 0.0 {
                    scene.rect(place, bar.color, 1.0);
                }
                let base = top + 0.5 * (bar_height + CAP * size);
                scene.text((right + 6.0, base), &bar.text, size, BLACK, Align::Start);
            }
        }
        scene.path(&[(frame.left, frame.top), (frame.left, frame.bottom)], GREY.stroke(1.0));
        Ok(())
    }
}
