use super::drive::{Dimension, DriveFigure, ErrorFigure, ErrorRow, ErrorSeries, Track, TrackFigure};
use super::fit::{CurvePoint, FitFigure, WhitenessLevel};
use super::geometry::Rect;
use super::scene::{Align, Scene, Shape, Text};
use super::{Axis, Chart, Format, HeatMap, Page, Panel, Picture, font, palette};
use crate::bias::WarmUp;
use crate::error::{ErrorKind, Result};
use crate::files::OutputFile;
use crate::math::random::Stream;
use crate::signal::TimeAxis;
use proptest::prelude::*;

/// A log of `len` samples with white noise about a warm-up.
fn fit_picture(len: usize, rate_hz: f64, model: WarmUp, noise_rad_s: f64) -> Result<Picture> {
    let mut stream = Stream::new(len as u64, 0);
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: 1.0 / rate_hz, len };
    let residual: Vec<f64> = (0..len).map(|_| noise_rad_s * stream.normal()).collect();
    let rate: Vec<f64> = (0..len).map(|i| model.error_rad_s(time.at(i)) + residual[i]).collect();
    let curve: Vec<CurvePoint> = (0..=100)
        .map(|i| {
            let t_s = time.span_s() * f64::from(i) / 100.0;
            let fit = model.error_rad_s(t_s);
            CurvePoint { t_s, fit_rad_s: fit, low_rad_s: fit - noise_rad_s, high_rad_s: fit + noise_rad_s }
        })
        .collect();
    let autocorrelation: Vec<f64> = (0..=40).map(|k| if k == 0 { 1.0 } else { 0.01 * stream.normal() }).collect();
    let cumulative: Vec<f64> = (1..=200).map(|j| f64::from(j) / 200.0).collect();
    let level = |averaging_time_s: f64| WhitenessLevel {
        averaging_time_s,
        blocks: (time.span_s() / averaging_time_s) as usize,
        autocorrelation: &autocorrelation,
        bound: 0.02,
        cumulative_periodogram: &cumulative,
        ks_band: 0.1,
        p_value: 0.3,
    };
    FitFigure {
        title: "log.csv, axis z",
        verdict: "White & identifiable: T < the log's length.",
        time: &time,
        rate_rad_s: &rate,
        residual_rad_s: &residual,
        curve: &curve,
        time_constant_s: model.time_constant_s,
        time_constant_ci95_s: [0.9 * model.time_constant_s, f64::INFINITY],
        levels: &[level(1.0 / rate_hz), level(10.0 / rate_hz), level(100.0 / rate_hz)],
        unit: None,
    }
    .draw()
}

fn warm_up() -> WarmUp {
    WarmUp { c1_rad_s: 2e-3, c2_rad_s: -4e-3, time_constant_s: 600.0 }
}

fn texts(picture: &Picture) -> impl Iterator<Item = &Text> {
    picture.scene.shapes.iter().filter_map(|s| if let Shape::Text(t) = s { Some(t) } else { None })
}

/// The place of the letters, from the base line to the height of capitals.
fn extent(text: &Text) -> Rect {
    let width = font::width_em(&text.text).unwrap() * text.size;
    let height = 0.73 * text.size;
    let (x, y) = text.at;
    let start = match text.align {
        Align::Start => 0.0,
        Align::Middle => -0.5 * width,
        Align::End => -width,
    };
    if text.upright {
        Rect { left: x - height, right: x, top: y - start - width, bottom: y - start }
    } else {
        Rect { left: x + start, right: x + start + width, top: y - height, bottom: y }
    }
}

/// Every text is on the page, and none covers another.
pub(super) fn check_texts(picture: &Picture) -> std::result::Result<(), String> {
    let (width, height) = picture.size();
    let all: Vec<(&Text, Rect)> = texts(picture).map(|t| (t, extent(t))).collect();
    for (i, (text, place)) in all.iter().enumerate() {
        let inside = place.left >= 0.0
            && place.top >= 0.0
            && place.right <= f64::from(width)
            && place.bottom <= f64::from(height);
        if !inside {
            return Err(format!("{:?} leaves the page: {place:?}", text.text));
        }
        for (other, second) in &all[..i] {
            let apart = place.right <= second.left
                || second.right <= place.left
                || place.bottom <= second.top
                || second.bottom <= place.top;
            if !apart {
                return Err(format!("{:?} covers {:?}", text.text, other.text));
            }
        }
    }
    Ok(())
}

