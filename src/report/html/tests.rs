//! Pages: nothing of a user's text is markup, all elements are closed, nothing is fetched, every figure has data, and a page of a
//! long log is no larger than allowed.

use super::document::{Document, MOST_BYTES, Origin, Table, Tone};
use super::fit_page;
use crate::bias::WarmUp;
use crate::identify::{self, FitOptions};
use crate::report::plot::{Axis, BarChart, Chart, HeatMap, Panel, palette};
use crate::report::{FitReport, LogFacts};
use crate::signal::TimeAxis;
use crate::units::RateUnit;
use crate::validate;

const EVIL: &str = "<script>alert('a & b')</script>.csv";

fn origin() -> Origin {
    Origin { command: format!("gyroid fit {EVIL}"), files: vec![(EVIL.into(), "0123abcd".into())] }
}

/// Elements that have no end.
const VOID: [&str; 3] = ["meta", "br", "!doctype"];

/// Panics unless every element of the page ends where it should, and nothing is loaded from elsewhere.
#[track_caller]
fn check(page: &str) {
    let mut open: Vec<String> = Vec::new();
    let mut rest = page;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        // text of these elements is no markup
        if let Some(inside) = open.last().filter(|name| *name == "script" || *name == "style").cloned()
            && !rest.starts_with(&format!("/{inside}"))
        {
            continue;
        }
        let end = rest.find('>').unwrap_or_else(|| panic!("a tag is not closed: {}", &rest[..rest.len().min(80)]));
        let tag = &rest[..end];
        assert!(tag.matches('"').count().is_multiple_of(2), "quotes of <{tag}>");
        let name: String =
            tag.trim_start_matches('/').chars().take_while(|c| !c.is_whitespace() && *c != '/').collect();
        let name = name.to_lowercase();
        if tag.starts_with('/') {
            assert_eq!(open.pop().as_deref(), Some(name.as_str()), "</{name}> ends another element");
        } else if !tag.ends_with('/') && !VOID.contains(&name.as_str()) {
            open.push(name);
        }
        for fetched in ["src=", "href=", "srcset=", "@import"] {
            assert!(!tag.contains(fetched), "<{tag}> loads something");
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "not closed: {open:?}");
    assert!(!page.contains("url(http") && !page.contains("@import"));
    assert!(page.len() <= MOST_BYTES, "{} bytes", page.len());
}

/// The data of each chart.
fn charts(page: &str) -> Vec<serde_json::Value> {
    let begin = "<script type=\"application/json\">";
    let all = page.split(begin).skip(1);
    all.map(|part| serde_json::from_str(&part[..part.find("</script>").unwrap()]).unwrap()).collect()
}

fn panels() -> Vec<Panel> {
    let wave = |i: i32| [f64::from(i) * 0.1, (f64::from(i) * 0.1).sin()];
    let chart = Chart::new(Axis::linear(EVIL, "s"), Axis::linear("y", ""))
        .title(EVIL)
        .band(EVIL, (0..40).map(|i| [wave(i)[0], wave(i)[1] - 0.1, wave(i)[1] + 0.1]), palette::SKY, 0.4)
        .line(EVIL, (0..40).map(wave).chain([[f64::NAN; 2], [9.0, 0.0]]), palette::BLUE.stroke(2.0).dashed())
        .dots("dots", (0..40).map(wave), palette::VERMILION, 2.0)
        .bars("bars", [[1.0, 0.0, 0.5]], palette::GREY.stroke(2.0))
        .at_x("T", 2.0, palette::BLACK.stroke(1.0), EVIL)
        .at_x("", f64::NAN, palette::BLACK.stroke(1.0), "")
        .at_y("zero", 0.0, palette::BLACK.stroke(1.0))
        .span_x("", [f64::NEG_INFINITY, 1.0], palette::ORANGE, 0.2);
    let log = Chart::new(Axis::log("τ", "s"), Axis::log("σ", "rad/s")).line(
        "σ",
        [[0.1, 1e-3], [10.0, 1e-5]],
        palette::BLUE.stroke(1.0),
    );
    let map = Chart::new(Axis::linear("x", "m"), Axis::linear("y", "m")).equal_axes().line(
        "path",
        (0..500).map(|i| (f64::from(i) * 0.1).sin_cos()).map(|(x, y)| [x, 2.0 * y]),
        palette::BLUE.stroke(1.0),
    );
    let stack = Panel::Stack { title: EVIL.into(), label: EVIL.into(), charts: vec![chart.clone(), log] };
    let heat =
        HeatMap::new([EVIL, "b"], ["c", EVIL], vec![1.0, -2.0, f64::NAN, 0.0]).unwrap().labels(EVIL, EVIL).title(EVIL);
    let bar = crate::report::plot::bars::Bar { length: 0.5, text: EVIL.into(), color: palette::BLUE };
    let bars = BarChart::new(EVIL).legend(EVIL, palette::BLUE).row(EVIL, [bar]);
    vec![
        chart.into(),
        map.into(),
        stack,
        heat.into(),
        bars.into(),
        Panel::Notice { title: EVIL.into(), text: EVIL.into() },
    ]
}

