//! Content of a page before it becomes SVG or PNG: shapes in the order in which they are painted.

use super::font;
use super::geometry::{Point, Rect, dashes, thin};
use super::palette::{Color, Stroke};
use crate::error::{Error, ErrorKind, Result};
use crate::files::mark;
use plotters::prelude::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontDesc, FontFamily, FontStyle, FontTransform, RGBAColor, ShapeStyle, TextStyle};

/// Where a text lies about its anchor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Start,
    Middle,
    End,
}

/// A text: its anchor is on the base line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Text {
    pub at: Point,
    pub text: String,
    /// Pixels an em.
    pub size: f64,
    pub color: Color,
    pub align: Align,
    /// Read from the bottom to the top.
    pub upright: bool,
}

/// One thing to paint.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    Path { points: Vec<Point>, color: Color, width: f64 },
    Polygon { points: Vec<Point>, color: Color, alpha: f64 },
    Disc { at: Point, radius: f64, color: Color },
    Text(Text),
}

/// A page of shapes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scene {
    pub width: u32,
    pub height: u32,
    pub shapes: Vec<Shape>,
}

impl Scene {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        Self { width, height, shapes: Vec::new() }
    }

    /// A line, dashed where the stroke is.
    pub(crate) fn path(&mut self, points: &[Point], stroke: Stroke) {
        let points = thin(points);
        let pieces = match stroke.dash {
            Some(dash) => dashes(&points, dash),
            None => vec![points],
        };
        let Stroke { color, width, .. } = stroke;
        let visible = pieces.into_iter().filter(|p| p.len() > 1);
        self.shapes.extend(visible.map(|points| Shape::Path { points, color, width }));
    }

    pub(crate) fn polygon(&mut self, points: Vec<Point>, color: Color, alpha: f64) {
        if points.len() > 2 {
            self.shapes.push(Shape::Polygon { points, color, alpha });
        }
    }

    pub(crate) fn rect(&mut self, rect: Rect, color: Color, alpha: f64) {
        self.polygon(rect.corners(), color, alpha);
    }

    pub(crate) fn disc(&mut self, at: Point, radius: f64, color: Color) {
        self.shapes.push(Shape::Disc { at, radius, color });
    }

    /// Text on the base line at `at`; control characters, which XML forbids, become spaces.
    pub(crate) fn text(&mut self, at: Point, text: &str, size: f64, color: Color, align: Align) {
        self.push_text(Text { at, text: text.into(), size, color, align, upright: false });
    }

    /// Text that reads from the bottom to the top, centred on `at`.
    pub(crate) fn upright_text(&mut self, at: Point, text: &str, size: f64, color: Color) {
        self.push_text(Text { at, text: text.into(), size, color, align: Align::Middle, upright: true });
    }

    fn push_text(&mut self, mut text: Text) {
        text.text = text.text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        if !text.text.trim().is_empty() {
            self.shapes.push(Shape::Text(text));
        }
    }

    /// As SVG whose text is text; `title` is what screen readers and tooltips say.
    pub(crate) fn svg(&self, title: &str) -> Result<String> {
        // plotters writes whole pixels: a finer grid under the same picture keeps curves smooth
        const GRID: u32 = 4;
        let mut svg = String::new();
        let (width, height) = (self.width * GRID, self.height * GRID);
        {
            let mut backend = SVGBackend::with_string(&mut svg, (width, height));
            Painter { scene: self, scale: f64::from(GRID), pixels: false }.paint(&mut backend)?;
        }
        let body = svg.find('>').map_or("", |end| &svg[end + 1..]);
        Ok(format!(
            "<svg width=\"{}\" height=\"{}\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
             xmlns=\"http://www.w3.org/2000/svg\">\n<title>{}</title>\n<metadata>{}</metadata>{body}",
            self.width,
            self.height,
            escape(title),
            mark::text()
        ))
    }

    /// As rows of RGB bytes, from the top.
    pub(crate) fn rgb(&self) -> Result<Vec<u8>> {
        // plotters smooths neither areas nor thick lines: painted larger and averaged down, all edges are smooth
        const OVERSAMPLING: u32 = 3;
        let (width, height) = (self.width as usize, self.height as usize);
        let (fine_width, factor) = (width * OVERSAMPLING as usize, OVERSAMPLING as usize);
        let mut fine = vec![0xFF; fine_width * height * factor * 3];
        {
            let size = (self.width * OVERSAMPLING, self.height * OVERSAMPLING);
            let mut backend = BitMapBackend::with_buffer(&mut fine, size);
            let scale = f64::from(OVERSAMPLING);
            Painter { scene: self, scale, pixels: true }.paint(&mut backend)?;
        }
        let mut rgb = Vec::with_capacity(width * height * 3);
        let mut sums = vec![0u16; width * 3];
        for rows in fine.chunks_exact(fine_width * factor * 3) {
            sums.fill(0);
            for row in rows.chunks_exact(fine_width * 3) {
                for (sum, block) in sums.chunks_exact_mut(3).zip(row.chunks_exact(3 * factor)) {
                    for pixel in block.chunks_exact(3) {
                        sum.iter_mut().zip(pixel).for_each(|(s, v)| *s += u16::from(*v));
                    }
                }
            }
            rgb.extend(sums.iter().map(|s| (s / (factor * factor) as u16) as u8));
        }
        Ok(rgb)
    }
}