/// Tags are balanced, attributes quoted, entities known. Returns all text.
pub(super) fn check_xml(xml: &str) -> String {
    let (mut open, mut said, mut rest) = (Vec::new(), String::new(), xml);
    while let Some(begin) = rest.find('<') {
        let text = &rest[..begin];
        assert!(!text.contains('>'), "{text:?}");
        for (at, _) in text.match_indices('&') {
            let known = ["&amp;", "&lt;", "&gt;", "&quot;", "&apos;"];
            assert!(known.iter().any(|e| text[at..].starts_with(e)), "{text:?}");
        }
        said += text;
        let end = begin + rest[begin..].find('>').expect("an end of the tag");
        let tag = &rest[begin + 1..end];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name.to_string()));
        } else {
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            if !tag.ends_with('/') {
                open.push(tag.split(' ').next().unwrap_or_default().to_string());
            }
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty() && rest.trim().is_empty());
    said
}

#[test]
fn the_page_of_a_fit_says_what_its_axes_are() {
    let svg = fit_picture(5600, 1.0, warm_up(), 4e-4).unwrap().svg().unwrap();
    let said = check_xml(&svg);
    for words in [
        "log.csv, axis z",
        "White &amp; identifiable: T &lt; the log&apos;s length.",
        "Rate (mrad/s)",
        "Time (min)",
        "T = 10 min (95 %: 9 min to ∞)",
        "means over 100 s (µrad/s)",
        "Lag (samples or means)",
        "Frequency / Nyquist frequency",
        "samples: p = 0.3",
    ] {
        assert!(said.contains(words), "{words:?} is missing");
    }
    assert!(svg.starts_with("<svg width=\"1600\" height=\"1200\""));
}

#[test]
fn a_png_has_the_size_of_its_page_and_ink_in_every_panel() {
    let bytes = fit_picture(5600, 1.0, warm_up(), 4e-4).unwrap().png().unwrap();
    let mut reader = png::Decoder::new(bytes.as_slice()).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (1600, 1200));
    for (x0, y0) in [(0, 0), (800, 0), (0, 600), (800, 600)] {
        let dark = (y0..y0 + 600).flat_map(|y| (x0..x0 + 800).map(move |x| 3 * (1600 * y + x)));
        let inked = dark.filter(|i| pixels[*i..*i + 3].iter().any(|v| *v < 0xC0)).count();
        assert!((2000..240_000).contains(&inked), "{inked} pixels of ink at {x0}, {y0}");
    }
}

#[test]
fn a_million_samples_of_noise_make_a_small_file() {
    let picture = fit_picture(1_000_000, 100.0, warm_up(), 4e-3).unwrap();
    for (name, size) in [("SVG", picture.svg().unwrap().len()), ("PNG", picture.png().unwrap().len())] {
        assert!(size < 300_000, "{name}: {size} bytes");
    }
}

#[test]
fn texts_keep_clear_of_each_other_whatever_the_log() {
    let model = |c1_rad_s, c2_rad_s, time_constant_s| WarmUp { c1_rad_s, c2_rad_s, time_constant_s };
    for (len, rate_hz, model, noise) in [
        (5600, 1.0, warm_up(), 4e-4),
        (100_000, 100.0, warm_up(), 4e-3),
        (1000, 10.0, model(0.0, 0.0125, 100.0), 0.0),
        (1000, 10.0, model(0.0, 0.0, 100.0), 0.0),
        (1000, 10.0, model(1e-13, 0.1, 50.0), 1e-14),
        (1000, 10.0, model(1e-9, 0.1, 50.0), 1e-10),
        (2000, 1e-3, model(3e22, -1e22, 1e6), 2e21),
        (300, 2.0, model(-5.0, -100.0, 40.0), 0.5),
        (3, 0.01, warm_up(), 4e-4),
        (2, 1.0, warm_up(), 0.0),
        (1, 1.0, warm_up(), 1.0),
    ] {
        let picture = fit_picture(len, rate_hz, model, noise).unwrap();
        check_texts(&picture).unwrap_or_else(|e| panic!("{len} samples at {rate_hz} Hz, {model:?}: {e}"));
    }
}

