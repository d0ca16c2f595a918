//! A chart as SVG that is visible without a script, with its data as JSON for the one that zooms.

use super::ink;
use super::points::{self, Columns};
use super::text::{escape, inside_script};
use crate::error::Result;
use crate::report::plot::axis::{Scale, Ticks};
use crate::report::plot::chart::{Chart, Mark, Series};
use crate::report::plot::layout::{x_ticks, y_ticks};
use serde_json::json;
use std::fmt::Write;

/// Width of the picture in its own units, which are pixels where it is shown as wide.
const WIDTH: f64 = 760.0;
/// Room above, right of and below the frame.
const TOP: f64 = 18.0;
const RIGHT: f64 = 20.0;
const BOTTOM: f64 = 42.0;
/// Size of text, and what a digit takes of it.
const FONT: f64 = 13.0;
const DIGIT: f64 = 0.6;
/// Points of a mark in the picture that stands without the script.
const STATIC: usize = 1200;

/// Settings of a chart on its page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    /// Height of the picture.
    pub height: f64,
    /// Points of a mark that the script gets.
    pub points: usize,
    /// Whether the chart above has the same legend, so that this one needs none.
    pub as_above: bool,
}

/// Frame and scales.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: Scale,
    y: Scale,
    x_ticks: Ticks,
    y_ticks: Ticks,
}

impl Frame {
    fn of(chart: &Chart, height: f64) -> Result<Self> {
        chart.check()?;
        let mut x = chart.x.scale(chart.xs(), 0.01)?;
        let mut y = chart.y.scale(chart.ys(), 0.05)?;
        let (top, bottom, right) = (TOP, height - BOTTOM, WIDTH - RIGHT);
        let mut left = 64.0;
        if chart.equal {
            let (along_x, along_y) = ((right - left) / x.span(), (bottom - top) / y.span());
            if along_x > along_y {
                x = x.widened(0.5 * (along_x / along_y - 1.0));
            } else {
                y = y.widened(0.5 * (along_y / along_x - 1.0));
            }
        }
        let y_ticks = y_ticks(y, bottom - top);
        if !chart.equal {
            let widest = y_ticks.major.iter().map(|t| t.1.chars().count()).max().unwrap_or(0);
            left = 34.0 + DIGIT * FONT * widest as f64;
        }
        let x_ticks = x_ticks(x, right - left)?;
        Ok(Self { left, right, top, bottom, x, y, x_ticks, y_ticks })
    }

    fn at_x(&self, x: f64) -> f64 {
        self.left + self.x.share(x) * (self.right - self.left)
    }

    fn at_y(&self, y: f64) -> f64 {
        // far outside of the frame all is cut off, and numbers stay short
        let height = self.bottom - self.top;
        (self.bottom - self.y.share(y) * height).clamp(self.top - height, self.bottom + height)
    }
}

/// The chart: legend, picture, data.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if it has no finite data, or a value that cannot be shown.
pub(super) fn html(chart: &Chart, shown: Shown, id: &str) -> Result<String> {
    let frame = Frame::of(chart, shown.height)?;
    let mut out = String::new();
    // writing to a String cannot fail
    let equal = if chart.equal { " map" } else { "" };
    let _ = write!(out, "<div class=\"chart{equal}\" id=\"{id}\">");
    if !shown.as_above {
        legend(&mut out, chart);
    }
    let title = if chart.title.is_empty() { axis_text(chart) } else { chart.title.clone() };
    let _ = write!(
        out,
        "<svg viewBox=\"0 0 {WIDTH} {}\" role=\"img\" aria-labelledby=\"{id}-t {id}-d\"><title id=\"{id}-t\">{}</title><desc \
         id=\"{id}-d\">{}</desc>",
        shown.height,
        escape(&title),
        escape(&described(chart, &frame)),
    );
    grid(&mut out, &frame);
    let _ = write!(
        out,
        "<clipPath id=\"{id}-c\"><rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath><g \
         clip-path=\"url(#{id}-c)\">",
        frame.left,
        frame.top,
        frame.right - frame.left,
        frame.bottom - frame.top
    );
    for series in &chart.series {
        mark(&mut out, &series.mark, &frame);
    }
    out.push_str("</g>");
    labels(&mut out, chart, &frame);
    out.push_str("</svg>");
    let data = data(chart, &frame, shown);
    let _ = write!(out, "<script type=\"application/json\">{}</script></div>", inside_script(&data));
    Ok(out)
}

/// Both labels, as a title for charts without one.
fn axis_text(chart: &Chart) -> String {
    format!("{} against {}", chart.y.label, chart.x.label.to_lowercase())
}

