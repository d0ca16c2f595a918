//! From a chart and the place that it gets to shapes: margins are measured first, then everything is drawn.

use super::axis::{Scale, Ticks};
use super::chart::{Chart, Mark, Series};
use super::font;
use super::geometry::{Point, Rect, clip_path, clip_polygon};
use super::palette::{BLACK, Color, Stroke};
use super::scene::{Align, Scene};
use crate::error::Result;

/// Sizes of text, pixels an em.
pub(super) const TITLE: f64 = 20.0;
pub(super) const LABEL: f64 = 18.0;
pub(super) const TICK: f64 = 16.0;
const LEGEND: f64 = 16.0;

const GRID: Color = Color(0xE4, 0xE4, 0xE4);
const FINE_GRID: Color = Color(0xF3, 0xF3, 0xF3);
const FRAME: Color = Color(0x60, 0x60, 0x60);
const LINE_HEIGHT: f64 = 1.45;
/// Cap height in ems: half of it centres text on a point.
pub(super) const CAP: f64 = 0.73;
const SWATCH: f64 = 30.0;
const GAP: f64 = 8.0;

/// Settings that a stack of charts imposes on each of them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Shared {
    /// Room on the left for tick labels and the label of y, pixels; measured where it is `None`.
    pub left: Option<f64>,
    /// No labels along x: the chart below has them.
    pub hide_x: bool,
    /// The stack has the title, those of its charts are smaller.
    pub small_title: bool,
}

/// A chart whose scales and margins are settled.
pub(super) struct Placed<'a> {
    chart: &'a Chart,
    outer: Rect,
    frame: Rect,
    x: Scale,
    y: Scale,
    x_ticks: Ticks,
    y_ticks: Ticks,
    y_label: String,
    legend: Vec<Vec<(&'a Series, f64)>>,
    hide_x: bool,
    title_size: f64,
}

impl<'a> Placed<'a> {
    /// Settles `chart` within `outer`.
    pub(crate) fn new(chart: &'a Chart, outer: Rect, shared: Shared) -> Result<Self> {
        chart.check()?;
        let data_x = chart.x.scale(chart.xs(), 0.01)?;
        let data_y = chart.y.scale(chart.ys(), 0.05)?;
        let legend = legend_rows(chart, outer.width())?;
        let mut frame = outer;
        frame.top += legend.len() as f64 * LEGEND * LINE_HEIGHT + 0.5 * TICK;
        let title_size = if shared.small_title { LEGEND } else { TITLE };
        if !chart.title.is_empty() {
            frame.top += title_size * LINE_HEIGHT;
        }
        if chart.series.iter().any(|s| matches!(&s.mark, Mark::AtX { label, .. } if !label.is_empty())) {
            frame.top += TICK;
        }
        if shared.hide_x {
            frame.bottom -= 0.6 * TICK;
        } else {
            frame.bottom -= 1.4 * TICK + LABEL * LINE_HEIGHT;
        }
        frame.right -= 1.2 * TICK;
        // the labels of y need room, which changes the scales of a map, which changes the labels
        let mut left = shared.left.unwrap_or(0.0);
        let (x, y, y_ticks, y_label) = loop {
            frame.left = outer.left + left;
            frame.check(&chart.title)?;
            let (mut x, mut y, mut shrunk) = (data_x, data_y, frame);
            if chart.equal {
                equalise(chart, &mut x, &mut y, &mut shrunk);
            }
            let ticks = y_ticks(y, shrunk.height());
            let label = chart.y.text(ticks.left_out.clone());
            let needed = widest(&ticks)? + GAP + if label.is_empty() { 4.0 } else { LABEL * LINE_HEIGHT };
            if shared.left.is_some() || needed <= left {
                shrunk.check(&chart.title)?;
                frame = shrunk;
                break (x, y, ticks, label);
            }
            left = needed;
        };
        let x_ticks = x_ticks(x, frame.width())?;
        Ok(Self { chart, outer, frame, x, y, x_ticks, y_ticks, y_label, legend, hide_x: shared.hide_x, title_size })
    }