#[test]
fn no_text_of_a_user_is_markup_and_every_figure_has_data() {
    let mut page = Document::new(EVIL, Tone::Bad, &format!("{EVIL}: {EVIL}"), EVIL);
    page.section(EVIL);
    page.paragraph(EVIL);
    page.list([EVIL]);
    page.numbers([[EVIL, EVIL, EVIL]]);
    let mut table = Table::new([EVIL]);
    table.row([EVIL]);
    page.table(&table);
    page.folded_table(EVIL, &table);
    page.folded(EVIL, EVIL);
    panels().into_iter().for_each(|panel| page.figure(panel, EVIL));
    let page = page.finish(&origin()).unwrap();
    check(&page);
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert"));
    // two charts by themselves and two in the stack
    let charts = charts(&page);
    assert_eq!(charts.len(), 4);
    for chart in &charts {
        let drawn =
            chart["series"].as_array().unwrap().iter().filter(|s| s["x"].as_array().is_some_and(|x| !x.is_empty()));
        assert!(drawn.count() > 0, "{chart}");
    }
    assert_eq!(page.matches("<figure>").count(), panels().len());
    assert_eq!(page.matches("<figcaption>").count(), panels().len());
    // without the script each chart has its lines, and words for who cannot see it
    let (pictures, words) = (page.matches("<svg viewBox").count(), page.matches("<desc ").count());
    assert!(pictures == 5 && words == 5, "{pictures} pictures, {words} descriptions");
    assert!(page.contains("class=\"mark line\"") && page.contains("SHA-256 <code>0123abcd</code>"));
}

#[test]
fn a_page_is_known_as_one_s_own() {
    let page = Document::new("t", Tone::Open, "V: v", "of").finish(&Origin::default()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let [own, foreign] = ["own.html", "foreign.html"].map(|name| dir.path().join(name));
    std::fs::write(&own, page).unwrap();
    std::fs::write(&foreign, "<!DOCTYPE html><html><title>mine</title></html>").unwrap();
    assert!(crate::files::mark::is_own(&own) && !crate::files::mark::is_own(&foreign));
}

#[test]
fn logarithmic_axes_tell_the_script_decimal_logarithms() {
    let chart = Chart::new(Axis::log("τ", "s"), Axis::log("σ", "")).line(
        "σ",
        [[0.1, 1e-3], [10.0, 1e-5]],
        palette::BLUE.stroke(1.0),
    );
    let mut page = Document::new("t", Tone::Open, "V: v", "of");
    page.figure(chart.into(), "level.");
    let all = charts(&page.finish(&Origin::default()).unwrap());
    let series = &all[0]["series"][0];
    assert_eq!((series["x"].to_string(), series["y"].to_string()), ("[-1,1]".into(), "[-3,-5]".into()));
    assert_eq!(all[0]["x"]["log"], true);
}

#[test]
fn the_page_of_a_long_log_is_small_and_keeps_its_extremes() {
    let time = TimeAxis::Uniform { start_s: 0.0, step_s: 0.01, len: 600_000 };
    let model = WarmUp { c1_rad_s: 2e-3, c2_rad_s: -5e-3, time_constant_s: 600.0 };
    let mut draw = crate::math::random::Stream::new(7, 0);
    let mut rate: Vec<f64> = (0..time.len()).map(|i| model.error_rad_s(time.at(i)) + 4e-4 * draw.normal()).collect();
    rate[123_456] = 0.05;
    let fit = identify::fit(&time, &rate, &FitOptions::default()).unwrap();
    let residuals = fit.residuals(&time, &rate);
    let options = validate::Options { draws: 19, ..validate::Options::default() };
    let validation = validate::whiteness(&time, &residuals, &fit.jacobian(&time), &options);
    let facts = LogFacts {
        name: EVIL.into(),
        column: "gyro_z".into(),
        unit: RateUnit::RadPerS,
        sha256: String::new(),
        temperature_c: None,
        notes: vec![EVIL.into()],
        audit: serde_json::Value::Null,
    };
    let page = fit_page(&FitReport::new(facts, fit, validation), &time, &rate, &residuals, &origin()).unwrap();
    check(&page);
    let all = charts(&page);
    assert!(all.len() >= 6, "{}", all.len());
    let highs = all[0]["series"][0]["high"].as_array().unwrap();
    let highest = highs.iter().filter_map(serde_json::Value::as_f64).fold(f64::NEG_INFINITY, f64::max);
    assert!((highest - 50.0).abs() < 1e-3, "{highest} mrad/s");
    assert!(highs.len() >= 3000, "{}", highs.len());
}

#[test]
fn a_page_with_too_much_in_it_has_fewer_points() {
    let mut page = Document::new("t", Tone::Open, "V: v", "of");
    for i in 0..60 {
        let line = (0..20_000).map(|k| [f64::from(k), (f64::from(k) * 0.3 + f64::from(i)).sin()]);
        page.figure(
            Chart::new(Axis::linear("x", ""), Axis::linear("y", "")).line("y", line, palette::BLUE.stroke(1.0)).into(),
            "g.",
        );
    }
    let page = page.finish(&Origin::default()).unwrap();
    check(&page);
    assert_eq!(charts(&page).len(), 60);
}

#[test]
fn the_script_is_small_and_fetches_nothing() {
    let script = include_str!("page.js");
    assert!(script.len() <= 15_000, "{} bytes", script.len());
    for word in ["fetch(", "XMLHttpRequest", "import ", "eval(", "innerHTML"] {
        assert!(!script.contains(word), "{word}");
    }
}