fn escape(text: &str) -> String {
    let clean = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    clean.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A path without the points that lie within one unit of the line of those that stay (Douglas and Peucker, 1973).
fn simplified(path: &[(i32, i32)]) -> Vec<(i32, i32)> {
    let mut stays = vec![false; path.len()];
    let ends = [0, path.len().saturating_sub(1)];
    ends.into_iter().for_each(|i| stays[i] = true);
    let mut open = vec![ends];
    while let Some([a, b]) = open.pop() {
        let [from, to] = [a, b].map(|i| (f64::from(path[i].0), f64::from(path[i].1)));
        let along = (to.0 - from.0, to.1 - from.1);
        let length = along.0.hypot(along.1);
        let off = |i: usize| {
            let (x, y) = (f64::from(path[i].0) - from.0, f64::from(path[i].1) - from.1);
            // beyond the ends of the line the nearer end counts
            let share =
                if length > 0.0 { ((x * along.0 + y * along.1) / (length * length)).clamp(0.0, 1.0) } else { 0.0 };
            (x - share * along.0).hypot(y - share * along.1)
        };
        let farthest = (a + 1..b).map(|i| (i, off(i))).max_by(|p, q| p.1.total_cmp(&q.1));
        if let Some((i, _)) = farthest.filter(|(_, off)| *off > 1.0) {
            stays[i] = true;
            open.extend([[a, i], [i, b]]);
        }
    }
    path.iter().zip(stays).filter_map(|(p, stays)| stays.then_some(*p)).collect()
}

/// Paints a scene by a backend of plotters.
struct Painter<'a> {
    scene: &'a Scene,
    scale: f64,
    /// Whether the backend has nothing but pixels: then letters are painted here, and paths as single segments with
    /// round joints, because plotters fills the outline of a path by the even-odd rule, which leaves holes where a
    /// noisy line crosses itself.
    pixels: bool,
}