/// Text alternative of a chart.
fn described(chart: &Chart, frame: &Frame) -> String {
    let ends = |scale: Scale, logarithmic: bool, unit: &str| {
        let [low, high] = scale.ends().map(|v| if logarithmic { 10f64.powf(v) } else { v });
        format!("{low:.3e} to {high:.3e} {unit}")
    };
    let names: Vec<&str> = names(chart).collect();
    format!(
        "{} from {}, {} from {}. Shown: {}.",
        chart.x.label,
        ends(frame.x, chart.x.is_logarithmic(), &chart.x.unit).trim(),
        if chart.y.label.is_empty() { "value" } else { &chart.y.label },
        ends(frame.y, chart.y.is_logarithmic(), &chart.y.unit).trim(),
        if names.is_empty() { "one series".to_string() } else { names.join(", ") }
    )
}

/// Names of the series that are in the legend.
pub(super) fn names(chart: &Chart) -> impl Iterator<Item = &str> {
    chart.series.iter().map(|s| s.name.as_str()).filter(|name| !name.is_empty())
}

fn legend(out: &mut String, chart: &Chart) {
    let named: Vec<&Series> = chart.series.iter().filter(|s| !s.name.is_empty()).collect();
    if named.is_empty() {
        return;
    }
    out.push_str("<ul class=\"legend\">");
    for series in named {
        let sign = match &series.mark {
            Mark::Line { stroke, .. } | Mark::AtX { stroke, .. } | Mark::AtY { stroke, .. } => {
                let dash = if stroke.dash.is_some() { " stroke-dasharray=\"6 4\"" } else { "" };
                let width = stroke.width.clamp(1.5, 4.0);
                let style = ink::style(stroke.color);
                format!("<path class=\"mark line\" style=\"{style}\" d=\"M1 6H25\" stroke-width=\"{width}\"{dash}/>")
            }
            Mark::Bars { stroke, .. } => {
                let style = ink::style(stroke.color);
                format!(
                    "<path class=\"mark line\" style=\"{style}\" d=\"M13 0V12\" stroke-width=\"{}\"/>",
                    stroke.width
                )
            }
            Mark::Dots { color, radius, .. } => {
                let style = ink::style(*color);
                format!("<circle class=\"mark area\" style=\"{style}\" cx=\"13\" cy=\"6\" r=\"{}\"/>", radius.max(2.5))
            }
            Mark::Band { color, alpha, .. } | Mark::SpanX { color, alpha, .. } => {
                let style = ink::style(*color);
                format!(
                    "<rect class=\"mark area\" style=\"{style}\" x=\"1\" y=\"1\" width=\"24\" height=\"10\" \
                     fill-opacity=\"{alpha}\"/>"
                )
            }
        };
        let name = escape(&series.name);
        let _ = write!(out, "<li><svg width=\"26\" height=\"12\" aria-hidden=\"true\">{sign}</svg> {name}</li>");
    }
    out.push_str("</ul>");
}

fn grid(out: &mut String, frame: &Frame) {
    let Frame { left, right, top, bottom, .. } = frame;
    let mut lines = [String::new(), String::new()];
    let up = |d: &mut String, x: f64| {
        let _ = write!(d, "M{:.1} {top}V{bottom}", frame.at_x(x));
    };
    let across = |d: &mut String, y: f64| {
        let _ = write!(d, "M{left:.1} {:.1}H{right}", frame.at_y(y));
    };
    frame.x_ticks.minor.iter().for_each(|x| up(&mut lines[0], *x));
    frame.y_ticks.minor.iter().for_each(|y| across(&mut lines[0], *y));
    frame.x_ticks.major.iter().for_each(|(x, _)| up(&mut lines[1], *x));
    frame.y_ticks.major.iter().for_each(|(y, _)| across(&mut lines[1], *y));
    let [minor, major] = lines;
    let _ = write!(out, "<path class=\"grid fine\" d=\"{minor}\"/><path class=\"grid\" d=\"{major}\"/>");
}

/// `x y` pairs of the finite runs of points.
fn runs<'a>(columns: &'a Columns, frame: &'a Frame) -> impl Iterator<Item = Vec<Vec<f64>>> + 'a {
    let rows: Vec<Vec<f64>> = (0..columns.len())
        .map(|i| {
            let mut row: Vec<f64> = columns.0.iter().map(|c| c[i]).collect();
            row[0] = frame.at_x(row[0]);
            row[1..].iter_mut().for_each(|v| *v = if v.is_nan() { *v } else { frame.at_y(*v) });
            row
        })
        .collect();
    let split: Vec<Vec<Vec<f64>>> =
        rows.split(|r| r.iter().any(|v| !v.is_finite())).filter(|run| !run.is_empty()).map(<[_]>::to_vec).collect();
    split.into_iter()
}

