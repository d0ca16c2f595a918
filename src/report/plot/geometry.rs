//! Pixels of a page: x to the right, y down. Lines and areas are cut where the frame of a chart ends.

use super::bad;
use crate::error::Result;

/// A point of the page.
pub(super) type Point = (f64, f64);

/// An upright rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub(crate) fn width(self) -> f64 {
        self.right - self.left
    }

    pub(crate) fn height(self) -> f64 {
        self.bottom - self.top
    }

    pub(crate) fn center(self) -> Point {
        (0.5 * (self.left + self.right), 0.5 * (self.top + self.bottom))
    }

    pub(crate) fn corners(self) -> Vec<Point> {
        vec![(self.left, self.top), (self.right, self.top), (self.right, self.bottom), (self.left, self.bottom)]
    }

    /// Smaller by `margin` on each side.
    pub(crate) fn inset(self, margin: f64) -> Self {
        Self {
            left: self.left + margin,
            top: self.top + margin,
            right: self.right - margin,
            bottom: self.bottom - margin,
        }
    }

    /// Refuses a frame that the text about it leaves no room for.
    pub(crate) fn check(self, title: &str) -> Result<()> {
        const LEAST: f64 = 24.0;
        if self.width() >= LEAST && self.height() >= LEAST {
            return Ok(());
        }
        Err(bad(format!("chart {title:?}"), "the page leaves no room for it").hint("make the page larger"))
    }

    /// The point of the rectangle next to `p`: where a line of 10⁹⁹ pixels is cut, rounding alone leads off the page.
    pub(crate) fn nearest(self, (x, y): Point) -> Point {
        (x.max(self.left).min(self.right), y.max(self.top).min(self.bottom))
    }

    pub(crate) fn contains(self, (x, y): Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }
}

/// The parts of a path that lie in `frame`.
pub(super) fn clip_path(points: &[Point], frame: Rect) -> Vec<Vec<Point>> {
    let mut pieces: Vec<Vec<Point>> = Vec::new();
    for pair in points.windows(2) {
        let Some((a, b)) = clip_segment(pair[0], pair[1], frame) else { continue };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&a) => piece.push(b),
            _ => pieces.push(vec![a, b]),
        }
    }
    pieces
}

/// The part of a segment that lies in `frame` (Liang and Barsky, ACM Trans. Graphics 3 (1984) 1).
fn clip_segment(a: Point, b: Point, frame: Rect) -> Option<(Point, Point)> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    let edges = [(-dx, a.0 - frame.left), (dx, frame.right - a.0), (-dy, a.1 - frame.top), (dy, frame.bottom - a.1)];
    for (outwards, room) in edges {
        if outwards == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if outwards < 0.0 {
            enter = enter.max(room / outwards);
        } else {
            leave = leave.min(room / outwards);
        }
    }
    let at = |s: f64| frame.nearest((a.0 + s * dx, a.1 + s * dy));
    // the ends themselves stay exact, so that neighbouring segments join
    let first = if enter == 0.0 { frame.nearest(a) } else { at(enter) };
    let last = if leave == 1.0 { frame.nearest(b) } else { at(leave) };
    (enter <= leave).then_some((first, last))
}

/// The part of a polygon that lies in `frame` (Sutherland and Hodgman, Comm. ACM 17 (1974) 32).
pub(super) fn clip_polygon(points: &[Point], frame: Rect) -> Vec<Point> {
    let mut ring = points.to_vec();
    let room: [&dyn Fn(Point) -> f64; 4] =
        [&|p| p.0 - frame.left, &|p| frame.right - p.0, &|p| p.1 - frame.top, &|p| frame.bottom - p.1];
    for inside in room {
        let Some(mut previous) = ring.last().copied() else { break };
        let mut kept = Vec::with_capacity(ring.len() + 4);
        for point in ring {
            let (from, to) = (inside(previous), inside(point));
            if (from >= 0.0) != (to >= 0.0) {
                let share = from / (from - to);
                kept.push((previous.0 + share * (point.0 - previous.0), previous.1 + share * (point.1 - previous.1)));
            }
            if to >= 0.0 {
                kept.push(point);
            }
            previous = point;
        }
        ring = kept;
    }
    ring.into_iter().map(|p| frame.nearest(p)).collect()
}