#[test]
fn warm_up_is_seen_under_large_noise() {
    // noise a hundred times the warm-up: the fitted curve still takes a third of the panel's height
    let picture = fit_picture(1_000_000, 100.0, warm_up(), 0.2).unwrap();
    let curve = picture.scene.shapes.iter().find_map(|s| match s {
        Shape::Path { points, color, width } if *color == palette::VERMILION && *width > 2.0 => Some(points),
        _ => None,
    });
    let ys = || curve.unwrap().iter().map(|p| p.1);
    let height = ys().fold(f64::MIN, f64::max) - ys().fold(f64::MAX, f64::min);
    assert!(height > 30.0, "{height} pixels");
}

#[test]
fn pictures_are_written_whole_or_not_at_all() {
    let directory = tempfile::tempdir().unwrap();
    let picture = fit_picture(50, 1.0, warm_up(), 4e-4).unwrap();
    for name in ["a.svg", "a.PNG"] {
        let path = directory.path().join(name);
        picture.write(OutputFile::claim(&path).unwrap()).unwrap();
        assert!(std::fs::metadata(&path).unwrap().len() > 1000);
    }
    let bad = directory.path().join("a.pdf");
    let error = picture.write(OutputFile::claim(&bad).unwrap()).unwrap_err();
    assert!(error.kind == ErrorKind::Usage && error.to_string().contains(".svg or .png"), "{error}");
    assert!(!bad.exists());
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
    assert_eq!(Format::of("x.Svg").unwrap(), Format::Svg);
    assert!(Format::of("png").is_err());
}

#[test]
fn titles_from_elsewhere_cannot_break_the_file() {
    let chart = Chart::new(Axis::linear("<&>", "\""), Axis::linear("y", "")).line(
        "\u{0}\u{1b}]'",
        [[0.0, 0.0], [1.0, 1.0]],
        palette::BLUE.stroke(1.0),
    );
    let title = "<svg onload=\"x\"> & \u{0} 文字 ".repeat(50);
    let picture = Page::new(title).row([chart.into()]).draw().unwrap();
    check_texts(&picture).unwrap();
    let said = check_xml(&picture.svg().unwrap());
    assert!(!said.contains('\u{0}') && said.contains('…'));
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: 1.0, len: 3 };
    let figure = FitFigure {
        title: "",
        verdict: "",
        time: &time,
        rate_rad_s: &[1.0, f64::INFINITY, 2.0],
        residual_rad_s: &[0.0; 3],
        curve: &[],
        time_constant_s: 1.0,
        time_constant_ci95_s: [f64::NAN; 2],
        levels: &[],
        unit: None,
    };
    let said = |figure: FitFigure| figure.draw().unwrap_err().to_string();
    assert!(said(figure).contains("rate, sample 1"));
    assert!(said(FitFigure { rate_rad_s: &[f64::NAN; 3], ..figure }).contains("rate: none of 3 samples"));
    assert!(said(FitFigure { rate_rad_s: &[], ..figure }).contains("0 values on 3 times"));
    assert!(said(FitFigure { rate_rad_s: &[1.0; 3], time_constant_s: 0.0, ..figure }).contains("time constant"));
    let empty = TimeAxis::Explicit(vec![]);
    let nothing = FitFigure { time: &empty, rate_rad_s: &[], residual_rad_s: &[], ..figure };
    assert!(said(nothing).contains("none of 0 samples"));
    let track = Track { name: "filter", x_m: &[0.0, 1.0], y_m: &[0.0] };
    let figure = TrackFigure { title: "", subtitle: "", reference: None, tracks: &[track] };
    assert!(figure.draw().unwrap_err().to_string().contains("filter"));
    assert!(HeatMap::new(["a"], ["b", "c"], vec![1.0]).unwrap_err().to_string().contains("1 values for 1 rows"));
    assert!(HeatMap::new(["a"], ["b"], vec![f64::INFINITY]).unwrap_err().to_string().contains("row \"a\""));
    let error = Page::new("").size(10, 10).draw().unwrap_err().to_string();
    assert!(error.contains("10 pixels"), "{error}");
}

