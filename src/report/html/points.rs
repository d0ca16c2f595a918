//! Fewer points that look the same, and their numbers as short text.

use crate::report::plot::chart::Mark;
use crate::report::plot::envelope::outline;

/// Points of a mark, a column a coordinate; NaN breaks it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns(pub Vec<Vec<f64>>);

impl Columns {
    fn of<const N: usize>(points: &[[f64; N]]) -> Self {
        Self((0..N).map(|i| points.iter().map(|p| p[i]).collect()).collect())
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.0.first().map_or(0, Vec::len)
    }
}

/// The points of `mark`, about `most` of them: extremes stand for the rest. None where the mark has no points.
pub(super) fn reduced(mark: &Mark, most: usize) -> Option<Columns> {
    match mark {
        Mark::Line { points, .. } => Some(Columns::of(&line(points, most))),
        Mark::Dots { points, .. } => Some(Columns::of(&dots(points, most))),
        Mark::Band { points, .. } => Some(Columns::of(&band(points, most))),
        Mark::Bars { points, .. } => Some(Columns::of(&dots(points, most))),
        Mark::AtX { .. } | Mark::AtY { .. } | Mark::SpanX { .. } => None,
    }
}

fn line(points: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    if points.len() <= most {
        return points.to_vec();
    }
    let runs_on = points.windows(2).all(|w| !(w[1][0] < w[0][0]));
    if runs_on {
        return outline(points.len(), |i| points[i], most / 4);
    }
    // a path: points are left out that do not move by a grid that gets coarser
    let [x, y] = [0, 1].map(|i| {
        let ends = points.iter().map(|p| p[i]).filter(|v| !v.is_nan());
        ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
    });
    let mut step = (x[1] - x[0]).max(y[1] - y[0]) / 2000.0;
    loop {
        let mut kept: Vec<[f64; 2]> = Vec::new();
        for (i, p) in points.iter().enumerate() {
            let moved = kept.last().is_none_or(|last| {
                let away = (p[0] - last[0]).hypot(p[1] - last[1]);
                // where one of both is a break, the break is kept
                away >= step || away.is_nan() && !(p[0].is_nan() && last[0].is_nan())
            });
            if moved || i + 1 == points.len() {
                kept.push(*p);
            }
        }
        if kept.len() <= most || !(step > 0.0 && step.is_finite()) {
            return kept;
        }
        step *= 2.0;
    }
}

/// The lowest and the highest point of each part.
fn dots<const N: usize>(points: &[[f64; N]], most: usize) -> Vec<[f64; N]> {
    if points.len() <= most {
        return points.to_vec();
    }
    let size = points.len().div_ceil(most.max(2) / 2);
    let mut kept = Vec::with_capacity(most);
    for part in points.chunks(size) {
        let there = || part.iter().enumerate().filter(|(_, p)| p.iter().all(|v| !v.is_nan()));
        let low = there().min_by(|a, b| a.1[N - 1].total_cmp(&b.1[N - 1]));
        let high = there().max_by(|a, b| a.1[N - 1].total_cmp(&b.1[N - 1]));
        let mut both: Vec<_> = low.into_iter().chain(high).collect();
        both.sort_by_key(|one| one.0);
        both.dedup_by_key(|one| one.0);
        kept.extend(both.into_iter().map(|(_, p)| *p));
    }
    kept
}

/// Two points, at the ends of each part, with the extremes of the part.
fn band(points: &[[f64; 3]], most: usize) -> Vec<[f64; 3]> {
    if points.len() <= most {
        return points.to_vec();
    }
    let size = points.len().div_ceil(most.max(4) / 2).max(2);
    let mut kept = Vec::with_capacity(most);
    for part in points.chunks(size) {
        let there: Vec<&[f64; 3]> = part.iter().filter(|p| p.iter().all(|v| !v.is_nan())).collect();
        let (Some(first), Some(last)) = (there.first(), there.last()) else {
            kept.push([f64::NAN; 3]);
            continue;
        };
        let low = there.iter().fold(f64::INFINITY, |m, p| m.min(p[1]));
        let high = there.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[2]));
        kept.push([first[0], low, high]);
        kept.push([last[0], low, high]);
    }
    kept
}

/// `value` to within `step`, as JSON: NaN is null, and no digit is spent in vain.
pub(super) fn short(value: f64, step: f64) -> String {
    if !value.is_finite() {
        return "null".into();
    }
    let places = (-step.log10()).ceil();
    if !(0.0..=12.0).contains(&places) {
        return format!("{value:.6e}");
    }
    let places = places as usize;
    let text = format!("{value:.places$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".into() } else { text.to_owned() }
}

/// The numbers of a column as a JSON list, to 10⁻⁶ of its range.
pub(super) fn list(values: &[f64]) -> String {
    let there = values.iter().filter(|v| v.is_finite());
    let [low, high] = there.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)]);
    let step = 1e-6 * if high > low { high - low } else { high.abs().max(1e-300) };
    let all: Vec<String> = values.iter().map(|v| short(*v, step)).collect();
    format!("[{}]", all.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::plot::palette;

    #[test]
    fn reduced_marks_keep_their_extremes() {
        let mut points: Vec<[f64; 2]> = (0..50_000).map(|i| [f64::from(i), (f64::from(i) * 1e-3).sin()]).collect();
        points[31_111][1] = 7.0;
        points[31_112][1] = -7.0;
        let high = |c: &Columns, i: usize| c.0[i].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = |c: &Columns, i: usize| c.0[i].iter().copied().fold(f64::INFINITY, f64::min);
        let stroke = palette::BLUE.stroke(1.0);
        let line = reduced(&Mark::Line { points: points.clone(), stroke }, 1000).unwrap();
        let dots = reduced(&Mark::Dots { points: points.clone(), color: palette::BLUE, radius: 2.0 }, 1000).unwrap();
        let areas: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1] - 1.0, p[1] + 1.0]).collect();
        let band = reduced(&Mark::Band { points: areas, color: palette::BLUE, alpha: 0.5 }, 1000).unwrap();
        for one in [&line, &dots] {
            assert!(one.len() <= 1010 && high(one, 1) == 7.0 && low(one, 1) == -7.0, "{}", one.len());
        }
        assert!(band.len() <= 1010 && high(&band, 2) == 8.0 && low(&band, 1) == -8.0);
    }

    #[test]
    fn a_path_that_turns_back_keeps_its_extent() {
        let points: Vec<[f64; 2]> =
            (0..100_000).map(|i| (f64::from(i) * 1e-3).sin_cos()).map(|(x, y)| [x, y]).collect();
        let kept = line(&points, 500);
        assert!(kept.len() <= 500, "{}", kept.len());
        let reach = |i: usize| kept.iter().map(|p| p[i]).fold(0.0, f64::max);
        assert!(reach(0) > 0.99 && reach(1) > 0.99);
    }

    #[test]
    fn numbers_are_short_and_close() {
        assert_eq!(list(&[0.0, 1.0, f64::NAN, 0.333_333_333]), "[0,1,null,0.333333]");
        assert_eq!(short(1e-30, 1e-36), "1.000000e-30");
    }
}