    /// Room that the chart needs on its left.
    pub(crate) fn left(&self) -> f64 {
        self.frame.left - self.outer.left
    }

    pub(crate) fn draw(&self, scene: &mut Scene) -> Result<()> {
        self.grid(scene);
        for series in &self.chart.series {
            self.mark(&series.mark, scene);
        }
        let mut border = self.frame.corners();
        border.push(border[0]);
        scene.path(&border, FRAME.stroke(1.0));
        self.labels(scene)?;
        self.heading(scene)
    }

    fn at(&self, x: f64, y: f64) -> Point {
        let f = self.frame;
        (f.left + self.x.share(x) * f.width(), f.bottom - self.y.share(y) * f.height())
    }

    fn grid(&self, scene: &mut Scene) {
        let Rect { left, top, right, bottom } = self.frame;
        let up = |scene: &mut Scene, x: f64, color: Color| {
            let x = left + self.x.share(x) * self.frame.width();
            scene.path(&[(x, top), (x, bottom)], color.stroke(1.0));
        };
        let across = |scene: &mut Scene, y: f64, color: Color| {
            let y = bottom - self.y.share(y) * self.frame.height();
            scene.path(&[(left, y), (right, y)], color.stroke(1.0));
        };
        self.x_ticks.minor.iter().for_each(|x| up(scene, *x, FINE_GRID));
        self.y_ticks.minor.iter().for_each(|y| across(scene, *y, FINE_GRID));
        self.x_ticks.major.iter().for_each(|(x, _)| up(scene, *x, GRID));
        self.y_ticks.major.iter().for_each(|(y, _)| across(scene, *y, GRID));
    }

    fn mark(&self, mark: &Mark, scene: &mut Scene) {
        let Rect { left, top, right, bottom } = self.frame;
        match mark {
            Mark::Line { points, stroke } => {
                for run in points.split(|p| p.iter().any(|v| v.is_nan())) {
                    let path: Vec<Point> = run.iter().map(|p| self.at(p[0], p[1])).collect();
                    clip_path(&path, self.frame).iter().for_each(|piece| scene.path(piece, *stroke));
                }
            }
            Mark::Dots { points, color, radius } => {
                let visible = points.iter().map(|p| self.at(p[0], p[1])).filter(|p| self.frame.contains(*p));
                visible.for_each(|p| scene.disc(p, *radius, *color));
            }
            Mark::Band { points, color, alpha } => {
                for run in points.split(|p| p.iter().any(|v| v.is_nan())) {
                    let up = run.iter().map(|p| self.at(p[0], p[2]));
                    let back = run.iter().rev().map(|p| self.at(p[0], p[1]));
                    let ring: Vec<Point> = up.chain(back).collect();
                    scene.polygon(clip_polygon(&ring, self.frame), *color, *alpha);
                }
            }
            Mark::Bars { points, stroke } => {
                for [x, low, high] in points {
                    if [x, low, high].iter().all(|v| !v.is_nan()) {
                        let bar = [self.at(*x, *low), self.at(*x, *high)];
                        clip_path(&bar, self.frame).iter().for_each(|piece| scene.path(piece, *stroke));
                    }
                }
            }
            Mark::AtX { x, stroke, label } => {
                let at = left + self.x.share(*x) * self.frame.width();
                if (left..=right).contains(&at) {
                    scene.path(&[(at, top), (at, bottom)], *stroke);
                    scene.text((at, top - 0.3 * TICK), label, TICK, stroke.color, Align::Middle);
                }
            }
            Mark::AtY { y, .. } if y.is_nan() => {}
            Mark::AtY { y, stroke } => {
                let at = bottom - self.y.share(*y) * self.frame.height();
                clip_path(&[(left, at), (right, at)], self.frame).iter().for_each(|p| scene.path(p, *stroke));
            }
            Mark::SpanX { from, to, color, alpha } => {
                let place = |v: f64, edge: f64| {
                    let at = left + self.x.share(v) * self.frame.width();
                    if v.is_finite() && at.is_finite() { at.clamp(left, right) } else { edge }
                };
                let span = Rect { left: place(*from, left), right: place(*to, right), top, bottom };
                if span.width() > 0.0 {
                    scene.rect(span, *color, *alpha);
                }
            }
        }
    }