#[test]
fn a_unit_is_as_long_along_x_as_along_y_on_a_map() {
    let (x, y): (Vec<f64>, Vec<f64>) =
        (0..400).map(|i| f64::from(i) * std::f64::consts::TAU / 399.0).map(|a| (3.0 * a.cos(), 3.0 * a.sin())).unzip();
    let track = Track { name: "circle", x_m: &x, y_m: &y };
    let picture = TrackFigure { title: "map", subtitle: "", reference: Some(track), tracks: &[] }.draw().unwrap();
    let circle = picture.scene.shapes.iter().find_map(|s| match s {
        Shape::Path { points, width, .. } if *width > 5.0 && points.len() > 100 => Some(points),
        _ => None,
    });
    let size = |axis: fn(&(f64, f64)) -> f64| {
        let all = || circle.unwrap().iter().map(axis);
        all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
    };
    let (width, height) = (size(|p| p.0), size(|p| p.1));
    assert!(width > 300.0 && (width / height - 1.0).abs() < 0.01, "{width} by {height}");
}

#[test]
fn text_in_pixels_lies_where_the_layout_expects_it() {
    for upright in [false, true] {
        for align in [Align::Start, Align::Middle, Align::End] {
            let mut scene = Scene::new(400, 400);
            match upright {
                true => scene.upright_text((200.0, 200.0), "HHH", 40.0, palette::BLACK),
                false => scene.text((200.0, 200.0), "HHH", 40.0, palette::BLACK, align),
            }
            let Shape::Text(text) = &scene.shapes[0] else { unreachable!() };
            let expected = extent(text);
            let rgb = scene.rgb().unwrap();
            let dark = (0..400 * 400).filter(|i| rgb[3 * i] < 0x80).map(|i| ((i % 400) as f64, (i / 400) as f64));
            let found = dark.fold([f64::MAX, f64::MIN, f64::MAX, f64::MIN], |[l, r, t, b], (x, y)| {
                [l.min(x), r.max(x), t.min(y), b.max(y)]
            });
            let wanted = [expected.left, expected.right, expected.top, expected.bottom];
            // the letter H leaves a tenth of an em on either side
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted).abs() < 5.5, "{found} for {wanted}: {text:?}");
            }
        }
    }
}

/// Numbers as they come out of broken logs: mostly drawable, or no figure would ever be drawn.
fn any_number() -> impl Strategy<Value = f64> {
    let odd = prop::sample::select(vec![f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 1e-310]);
    prop_oneof![
        60 => -1.0..1.0_f64,
        20 => -1e12..1e12_f64,
        8 => prop::sample::select(vec![f64::NAN, 0.0, -0.0, 1.0, 1e99, -1e99]),
        1 => odd,
    ]
}

/// Drawn with all texts in their places, or refused for a value.
fn drawn_or_refused(result: Result<Picture>) -> std::result::Result<(), TestCaseError> {
    match result {
        Ok(picture) => {
            check_texts(&picture).map_err(TestCaseError::fail)?;
            check_xml(&picture.svg().map_err(|e| TestCaseError::fail(e.to_string()))?);
        }
        Err(error) => prop_assert_eq!(error.kind, ErrorKind::Value, "{}", error),
    }
    Ok(())
}

