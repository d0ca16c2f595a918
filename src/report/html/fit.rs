//! The page of a fit.

use super::document::{Document, Origin, Table, Tone};
use crate::error::Result;
use crate::identify::{Estimate, Termination};
use crate::report::figure::of_fit;
use crate::report::fit::{FitReport, Verdict};
use crate::report::numbers::{known_digits, probability, significant};
use crate::report::temperature::temperature_text;
use crate::signal::TimeAxis;
use crate::units::{RAD_S_PER_DEG_S, duration_text};
use crate::validate::Validation;

/// Slices of the envelopes.
pub(super) const COLUMNS: usize = 2000;
/// Sentence on good residuals over time, in their autocorrelation and in their cumulative periodogram.
pub(super) const RESIDUALS: [&str; 3] = [
    "samples and means scatter about zero, 95 % of them within the dashed lines, and no slope or bend is left.",
    "at most one bar in twenty leaves the grey band, and none by much.",
    "every line stays inside the grey band.",
];

/// The page of `report`: `rate_rad_s` is what was recorded at `time`, s since power-on, `residual_rad_s` that less the model.
///
/// # Errors
/// [`crate::ErrorKind::Value`] if lengths differ or nothing is finite.
pub(crate) fn fit_page(
    report: &FitReport,
    time: &TimeAxis,
    rate_rad_s: &[f64],
    residual_rad_s: &[f64],
    origin: &Origin,
) -> Result<String> {
    let fit = &report.fit;
    let of = format!(
        "{}, column {}: {} samples at {} Hz, {} from {} after power-on",
        report.log.name,
        report.log.column,
        fit.samples,
        significant(fit.sample_rate_hz, 4),
        duration_text(fit.span_s),
        duration_text(fit.first_s),
    );
    let tone = if report.verdict() == Verdict::FitForUse { Tone::Good } else { Tone::Bad };
    let title = format!("Fit of {}", report.log.name);
    let mut page = Document::new(&title, tone, &report.verdict_line(), &of);
    let mut panels = of_fit(report, time, rate_rad_s, residual_rad_s, |f| f.page(COLUMNS))?.into_panels().into_iter();

    page.numbers(parameters(report));
    if let Some(log) = panels.next() {
        page.figure(log, "the fitted line runs through the means from end to end, and the log goes on well after T.");
    }
    page.section("What else is there");
    page.paragraph("e(t) = C1 (1 − exp(−t/T)) + C2, t since power-on");
    let mut table = Table::new(["parameter", "estimate", "std", "95 % interval", "unit"]);
    for (name, unit, e) in
        [("C1", "rad/s", &fit.c1_rad_s), ("C2", "rad/s", &fit.c2_rad_s), ("T", "s", &fit.time_constant_s)]
    {
        table.row([
            name.into(),
            known_digits(e.estimate, e.std),
            significant(e.std, 2),
            interval(e, unit),
            unit.into(),
        ]);
    }
    page.table(&table);
    page.list(lines(|out| report.noise_text(out)));
    if let Some(temperature) = &report.temperature {
        page.list(lines(|out| temperature_text(temperature, report.thermal().is_some(), out)));
    }

    page.section("What is left: the residuals");
    for (panel, good) in panels.zip(RESIDUALS) {
        page.figure(panel, good);
    }
    page.table(&whiteness(&report.validation));

    page.section("What cannot be told");
    let c = &fit.correlation;
    let correlations = format!(
        "C1, C2 and T are known together only: correlations C1,C2 {:.3}, C1,T {:.3}, C2,T {:.3}.",
        c[0][1], c[0][2], c[1][2]
    );
    page.list(lines(|out| {
        out.push_str(&correlations);
        out.push('\n');
        report.identifiability_text(out);
        report.weighting_text(out);
    }));
    if !report.log.notes.is_empty() {
        page.section("Notes on the log");
        page.list(&report.log.notes);
    }
    page.folded("The same as text", &report.text());
    page.finish(origin)
}

/// The three parameters, with their intervals.
fn parameters(report: &FitReport) -> Vec<[String; 3]> {
    let fit = &report.fit;
    let rate = |name: &str, e: &Estimate| {
        let other = known_digits(e.estimate / RAD_S_PER_DEG_S, e.std / RAD_S_PER_DEG_S);
        let value = format!("{} ± {} rad/s", known_digits(e.estimate, e.std), significant(e.std, 2));
        [name.to_string(), value, format!("{other} deg/s; 95 %: {}", interval(e, "rad/s"))]
    };
    let t = &fit.time_constant_s;
    let unknown = matches!(fit.termination, Termination::StraightLine | Termination::TooFast);
    let time = if unknown {
        "unknown".to_string()
    } else {
        format!("{} ± {} s", known_digits(t.estimate, t.std), significant(t.std, 2))
    };
    let beside = if unknown { "no minimum".to_string() } else { format!("95 %: {} s", interval(t, "s")) };
    let mut all = vec![
        rate("C2, bias at power-on", &fit.c2_rad_s),
        rate("C1, how far it warms up", &fit.c1_rad_s),
        ["T, time constant".into(), time, beside],
    ];
    if let Some(thermal) = report.thermal() {
        let s = &thermal.sensitivity_rad_s_k;
        let value = format!("{} ± {} rad/s/K", known_digits(s.estimate, s.std), significant(s.std, 2));
        all.insert(0, ["sensitivity to temperature".into(), value, "the model that is judged".into()]);
    }
    all
}

fn interval(e: &Estimate, unit: &str) -> String {
    if e.std > 0.0 {
        let [low, high] = e.ci95;
        let low = if unit == "s" && low <= 0.0 { "unbounded".into() } else { known_digits(low, e.std) };
        format!("{low} to {}", known_digits(high, e.std))
    } else {
        "given".into()
    }
}

/// Lines of a text for a terminal, as sentences of a list.
pub(super) fn lines(write: impl FnOnce(&mut String)) -> Vec<String> {
    let mut text = String::new();
    write(&mut text);
    text.lines().map(str::trim).filter(|l| !l.is_empty()).map(ToString::to_string).collect()
}

/// The tests of whiteness, a row an averaging time.
pub(super) fn whiteness(v: &Validation) -> Table {
    let mut table = Table::new([
        "averaged over",
        "blocks",
        "autocorrelation at lag 1",
        "p, lags outside",
        "p, Ljung-Box",
        "p, cumulative periodogram",
        "p, runs",
    ]);
    for l in &v.levels {
        let lag = l.whiteness.autocorrelation.get(1).copied().unwrap_or(f64::NAN);
        let head = [duration_text(l.averaging_time_s), l.whiteness.samples.to_string(), format!("{lag:.3}")];
        table.row(head.into_iter().chain(l.calibrated_p_values.map(probability)));
    }
    table
}