    fn labels(&self, scene: &mut Scene) -> Result<()> {
        let Rect { left, bottom, .. } = self.frame;
        for (value, label) in &self.y_ticks.major {
            let y = bottom - self.y.share(*value) * self.frame.height();
            scene.text((left - GAP, y + 0.5 * CAP * TICK), label, TICK, BLACK, Align::End);
        }
        if !self.y_label.is_empty() {
            let x = self.outer.left + LABEL;
            let text = font::fit(&self.y_label, LABEL, self.frame.height())?;
            scene.upright_text((x, self.frame.center().1), &text, LABEL, BLACK);
        }
        if self.hide_x {
            return Ok(());
        }
        for (value, label) in &self.x_ticks.major {
            let x = left + self.x.share(*value) * self.frame.width();
            scene.text((x, bottom + 1.2 * TICK), label, TICK, BLACK, Align::Middle);
        }
        let text = self.chart.x.text(self.x_ticks.left_out.clone());
        let text = font::fit(&text, LABEL, self.outer.width())?;
        let half = 0.5 * font::width_em(&text)? * LABEL;
        let middle = within(self.frame.center().0, half, [self.outer.left, self.outer.right]);
        scene.text((middle, self.outer.bottom - 0.25 * LABEL), &text, LABEL, BLACK, Align::Middle);
        Ok(())
    }

    fn heading(&self, scene: &mut Scene) -> Result<()> {
        let mut y = self.outer.top;
        if !self.chart.title.is_empty() {
            let size = self.title_size;
            let title = font::fit(&self.chart.title, size, self.outer.right - self.frame.left)?;
            scene.text((self.frame.left, y + size), &title, size, BLACK, Align::Start);
            y += size * LINE_HEIGHT;
        }
        for row in &self.legend {
            let mut x = self.frame.left.min(self.outer.right - row.iter().map(|e| e.1).sum::<f64>());
            x = x.max(self.outer.left);
            for (series, width) in row {
                let place = Rect { left: x, top: y, right: x + SWATCH, bottom: y + LEGEND };
                swatch(&series.mark, place, scene);
                let room = self.outer.right - (x + SWATCH + GAP);
                let name = font::fit(&series.name, LEGEND, room)?;
                scene.text((x + SWATCH + GAP, y + 0.5 * (1.0 + CAP) * LEGEND), &name, LEGEND, BLACK, Align::Start);
                x += width;
            }
            y += LEGEND * LINE_HEIGHT;
        }
        Ok(())
    }
}

/// The middle of a text of twice `half` that is centred on `middle`, but does not leave its place.
fn within(middle: f64, half: f64, [low, high]: [f64; 2]) -> f64 {
    middle.min(high - half).max(low + half)
}

/// Widest label of an axis, pixels.
fn widest(ticks: &Ticks) -> Result<f64> {
    let widths = ticks.major.iter().map(|(_, label)| font::width_em(label));
    Ok(TICK * widths.collect::<Result<Vec<_>>>()?.into_iter().fold(0.0, f64::max))
}

/// Ticks along y: 48 pixels apart they read well; low charts put up with 20, so that they have more than one.
pub(in crate::report) fn y_ticks(scale: Scale, height: f64) -> Ticks {
    let (good, most) = ((height / 48.0) as usize, (height / 20.0) as usize);
    let enough = (good.max(1)..=most).map(|count| scale.ticks(count)).find(|t| t.major.len() >= 3);
    let mut ticks = enough.unwrap_or_else(|| scale.ticks(good.max(2)));
    let heights = vec![1.1 * TICK; ticks.major.len()];
    keep_apart(&mut ticks, &heights, scale, height);
    ticks
}

