//! The fit on one page: log and model, residuals, their autocorrelation and their cumulative periodogram.

use super::axis::range;
use super::envelope::{Slice, check_time, extremes, means, outline, slices};
use super::quantity::{Quantity, duration, rate, significant, time};
use super::{Axis, Chart, Page, Panel, Picture, bad, palette};
use crate::error::Result;
use crate::math::NORMAL_975;
use crate::math::whiteness::kolmogorov_band95;
use crate::signal::TimeAxis;
use crate::units::RateUnit;
use crate::validate::Level;

/// The fitted error at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurvePoint {
    /// Time, s.
    pub t_s: f64,
    /// Fitted error, rad/s.
    pub fit_rad_s: f64,
    /// Low end of its 95 % interval, rad/s; NaN where there is none.
    pub low_rad_s: f64,
    /// High end of its 95 % interval, rad/s; NaN where there is none.
    pub high_rad_s: f64,
}

/// How white the residuals are at one averaging time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WhitenessLevel<'a> {
    /// Averaging time, s.
    pub averaging_time_s: f64,
    /// Number of blocks.
    pub blocks: usize,
    /// Sample autocorrelation, from lag 0.
    pub autocorrelation: &'a [f64],
    /// 95 % of the autocorrelations of white noise are within ± this.
    pub bound: f64,
    /// Cumulative periodogram at the frequencies j/m of the Nyquist frequency, j = 1 … m.
    pub cumulative_periodogram: &'a [f64],
    /// 95 % of the cumulative periodograms of white noise stay as close to the diagonal (Bartlett 1955).
    pub ks_band: f64,
    /// p value of the periodogram's distance; NaN if there is none.
    pub p_value: f64,
}

impl<'a> From<&'a Level> for WhitenessLevel<'a> {
    fn from(l: &'a Level) -> Self {
        Self {
            averaging_time_s: l.averaging_time_s,
            blocks: l.whiteness.samples,
            autocorrelation: &l.whiteness.autocorrelation,
            bound: l.whiteness.autocorrelation_bound,
            cumulative_periodogram: &l.cumulative_periodogram,
            ks_band: kolmogorov_band95(l.cumulative_periodogram.len()),
            p_value: l.calibrated_p_values[2],
        }
    }
}

/// Content of the page of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FitFigure<'a> {
    /// Title: log and axis.
    pub title: &'a str,
    /// The verdict in a sentence or two.
    pub verdict: &'a str,
    /// Time of each sample, s, on the clock from which T counts.
    pub time: &'a TimeAxis,
    /// Recorded rates, rad/s; NaN where they are missing.
    pub rate_rad_s: &'a [f64],
    /// Recorded less fitted rates, rad/s; NaN where they are missing.
    pub residual_rad_s: &'a [f64],
    /// The fitted error with its 95 % band, at increasing times; a few hundred points are plenty.
    pub curve: &'a [CurvePoint],
    /// T, s; NaN where the model has none.
    pub time_constant_s: f64,
    /// 95 % interval of T, s; an end may be infinite. NaN where T was not fitted.
    pub time_constant_ci95_s: [f64; 2],
    /// Averaging times, from the samples up. The first, the middle and the last are shown.
    pub levels: &'a [WhitenessLevel<'a>],
    /// Unit of the rates; chosen by their size if `None`.
    pub unit: Option<RateUnit>,
}

/// Up to here samples are drawn one by one, beyond as envelopes.
const MOST_DOTS: usize = 500;
/// Slices of an envelope across a panel.
const COLUMNS: usize = 500;
/// Means that show the course of the log.
const COURSE: f64 = 60.0;
/// Text in place of charts about whiteness that have no data.
const NOTHING: &str = "Too few samples, or residuals that do not vary.";