fn mark(out: &mut String, mark: &Mark, frame: &Frame) {
    let columns = points::reduced(mark, STATIC);
    let runs = |columns: &Columns| runs(columns, frame).collect::<Vec<_>>();
    let mut d = String::new();
    match (mark, columns) {
        (Mark::Line { stroke, .. }, Some(columns)) => {
            for run in runs(&columns) {
                let mut last = [f64::NAN; 2];
                for (i, p) in run.iter().enumerate() {
                    if (p[0] - last[0]).hypot(p[1] - last[1]) < 0.4 && i + 1 < run.len() {
                        continue;
                    }
                    let _ = write!(d, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, p[0], p[1]);
                    last = [p[0], p[1]];
                }
            }
            let dash = stroke.dash.map(|[a, b]| format!(" stroke-dasharray=\"{a} {b}\"")).unwrap_or_default();
            let (style, width) = (ink::style(stroke.color), stroke.width);
            let _ =
                write!(out, "<path class=\"mark line\" style=\"{style}\" stroke-width=\"{width}\"{dash} d=\"{d}\"/>");
        }
        (Mark::Dots { color, radius, .. }, Some(columns)) => {
            for p in runs(&columns).iter().flatten() {
                let _ = write!(d, "M{:.1} {:.1}h0", p[0], p[1]);
            }
            let (style, width) = (ink::style(*color), 2.0 * radius);
            let _ = write!(out, "<path class=\"mark line\" style=\"{style}\" stroke-width=\"{width}\" d=\"{d}\"/>");
        }
        (Mark::Band { color, alpha, .. }, Some(columns)) => {
            for run in runs(&columns) {
                let up = run.iter().map(|p| [p[0], p[2]]);
                for (i, p) in up.chain(run.iter().rev().map(|p| [p[0], p[1]])).enumerate() {
                    let _ = write!(d, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, p[0], p[1]);
                }
                d.push('Z');
            }
            let style = ink::style(*color);
            let _ = write!(out, "<path class=\"mark area\" style=\"{style}\" fill-opacity=\"{alpha}\" d=\"{d}\"/>");
        }
        (Mark::Bars { stroke, .. }, Some(columns)) => {
            for p in runs(&columns).iter().flatten() {
                let _ = write!(d, "M{:.1} {:.1}V{:.1}", p[0], p[1], p[2]);
            }
            let (style, width) = (ink::style(stroke.color), stroke.width);
            let _ = write!(out, "<path class=\"mark line\" style=\"{style}\" stroke-width=\"{width}\" d=\"{d}\"/>");
        }
        (Mark::AtX { x, stroke, .. }, _) if x.is_finite() => {
            let (style, x) = (ink::style(stroke.color), frame.at_x(*x));
            let dash = stroke.dash.map_or("", |_| " stroke-dasharray=\"6 4\"");
            let (top, bottom, width) = (frame.top, frame.bottom, stroke.width);
            let _ = write!(
                out,
                "<path class=\"mark line\" style=\"{style}\" stroke-width=\"{width}\"{dash} d=\"M{x:.1} {top}V{bottom}\"/>"
            );
        }
        (Mark::AtY { y, stroke }, _) if y.is_finite() => {
            let (style, y) = (ink::style(stroke.color), frame.at_y(*y));
            let dash = stroke.dash.map_or("", |_| " stroke-dasharray=\"6 4\"");
            let (left, right, width) = (frame.left, frame.right, stroke.width);
            let _ = write!(
                out,
                "<path class=\"mark line\" style=\"{style}\" stroke-width=\"{width}\"{dash} d=\"M{left:.1} {y:.1}H{right}\"/>"
            );
        }
        (Mark::SpanX { from, to, color, alpha }, _) => {
            let place = |v: f64, edge: f64| {
                let at = frame.at_x(v);
                if v.is_finite() && at.is_finite() { at.clamp(frame.left, frame.right) } else { edge }
            };
            let (left, right) = (place(*from, frame.left), place(*to, frame.right));
            let (style, height) = (ink::style(*color), frame.bottom - frame.top);
            let _ = write!(
                out,
                "<rect class=\"mark area\" style=\"{style}\" fill-opacity=\"{alpha}\" x=\"{left:.1}\" y=\"{}\" \
                 width=\"{:.1}\" height=\"{height}\"/>",
                frame.top,
                (right - left).max(0.0)
            );
        }
        _ => {}
    }
}