/// A path without the points that do not move by a third of a pixel: nobody sees them, and files stay small.
pub(super) fn thin(points: &[Point]) -> Vec<Point> {
    const VISIBLE: f64 = 1.0 / 3.0;
    let mut kept: Vec<Point> = Vec::new();
    for (i, point) in points.iter().enumerate() {
        let moved = kept.last().is_none_or(|last: &Point| (point.0 - last.0).hypot(point.1 - last.1) >= VISIBLE);
        if moved || i + 1 == points.len() {
            kept.push(*point);
        }
    }
    kept
}

/// Cuts a path of finite points into dashes of length `dash` with gaps of length `gap`.
pub(super) fn dashes(path: &[Point], [dash, gap]: [f64; 2]) -> Vec<Vec<Point>> {
    let mut pieces = Vec::new();
    let (mut drawing, mut left) = (true, dash);
    let mut piece: Vec<Point> = path.first().copied().into_iter().collect();
    for pair in path.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        loop {
            let length = (b.0 - a.0).hypot(b.1 - a.1);
            if length.is_nan() || length <= left {
                left -= length;
                if drawing {
                    piece.push(b);
                }
                break;
            }
            let share = left / length;
            a = (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1));
            if drawing {
                piece.push(a);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![a];
            }
            drawing = !drawing;
            left = if drawing { dash } else { gap };
        }
    }
    if drawing && piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Rect = Rect { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn a_path_that_leaves_and_returns_is_cut_in_two() {
        let pieces = clip_path(&[(1.0, 5.0), (5.0, 5.0), (5.0, 15.0), (7.0, 15.0), (7.0, 5.0)], FRAME);
        assert_eq!(pieces, [vec![(1.0, 5.0), (5.0, 5.0), (5.0, 10.0)], vec![(7.0, 10.0), (7.0, 5.0)]]);
        assert!(clip_path(&[(-5.0, 20.0), (20.0, 11.0)], FRAME).is_empty());
        let far = clip_path(&[(-3e99, 5.0), (7e99, 6.0), (1e99, -8e98), (-1e201, 5.0), (1e10, 5.0)], FRAME);
        assert!(!far.is_empty() && far.iter().flatten().all(|p| FRAME.contains(*p)), "{far:?}");
    }

    #[test]
    fn a_polygon_keeps_the_area_that_is_inside() {
        let area = |p: &[Point]| {
            let next = p.iter().cycle().skip(1);
            p.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f64>().abs() / 2.0
        };
        let square = [(5.0, 5.0), (15.0, 5.0), (15.0, 15.0), (5.0, 15.0)];
        assert!((area(&clip_polygon(&square, FRAME)) - 25.0).abs() < 1e-12);
        let around = [(-50.0, -50.0), (60.0, -50.0), (60.0, 60.0), (-50.0, 60.0)];
        assert!((area(&clip_polygon(&around, FRAME)) - 100.0).abs() < 1e-9);
        assert!(clip_polygon(&[(20.0, 20.0), (30.0, 20.0), (20.0, 30.0)], FRAME).is_empty());
    }

    #[test]
    fn dashes_cover_their_share_of_the_path() {
        let path = [(0.0, 0.0), (60.0, 0.0), (60.0, 40.0)];
        let pieces = dashes(&path, [6.0, 4.0]);
        let length = |p: &[Point]| p.windows(2).map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1)).sum::<f64>();
        assert_eq!(pieces.len(), 10);
        assert!((pieces.iter().map(|p| length(p)).sum::<f64>() - 60.0).abs() < 1e-9);
    }

    #[test]
    fn thinning_keeps_both_ends() {
        let path: Vec<Point> = (0..1001).map(|i| (f64::from(i) * 1e-2, 0.0)).collect();
        let thinned = thin(&path);
        assert!(thinned.len() < 40 && thinned[0] == path[0] && thinned.last() == path.last());
    }
}