impl FitFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if lengths differ, no sample is finite, or a number is infinite; it names which.
    pub(crate) fn draw(&self) -> Result<Picture> {
        self.page(COLUMNS)?.draw()
    }

    /// The page before it is drawn, with envelopes of `columns` slices.
    pub(in crate::report) fn page(&self, columns: usize) -> Result<Page> {
        self.check()?;
        let last_s = self.time.at(self.time.len() - 1);
        let drawing = Drawing {
            step_s: self.time.median_step_s(),
            clock: time(self.time.at(0).abs().max(last_s.abs())),
            levels: shown(self.levels),
            figure: self,
            columns,
        };
        Ok(Page::new(self.title)
            .subtitle(self.verdict)
            .row([drawing.log()?.into(), drawing.residuals()?])
            .row([drawing.autocorrelation(), drawing.periodogram()]))
    }

    fn check(&self) -> Result<()> {
        let rows = self.time.len();
        for (name, values) in [("rate", self.rate_rad_s), ("residual", self.residual_rad_s)] {
            if values.len() != rows {
                return Err(bad(name, format!("{} values on {rows} times", values.len())));
            }
            if values.iter().all(|v| v.is_nan()) {
                return Err(bad(name, format!("none of {rows} samples is a number")));
            }
        }
        check_time(self.time)?;
        if !(self.time_constant_s.is_nan() || self.time_constant_s > 0.0 && self.time_constant_s.is_finite()) {
            return Err(bad("time constant", format!("{} s is not a positive time", self.time_constant_s)));
        }
        match self.levels.iter().find(|l| !(l.averaging_time_s > 0.0 && l.ks_band > 0.0 && l.bound > 0.0)) {
            Some(l) => Err(bad("whiteness", "averaging time and bounds must be positive")
                .at(format!("whiteness at {} s", l.averaging_time_s))),
            None => Ok(()),
        }
    }
}

/// A figure whose numbers have been checked.
struct Drawing<'a> {
    figure: &'a FitFigure<'a>,
    /// Median sample time, s.
    step_s: f64,
    clock: Quantity,
    levels: Vec<&'a WhitenessLevel<'a>>,
    /// Slices of an envelope across a panel.
    columns: usize,
}