/// As many ticks along x as there is room for their labels.
pub(in crate::report) fn x_ticks(scale: Scale, width: f64) -> Result<Ticks> {
    let mut count = ((width / 60.0) as usize).clamp(2, 10);
    let mut ticks = scale.ticks(count);
    while count > 2 && widest(&ticks)? + 1.2 * TICK > width / ticks.major.len().max(1) as f64 {
        count -= 1;
        ticks = scale.ticks(count);
    }
    let widths = ticks.major.iter().map(|(_, label)| Ok(font::width_em(label)? * TICK + 0.5 * TICK));
    let widths = widths.collect::<Result<Vec<f64>>>()?;
    keep_apart(&mut ticks, &widths, scale, width);
    Ok(ticks)
}

/// Drops labels that would run into the one before; `sizes` are their lengths along the axis, pixels.
fn keep_apart(ticks: &mut Ticks, sizes: &[f64], scale: Scale, length: f64) {
    let mut taken = f64::NEG_INFINITY;
    for ((value, label), size) in ticks.major.iter_mut().zip(sizes) {
        let at = scale.share(*value) * length;
        if at - 0.5 * size < taken {
            label.clear();
        } else {
            taken = at + 0.5 * size;
        }
    }
}

/// Makes a unit as long along x as along y: widens the scale that has room to spare, or shrinks the frame where both
/// scales are prescribed.
fn equalise(chart: &Chart, x: &mut Scale, y: &mut Scale, frame: &mut Rect) {
    let (along_x, along_y) = (frame.width() / x.span(), frame.height() / y.span());
    let spare = (along_x / along_y).max(along_y / along_x);
    match (chart.x.is_prescribed() && chart.y.is_prescribed(), along_x > along_y) {
        (true, true) => frame.right = frame.left + frame.width() / spare,
        (true, false) => frame.bottom = frame.top + frame.height() / spare,
        (false, true) => *x = x.widened(0.5 * (spare - 1.0)),
        (false, false) => *y = y.widened(0.5 * (spare - 1.0)),
    }
}

/// The named series in rows of the legend, each with its width.
fn legend_rows(chart: &Chart, width: f64) -> Result<Vec<Vec<(&Series, f64)>>> {
    let mut rows: Vec<Vec<(&Series, f64)>> = Vec::new();
    let mut used = f64::INFINITY;
    for series in chart.series.iter().filter(|s| !s.name.is_empty()) {
        let entry = SWATCH + GAP + font::width_em(&series.name)? * LEGEND + 2.5 * GAP;
        if used + entry > width {
            rows.push(Vec::new());
            used = 0.0;
        }
        used += entry;
        if let Some(row) = rows.last_mut() {
            row.push((series, entry));
        }
    }
    Ok(rows)
}

/// The sign of a series in the legend.
fn swatch(mark: &Mark, place: Rect, scene: &mut Scene) {
    let (x, y) = place.center();
    let line = |scene: &mut Scene, stroke: Stroke| scene.path(&[(place.left, y), (place.right, y)], stroke);
    match mark {
        Mark::Line { stroke, .. } | Mark::AtX { stroke, .. } | Mark::AtY { stroke, .. } => line(scene, *stroke),
        Mark::Dots { color, radius, .. } => scene.disc((x, y), radius.max(2.5), *color),
        Mark::Band { color, alpha, .. } | Mark::SpanX { color, alpha, .. } => {
            scene.rect(Rect { top: y - 6.0, bottom: y + 6.0, ..place }, *color, *alpha);
        }
        Mark::Bars { stroke, .. } => scene.path(&[(x, y - 8.0), (x, y + 8.0)], *stroke),
    }
}