proptest! {
    #[test]
    fn no_log_makes_the_page_of_a_fit_panic(
        explicit in proptest::option::of(proptest::collection::vec(any_number(), 0..30)),
        values in proptest::collection::vec(any_number(), 0..30),
        step_s in any_number(),
        time_constant_s in any_number(),
        ci in [any_number(), any_number()],
        whiteness in proptest::collection::vec(any_number(), 0..30),
        bounds in (0.001..1.0_f64, any_number(), any_number()),
    ) {
        let time = match explicit {
            Some(times) => TimeAxis::Explicit(times),
            None => TimeAxis::Uniform { start_s: 0.0, step_s, len: values.len() },
        };
        let curve: Vec<CurvePoint> = values
            .iter()
            .enumerate()
            .map(|(i, v)| CurvePoint { t_s: i as f64, fit_rad_s: *v, low_rad_s: v - 1.0, high_rad_s: v + 1.0 })
            .collect();
        let level = WhitenessLevel {
            averaging_time_s: bounds.1.abs(),
            blocks: values.len(),
            autocorrelation: &whiteness,
            bound: bounds.0,
            cumulative_periodogram: &whiteness,
            ks_band: bounds.2,
            p_value: bounds.1,
        };
        let figure = FitFigure {
            title: "log",
            verdict: "none",
            time: &time,
            rate_rad_s: &values,
            residual_rad_s: &values,
            curve: &curve,
            time_constant_s,
            time_constant_ci95_s: ci,
            levels: &[level],
            unit: None,
        };
        drawn_or_refused(figure.draw())?;
    }

    #[test]
    fn finite_values_are_always_drawn(
        values in proptest::collection::vec(-1.0..1.0_f64, 1..600),
        order in -30..30,
        offset in -1e3..1e3_f64,
        step in -6..6,
        missing in 0..5usize,
    ) {
        let scale = 10f64.powi(order);
        let mut values: Vec<f64> = values.iter().map(|v| (v + offset) * scale).collect();
        let kept = values.len() - 1;
        values.iter_mut().take(kept).skip(3).step_by(7).take(missing * 10).for_each(|v| *v = f64::NAN);
        let time = TimeAxis::Uniform { start_s: -3.0, step_s: 10f64.powi(step), len: values.len() };
        let figure = FitFigure {
            title: "log",
            verdict: "none",
            time: &time,
            rate_rad_s: &values,
            residual_rad_s: &values,
            curve: &[],
            time_constant_s: 600.0,
            time_constant_ci95_s: [0.0, f64::INFINITY],
            levels: &[],
            unit: None,
        };
        let picture = figure.draw().map_err(|e| TestCaseError::fail(e.to_string()))?;
        check_texts(&picture).map_err(TestCaseError::fail)?;
    }

    #[test]
    fn no_drive_makes_its_figures_panic(
        a in proptest::collection::vec(any_number(), 0..20),
        b in proptest::collection::vec(any_number(), 0..20),
    ) {
        let tracks = [Track { name: "a", x_m: &a, y_m: &b }, Track { name: "b", x_m: &b, y_m: &b }];
        let map = TrackFigure { title: "drive", subtitle: "", reference: Some(tracks[0]), tracks: &tracks[1..] };
        drawn_or_refused(map.draw())?;
        let series = [ErrorSeries { name: "filter", error: &b, std: Some(&a) }];
        let rows = [ErrorRow { label: "Heading error", dimension: Dimension::Angle, series: &series }; 2];
        let errors = ErrorFigure { title: "drive", subtitle: "", time_s: &a, rows: &rows };
        drawn_or_refused(errors.draw())?;
        drawn_or_refused(DriveFigure { tracks: map, errors: Some(errors) }.draw())?;
    }

    #[test]
    fn no_chart_panics(
        points in proptest::collection::vec([any_number(), any_number(), any_number()], 0..20),
        log in any::<[bool; 2]>(),
        equal in any::<bool>(),
        limits in proptest::option::of([any_number(), any_number()]),
        size in [150..700u32, 150..700u32],
    ) {
        let axis = |log| if log { Axis::log("Quantity", "m") } else { Axis::linear("Quantity", "m") };
        let x = match limits {
            Some([low, high]) => axis(log[0]).limits(low, high),
            None => axis(log[0]),
        };
        let flat = || points.iter().map(|p| [p[0], p[1]]);
        let stroke = palette::GREEN.stroke(2.0).dashed();
        let mut chart = Chart::new(x, axis(log[1]).include(1.0))
            .title("Chart")
            .line("line", flat(), stroke)
            .band("band", points.iter().copied(), palette::BLUE, 0.5)
            .bars("bars", points.iter().copied(), stroke)
            .dots("dots", flat(), palette::BLUE, 2.0);
        // a mark that is not a number must not hang the drawing of dashes
        chart = chart.at_y("", f64::NAN, stroke).at_x("", f64::NAN, stroke, "");
        if let Some(p) = points.first() {
            chart = chart.at_x("", p[0], stroke, "x").at_y("", p[1], stroke).span_x("", [p[1], p[2]], palette::GREY, 0.2);
        }
        let chart = if equal && log == [false; 2] { chart.equal_axes() } else { chart };
        let stack = Panel::Stack { title: "Stack".into(), label: "y".into(), charts: vec![chart.clone(), chart.clone()] };
        drawn_or_refused(Page::new("Page").size(size[0], size[1]).row([chart.into()]).draw())?;
        drawn_or_refused(Page::new("Page").size(size[0], 800).row([stack]).draw())?;
    }
}