impl Drawing<'_> {
    /// Samples in slices fine enough for a panel. With few samples each is drawn: then there are no slices.
    fn fine(&self, name: &str, values: &[f64]) -> Result<Vec<Slice>> {
        let there = values.iter().filter(|v| !v.is_nan()).count();
        if there <= MOST_DOTS {
            // for its check of the values
            slices(name, self.figure.time, values, f64::INFINITY)?;
            return Ok(Vec::new());
        }
        slices(name, self.figure.time, values, self.length_s() / self.columns.min(there / 4) as f64)
    }

    /// Time that the samples stand for, s: from the first to the end of the last.
    fn length_s(&self) -> f64 {
        self.figure.time.span_s() + self.step_s
    }

    /// The axis of time, the same for log and residuals.
    fn time_axis(&self) -> Axis {
        let margin_s = 0.01 * self.figure.time.span_s();
        let last_s = self.figure.time.at(self.figure.time.len() - 1);
        Axis::linear("Time", self.clock.unit)
            .limits(self.clock.of(self.figure.time.at(0) - margin_s), self.clock.of(last_s + margin_s))
    }

    /// Slices that are more than half full: the mean of a few samples is another random variable.
    fn blocks(&self, name: &str, values: &[f64], width_s: f64) -> Result<Vec<Slice>> {
        let all = slices(name, self.figure.time, values, width_s)?;
        let full = all.iter().map(|s| s.count).max().unwrap_or(0);
        Ok(all.into_iter().filter(|s| 2 * s.count > full).collect())
    }

    fn dots(&self, values: &[f64], unit: Quantity) -> Vec<[f64; 2]> {
        let there = values.iter().enumerate().filter(|(_, v)| !v.is_nan());
        there.map(|(i, v)| [self.clock.of(self.figure.time.at(i)), unit.of(*v)]).collect()
    }

    fn log(&self) -> Result<Chart> {
        let fine = self.fine("rate", self.figure.rate_rad_s)?;
        let width_s = self.length_s() / COURSE;
        let course = if fine.is_empty() { Vec::new() } else { self.blocks("rate", self.figure.rate_rad_s, width_s)? };
        let fitted = || self.figure.curve.iter().map(|c| c.fit_rad_s);
        let core = if fine.is_empty() {
            range(self.figure.rate_rad_s.iter().copied().chain(fitted()))
        } else {
            range(course.iter().map(|s| s.mean).chain(fitted()))
        };
        // noise and band may be far larger than the warm-up: at most as much again is shown on either side
        let all = range(
            (fine.iter().flat_map(|s| [s.low, s.high]))
                .chain(self.figure.curve.iter().flat_map(|c| [c.low_rad_s, c.high_rad_s]))
                .chain(core),
        );
        let room = if core[1] > core[0] { core[1] - core[0] } else { f64::INFINITY };
        let [low, high] = [all[0].max(core[0] - room), all[1].min(core[1] + room)];
        let cut = low > all[0] || high < all[1];
        let unit = rate(low.abs().max(high.abs()), self.figure.unit);
        let margin = 0.04 * unit.of(high - low);
        let axis = Axis::linear("Rate", unit.unit).limits(unit.of(low) - margin, unit.of(high) + margin);

        let mut chart = Chart::new(self.time_axis(), axis).title("Log and fitted model");
        if !fine.is_empty() {
            let name = if cut { "samples (range, cut at the frame)" } else { "samples (range)" };
            chart = chart.band(name, scaled(&extremes(&fine), self.clock, unit), palette::SKY.tint(0.45), 1.0);
        }
        let [from, to] = self.figure.time_constant_ci95_s;
        if !from.is_nan() && !to.is_nan() {
            chart = chart.span_x("", [self.clock.of(from), self.clock.of(to)], palette::BLACK, 0.1);
        }
        let band =
            self.figure.curve.iter().map(|c| [self.clock.of(c.t_s), unit.of(c.low_rad_s), unit.of(c.high_rad_s)]);
        if self.figure.curve.iter().any(|c| c.low_rad_s.is_finite()) {
            chart = chart.band("95 % band", band, palette::VERMILION, 0.3);
        }
        if fine.is_empty() {
            let dots = self.dots(self.figure.rate_rad_s, unit);
            let radius = if dots.len() > 100 { 2.0 } else { 3.5 };
            chart = chart.dots("samples", dots, palette::BLUE, radius);
        } else {
            let course = means(&course).into_iter().map(|p| [self.clock.of(p[0]), unit.of(p[1])]);
            chart = chart.dots(format!("means over {}", duration(width_s, 2)), course, palette::BLUE, 3.0);
        }
        let fit = self.figure.curve.iter().map(|c| [self.clock.of(c.t_s), unit.of(c.fit_rad_s)]);
        chart = chart.line("fitted e(t)", fit, palette::VERMILION.stroke(2.5));
        if self.figure.time_constant_s.is_nan() {
            return Ok(chart);
        }
        Ok(chart.at_x(
            self.time_constant_text(),
            self.clock.of(self.figure.time_constant_s),
            palette::BLACK.stroke(1.5).dashed(),
            "T",
        ))
    }

    fn time_constant_text(&self) -> String {
        let [low, high] = self.figure.time_constant_ci95_s;
        let mut text = format!("T = {}", duration(self.figure.time_constant_s, 3));
        if !low.is_nan() && !high.is_nan() {
            text += &format!(" (95 %: {} to {})", duration(low, 3), duration(high, 3));
        }
        if self.figure.time_constant_s > self.figure.time.at(self.figure.time.len() - 1) {
            text += ", after the end of the log";
        }
        text
    }

    fn residuals(&self) -> Result<Panel> {
        let there = || self.figure.residual_rad_s.iter().filter(|v| !v.is_nan());
        let variance = there().map(|v| v * v).sum::<f64>() / there().count() as f64;
        let samples = self.residual_strip(variance.sqrt())?;
        let mut charts = vec![samples];
        for level in self.levels.iter().filter(|l| !is_sample(l.averaging_time_s, self.step_s)) {
            let width_s = level.averaging_time_s;
            let line = means(&self.blocks("residual", self.figure.residual_rad_s, width_s)?);
            let line = outline(line.len(), |i| line[i], self.columns);
            let name = format!("means over {}", duration(width_s, 2));
            let bound = NORMAL_975 * (variance * self.step_s / width_s).sqrt();
            charts.push(strip(
                &name,
                bound,
                self.time_axis(),
                self.figure.unit,
                line.iter().map(|p| p[1]),
                |chart, unit| {
                    let points = line.iter().map(|p| [self.clock.of(p[0]), unit.of(p[1])]);
                    chart.line("", points, palette::BLUE.stroke(1.5))
                },
            ));
        }
        let title = "Residuals, with the bounds that hold 95 % of white noise".into();
        Ok(Panel::Stack { title, label: "Recorded − fitted".into(), charts })
    }

    fn residual_strip(&self, std: f64) -> Result<Chart> {
        let fine = self.fine("residual", self.figure.residual_rad_s)?;
        let values = self.figure.residual_rad_s.iter().copied();
        Ok(strip("samples", NORMAL_975 * std, self.time_axis(), self.figure.unit, values, |chart, unit| {
            if fine.is_empty() {
                chart.dots("", self.dots(self.figure.residual_rad_s, unit), palette::BLUE, 2.5)
            } else {
                chart.band("", scaled(&extremes(&fine), self.clock, unit), palette::SKY.tint(0.6), 1.0)
            }
        }))
    }

    fn autocorrelation(&self) -> Panel {
        let title = "Autocorrelation of the residuals, with 95 % bounds".to_string();
        let most = self.levels.iter().map(|l| l.autocorrelation.len()).max().unwrap_or(0);
        if self.levels.iter().all(|l| l.autocorrelation.iter().skip(1).all(|r| r.is_nan())) {
            return Panel::Notice { title, text: NOTHING.into() };
        }
        let strips = self.levels.iter().map(|level| {
            let lags = || level.autocorrelation.iter().enumerate().skip(1).map(|(k, r)| [k as f64, 0.0, *r]);
            let largest = lags().fold(1.2 * level.bound, |m, [_, _, r]| m.max(r.abs()));
            let (blue, red) = (palette::BLUE.stroke(4.0), palette::VERMILION.stroke(4.0));
            let edge = 1.08 * largest;
            let last = most as f64 - 0.4;
            Chart::new(
                Axis::linear("Lag (samples or means)", "").limits(0.0, last),
                Axis::linear("", "").limits(-edge, edge),
            )
            .title(format!("{}, n = {}", self.level_name(level), level.blocks))
            .band("", [0.0, last].map(|x| [x, -level.bound, level.bound]), palette::GREY, 0.18)
            .bars("", lags().filter(|l| l[2].abs() <= level.bound), blue)
            .bars("", lags().filter(|l| l[2].abs() > level.bound), red)
            .at_y("", 0.0, palette::GREY.stroke(1.0))
        });
        Panel::Stack { title, label: "Autocorrelation".into(), charts: strips.collect() }
    }

    fn periodogram(&self) -> Panel {
        let title = "Cumulative periodogram of the residuals less that of white noise".to_string();
        if self.levels.iter().all(|l| l.cumulative_periodogram.iter().all(|c| c.is_nan())) {
            return Panel::Notice { title, text: NOTHING.into() };
        }
        let y = Axis::linear("Distance / 95 % bound", "").include(-1.3).include(1.3);
        let band = [0.0, 1.0].map(|x| [x, -1.0, 1.0]);
        let mut chart = Chart::new(Axis::linear("Frequency / Nyquist frequency", "").limits(0.0, 1.0), y)
            .title(title)
            .band("95 % of white noise stays within (Bartlett)", band, palette::GREY, 0.18);
        for (i, level) in self.levels.iter().enumerate() {
            let cumulative = level.cumulative_periodogram;
            let point = |j: usize| {
                let diagonal = j as f64 / cumulative.len().max(1) as f64;
                let risen = if j == 0 { 0.0 } else { cumulative[j - 1] };
                [diagonal, (risen - diagonal) / level.ks_band]
            };
            // of many million ordinates, a few hundred outline the curve
            let line = outline(cumulative.len() + 1, point, 300);
            let name = match level.p_value {
                p if p.is_nan() => self.level_name(level),
                p if p < 1e-3 => format!("{}: p < 0.001", self.level_name(level)),
                p => format!("{}: p = {}", self.level_name(level), significant(p, 2)),
            };
            chart = chart.line(name, line, palette::series(i).stroke(2.0));
        }
        chart.into()
    }

    fn level_name(&self, level: &WhitenessLevel) -> String {
        if is_sample(level.averaging_time_s, self.step_s) {
            "samples".into()
        } else {
            format!("means over {}", duration(level.averaging_time_s, 2))
        }
    }
}