fn labels(out: &mut String, chart: &Chart, frame: &Frame) {
    let Frame { left, right, top, bottom, .. } = frame;
    let (width, height) = (right - left, bottom - top);
    let _ = write!(
        out,
        "<rect class=\"frame\" x=\"{left:.1}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height}\"/><g class=\"ticks\">"
    );
    for (value, label) in frame.y_ticks.major.iter().filter(|t| !t.1.is_empty()) {
        let (x, y) = (left - 7.0, frame.at_y(*value) + 4.5);
        let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{label}</text>");
    }
    for (value, label) in frame.x_ticks.major.iter().filter(|t| !t.1.is_empty()) {
        let (x, y) = (frame.at_x(*value), bottom + 16.0);
        let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>");
    }
    for series in &chart.series {
        if let Mark::AtX { x, label, .. } = &series.mark
            && !label.is_empty()
            && (0.0..=1.0).contains(&frame.x.share(*x))
        {
            let (x, y) = (frame.at_x(*x), top - 5.0);
            let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{}</text>", escape(label));
        }
    }
    out.push_str("</g>");
    let along = escape(&chart.x.text(frame.x_ticks.left_out.clone()));
    let (x, y) = (0.5 * (left + right), bottom + 35.0);
    let _ = write!(out, "<text class=\"axis\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{along}</text>");
    let up = escape(&chart.y.text(frame.y_ticks.left_out.clone()));
    let y = 0.5 * (top + bottom);
    let _ = write!(
        out,
        "<text class=\"axis\" transform=\"translate(14 {y:.1}) rotate(-90)\" text-anchor=\"middle\">{up}</text>"
    );
}

/// The chart for the script: axes, and series with `about shown.points` points each.
fn data(chart: &Chart, frame: &Frame, shown: Shown) -> String {
    // places on an axis: values, or their decimal logarithms
    let place = |along_x: bool, v: f64| {
        let axis = if along_x { &chart.x } else { &chart.y };
        if axis.is_logarithmic() { v.log10() } else { v }
    };
    let mut series = Vec::new();
    for Series { name, mark } in &chart.series {
        if matches!(mark, Mark::AtX { x: v, .. } | Mark::AtY { y: v, .. } if v.is_nan()) {
            continue;
        }
        let mut head = json!({ "name": name });
        let (kind, color, columns) = match mark {
            Mark::Line { stroke, .. } => ("line", stroke.color, true),
            Mark::Dots { color, .. } => ("dots", *color, true),
            Mark::Band { color, .. } => ("band", *color, true),
            Mark::Bars { stroke, .. } => ("bars", stroke.color, true),
            Mark::AtX { stroke, .. } => ("at_x", stroke.color, false),
            Mark::AtY { stroke, .. } => ("at_y", stroke.color, false),
            Mark::SpanX { color, .. } => ("span_x", *color, false),
        };
        head["kind"] = kind.into();
        head["ink"] = json!(ink::pair(color));
        match mark {
            Mark::Line { stroke, .. } | Mark::Bars { stroke, .. } => {
                head["width"] = stroke.width.into();
                head["dash"] = json!(stroke.dash);
            }
            Mark::Dots { radius, .. } => head["width"] = (2.0 * radius).into(),
            Mark::Band { alpha, .. } => head["alpha"] = (*alpha).into(),
            Mark::AtX { x, stroke, label } => {
                head["at"] = json!(place(true, *x));
                head["width"] = stroke.width.into();
                head["dash"] = json!(stroke.dash);
                head["label"] = json!(label);
            }
            Mark::AtY { y, stroke } => {
                head["at"] = json!(place(false, *y));
                head["width"] = stroke.width.into();
                head["dash"] = json!(stroke.dash);
            }
            Mark::SpanX { from, to, alpha, .. } => {
                // an infinite end is null: to the edge
                head["from"] = json!(place(true, *from));
                head["to"] = json!(place(true, *to));
                head["alpha"] = (*alpha).into();
            }
        }
        let mut text = head.to_string();
        if let Some(Columns(all)) = columns.then(|| points::reduced(mark, shown.points)).flatten() {
            text.pop();
            for (i, (name, values)) in ["x", "y", "high"].into_iter().zip(&all).enumerate() {
                let places: Vec<f64> = values.iter().map(|v| place(i == 0, *v)).collect();
                let _ = write!(text, ",\"{name}\":{}", points::list(&places));
            }
            text.push('}');
        }
        series.push(text);
    }
    let axis = |axis: &crate::report::plot::Axis, scale: Scale| {
        json!({ "label": axis.label, "unit": axis.unit, "log": axis.is_logarithmic(), "ends": scale.ends() })
            .to_string()
    };
    format!(
        "{{\"x\":{},\"y\":{},\"equal\":{},\"height\":{},\"series\":[{}]}}",
        axis(&chart.x, frame.x),
        axis(&chart.y, frame.y),
        chart.equal,
        shown.height,
        series.join(",")
    )
}
