//! The page of a model held against another log.

use super::document::{Document, Origin, Tone};
use super::fit::{COLUMNS, RESIDUALS, whiteness};
use crate::error::Result;
use crate::report::check::ModelCheck;
use crate::report::numbers::significant;
use crate::report::plot::fit::{CurvePoint, FitFigure, WhitenessLevel};
use crate::signal::TimeAxis;
use crate::units::RAD_S_PER_DEG_S;

/// Points of the model's curve.
const CURVE: usize = 400;

/// The page of `check`: `rate_rad_s` is what was recorded at `time`, s since power-on, `residual_rad_s` that less the model.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if lengths differ or nothing is finite.
pub(crate) fn validate_page(
    check: &ModelCheck,
    time: &TimeAxis,
    rate_rad_s: &[f64],
    residual_rad_s: &[f64],
    origin: &Origin,
) -> Result<String> {
    let tone = if check.passed() { Tone::Good } else { Tone::Bad };
    let of = format!("{}, column {}: {} samples, none of them fitted", check.log.name, check.log.column, check.samples);
    let verdict = check.verdict_line();
    let mut page = Document::new(&format!("Validation on {}", check.log.name), tone, &verdict, &of);
    let deg_s = |rad_s: f64| format!("{} deg/s", significant(rad_s / RAD_S_PER_DEG_S, 3));
    let expected = if check.turn_on_stated {
        format!("{:.1} standard deviations of what is expected", check.offset_in_std())
    } else {
        "how much it varies from one power-on to the next is not stated".into()
    };
    page.numbers([
        ["offset of this power-on".to_string(), format!("{} rad/s", significant(check.offset_rad_s, 3)), expected],
        [
            "residuals, a sample".into(),
            format!("{} rad/s", significant(check.residual_std_rad_s, 3)),
            format!("the configuration's noise gives {} rad/s", significant(check.expected_std_rad_s, 3)),
        ],
        ["offset in other units".into(), deg_s(check.offset_rad_s), String::new()],
    ]);
    let points = CURVE.min(time.len().saturating_sub(1)).max(1);
    let curve: Vec<CurvePoint> = (0..=points)
        .map(|i| i * time.len().saturating_sub(1) / points)
        .filter_map(|k| {
            let fit_rad_s = rate_rad_s.get(k)? - residual_rad_s.get(k)?;
            Some(CurvePoint { t_s: time.at(k), fit_rad_s, low_rad_s: f64::NAN, high_rad_s: f64::NAN })
        })
        .collect();
    let levels: Vec<WhitenessLevel> = check.validation.levels.iter().map(WhitenessLevel::from).collect();
    let figure = FitFigure {
        title: &check.log.name,
        verdict: &verdict,
        time,
        rate_rad_s,
        residual_rad_s,
        curve: &curve,
        time_constant_s: f64::NAN,
        time_constant_ci95_s: [f64::NAN; 2],
        levels: &levels,
        unit: None,
    };
    let mut panels = figure.page(COLUMNS)?.into_panels().into_iter();
    if let Some(log) = panels.next() {
        page.figure(
            log,
            "the model's line has the course of the means; a constant distance is the offset of this power-on.",
        );
    }
    page.section("What is left: the residuals");
    for (panel, good) in panels.zip(RESIDUALS) {
        page.figure(panel, good);
    }
    page.table(&whiteness(&check.validation));
    page.section("What cannot be told");
    page.list(check.remarks().into_iter().chain(check.log.notes.iter().cloned()));
    page.folded("The same as text", &check.text());
    page.finish(origin)
}
