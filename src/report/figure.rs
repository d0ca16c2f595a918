//! The figure of a fit, for a picture and for a page.

use super::fit::FitReport;
use super::plot::Picture;
use super::plot::fit::{CurvePoint, FitFigure, WhitenessLevel};
use crate::error::Result;
use crate::math::NORMAL_975;
use crate::signal::TimeAxis;

/// Points of the fitted curve.
const CURVE: usize = 400;

/// Draws log and model with its band, residuals, their autocorrelation and cumulative periodogram.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if lengths differ or nothing is finite.
pub(crate) fn fit_picture(
    report: &FitReport,
    time: &TimeAxis,
    rate_rad_s: &[f64],
    residual_rad_s: &[f64],
) -> Result<Picture> {
    of_fit(report, time, rate_rad_s, residual_rad_s, |figure| figure.draw())
}

/// `then` of the figure.
pub(super) fn of_fit<T>(
    report: &FitReport,
    time: &TimeAxis,
    rate_rad_s: &[f64],
    residual_rad_s: &[f64],
    then: impl FnOnce(&FitFigure) -> Result<T>,
) -> Result<T> {
    let fit = &report.fit;
    let model = fit.model();
    let by_time = |i: usize| {
        let t_s = fit.first_s + fit.span_s * i as f64 / CURVE as f64;
        let fit_rad_s = model.error_rad_s(t_s);
        let half = NORMAL_975 * fit.model_std_rad_s(t_s);
        CurvePoint { t_s, fit_rad_s, low_rad_s: fit_rad_s - half, high_rad_s: fit_rad_s + half }
    };
    // what the temperature made of the model at each sample is what the residuals lack
    let points = CURVE.min(time.len().saturating_sub(1));
    let by_temperature = |i: usize| {
        let k = i * (time.len() - 1) / points.max(1);
        let fit_rad_s = rate_rad_s.get(k).zip(residual_rad_s.get(k)).map_or(f64::NAN, |(y, r)| y - r);
        CurvePoint { t_s: time.at(k), fit_rad_s, low_rad_s: f64::NAN, high_rad_s: f64::NAN }
    };
    let thermal = report.thermal();
    let curve: Vec<CurvePoint> = match thermal {
        Some(_) if !time.is_empty() => (0..=points).map(by_temperature).collect(),
        _ => (0..=CURVE).map(by_time).collect(),
    };
    let (time_constant_s, time_constant_ci95_s) = match thermal {
        Some(_) => (f64::NAN, [f64::NAN; 2]),
        None => (fit.time_constant_s.estimate, fit.time_constant_s.ci95),
    };
    let levels: Vec<WhitenessLevel> = report.validation.levels.iter().map(WhitenessLevel::from).collect();
    let title = format!("{}, {}", report.log.name, report.log.column);
    then(&FitFigure {
        title: &title,
        verdict: &report.verdict_line(),
        time,
        rate_rad_s,
        residual_rad_s,
        curve: &curve,
        time_constant_s,
        time_constant_ci95_s,
        levels: &levels,
        unit: None,
    })
}