impl Painter<'_> {
    fn paint<B: DrawingBackend>(&self, backend: &mut B) -> Result<()> {
        let scene = self.scene;
        let (width, height) = (self.grid(f64::from(scene.width)), self.grid(f64::from(scene.height)));
        backend.draw_rect((0, 0), (width, height), &style(Color(0xFF, 0xFF, 0xFF), 1.0, 1), true).map_err(refused)?;
        for shape in &scene.shapes {
            match shape {
                Shape::Path { points, color, width } => self.path(backend, points, *color, *width)?,
                Shape::Polygon { points, color, alpha } => {
                    let ring: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
                    backend.fill_polygon(ring, &style(*color, *alpha, 1)).map_err(refused)?;
                }
                Shape::Disc { at, radius, color } => {
                    let radius = self.grid(*radius).max(1) as u32;
                    backend.draw_circle(self.at(*at), radius, &style(*color, 1.0, 1), true).map_err(refused)?;
                }
                Shape::Text(text) => self.text(backend, text)?,
            }
        }
        backend.present().map_err(refused)
    }

    fn path<B: DrawingBackend>(&self, backend: &mut B, points: &[Point], color: Color, width: f64) -> Result<()> {
        let width = self.grid(width).max(1) as u32;
        let style = style(color, 1.0, width);
        let mut path: Vec<_> = points.iter().map(|p| self.at(*p)).collect();
        path.dedup();
        if path.len() < 2 {
            return Ok(());
        }
        if !self.pixels {
            return backend.draw_path(simplified(&path), &style).map_err(refused);
        }
        for segment in path.windows(2) {
            backend.draw_path([segment[0], segment[1]], &style).map_err(refused)?;
        }
        if width > 2 {
            for joint in &path[1..path.len() - 1] {
                backend.draw_circle(*joint, (width - 1) / 2, &style, true).map_err(refused)?;
            }
        }
        Ok(())
    }

    fn text<B: DrawingBackend>(&self, backend: &mut B, text: &Text) -> Result<()> {
        let size = text.size * self.scale;
        if self.pixels {
            return self.letters(backend, text, size);
        }
        // in the SVG of plotters `font-size` is size/1.24, and the top anchor lies 0.76 em above the base line
        let above = 0.76 * text.size;
        let (x, y) = text.at;
        let (anchor, transform) = if text.upright {
            ((x - above, y), FontTransform::Rotate270)
        } else {
            ((x, y - above), FontTransform::None)
        };
        let horizontal = match text.align {
            Align::Start => HPos::Left,
            Align::Middle => HPos::Center,
            Align::End => HPos::Right,
        };
        let font = FontDesc::new(FontFamily::Name(font::FAMILY), 1.24 * size, FontStyle::Normal).transform(transform);
        let ink = paint_of(text.color, 1.0);
        let style = TextStyle::from(font).color(&ink).pos(Pos::new(horizontal, VPos::Top));
        backend.draw_text(&text.text, &style, self.at(anchor)).map_err(refused)
    }

    fn letters<B: DrawingBackend>(&self, backend: &mut B, text: &Text, size: f64) -> Result<()> {
        let width = font::width_em(&text.text)? * size;
        let shift = match text.align {
            Align::Start => 0,
            Align::Middle => (-0.5 * width).round() as i32,
            Align::End => -width.round() as i32,
        };
        let (x0, y0) = self.at(text.at);
        font::rasterise(&text.text, size, |x, y, share| {
            let along = x + shift;
            let (x, y) = if text.upright { (x0 + y, y0 - along) } else { (x0 + along, y0 + y) };
            backend.draw_pixel((x, y), paint_of(text.color, share).to_backend_color()).map_err(refused)
        })
    }

    fn grid(&self, length: f64) -> i32 {
        (length * self.scale).round() as i32
    }

    fn at(&self, (x, y): Point) -> (i32, i32) {
        (self.grid(x), self.grid(y))
    }
}

fn paint_of(color: Color, alpha: f64) -> RGBAColor {
    RGBAColor(color.0, color.1, color.2, alpha)
}

fn style(color: Color, alpha: f64, width: u32) -> ShapeStyle {
    ShapeStyle { color: paint_of(color, alpha), filled: true, stroke_width: width }
}

fn refused(error: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Numeric, "figure", error)
}

#[cfg(test)]
mod tests {
    use super::simplified;

    #[test]
    fn a_simplified_path_goes_where_the_path_goes() {
        let path: Vec<(i32, i32)> =
            (0..4000).map(|k| (k, (300.0 * (f64::from(k) / 200.0).sin()).round() as i32)).collect();
        let short = simplified(&path);
        assert!(short.len() < path.len() / 10, "{}", short.len());
        assert_eq!((short.first(), short.last()), (path.first(), path.last()));
        for line in short.windows(2) {
            let ([x0, x1], [y0, y1]) = ([line[0].0, line[1].0], [f64::from(line[0].1), f64::from(line[1].1)]);
            for (x, y) in &path[x0 as usize..=x1 as usize] {
                let on = y0 + (y1 - y0) * f64::from(x - x0) / f64::from(x1 - x0);
                // off across the line, not upwards
                let steep = (y1 - y0) / f64::from(x1 - x0);
                assert!((f64::from(*y) - on).abs() / 1f64.hypot(steep) <= 1.0 + 1e-9, "{x}");
            }
        }
        // there and back again
        assert_eq!(simplified(&[(0, 0), (50, 0), (100, 0), (0, 0)]), [(0, 0), (100, 0), (0, 0)]);
    }
}