fn is_sample(averaging_time_s: f64, step_s: f64) -> bool {
    averaging_time_s < 1.5 * step_s
}

/// The first, the middle and the last.
fn shown<'a>(levels: &'a [WhitenessLevel<'a>]) -> Vec<&'a WhitenessLevel<'a>> {
    let mut kept = vec![0, levels.len() / 2, levels.len().saturating_sub(1)];
    kept.dedup();
    kept.into_iter().filter_map(|i| levels.get(i)).collect()
}

fn scaled(band: &[[f64; 3]], clock: Quantity, unit: Quantity) -> Vec<[f64; 3]> {
    band.iter().map(|[t, low, high]| [clock.of(*t), unit.of(*low), unit.of(*high)]).collect()
}

/// A chart of residuals about zero with its own unit, its bounds drawn over `content`.
fn strip(
    name: &str,
    bound_rad_s: f64,
    time: Axis,
    unit: Option<RateUnit>,
    values: impl Iterator<Item = f64>,
    content: impl FnOnce(Chart, Quantity) -> Chart,
) -> Chart {
    let largest = values.fold(1.1 * bound_rad_s, |m, v| m.max(v.abs()));
    let unit = rate(largest, unit);
    let edge = 1.05 * unit.of(largest);
    let y = Axis::linear("", "").limits(-edge, edge);
    let chart = Chart::new(time, y).title(format!("{name} ({})", unit.unit));
    let bounds = palette::BLACK.stroke(1.2).dashed();
    content(chart, unit).at_y("", unit.of(bound_rad_s), bounds).at_y("", -unit.of(bound_rad_s), bounds).at_y(
        "",
        0.0,
        palette::GREY.stroke(1.0),
    )
}
