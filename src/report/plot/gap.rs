//! A diagnosis on one page: where the recording leaves the simulators' bands, which effect, how far the gap shrinks.

use super::bars::{Bar, BarChart};
use super::correction;
use super::palette::{AFTER, BEFORE};
use super::path::path;
use super::quantity::{self, Quantity, significant};
use super::{Axis, Chart, Page, Panel, Picture, palette};
use crate::error::Result;
use crate::gap::DriveTraces;
use crate::gap::answer::{Answer, Metric, Verdict};
use crate::gap::rest::predictive::{Curve, Over, Shown};
use crate::report::gap::words::{capitalised, curve_name, heading_horizon_s, measured_on, pose_horizon, title};
use crate::units::duration_text;

/// Effects in the panel of probabilities.
const EFFECTS: usize = 6;
const FLOOR: palette::Color = palette::GREEN;

/// The page of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GapFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// Whether a recording was held out, on which the gap was measured.
    pub held_out: bool,
    /// The verdict in one line.
    pub verdict: &'a str,
    /// The answer.
    pub answer: &'a Answer,
    /// Curves with bands.
    pub curves: &'a [Curve],
    /// The drives on which the gap was measured; the path of the first that has one is drawn.
    pub traces: &'a [DriveTraces],
}

impl GapFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if a number cannot be shown.
    pub(crate) fn draw(&self) -> Result<Picture> {
        if self.curves.is_empty() && !self.answer.gap.is_empty() {
            let path = self.traces.iter().find_map(|drive| path(drive, ""));
            let width = if path.is_some() { 2400 } else { 1800 };
            let first = path.into_iter().chain([self.equations(), self.probabilities(), self.how_far()]);
            let page = Page::new(self.title).subtitle(self.verdict).row(first);
            return match correction::rows(&self.answer.equations) {
                Some([over_time, goes_with]) => page.size(width, 1600).row(over_time).row(goes_with),
                None => page.size(width, 700),
            }
            .draw();
        }
        let find = |over, shown| self.curves.iter().find(|c| c.over == over && c.shown == shown);
        let with_effects = self.answer.verdict == Verdict::Identified || !self.answer.together.is_empty();
        let panel = |name: &str, curve: Option<&Curve>| match curve {
            Some(curve) => chart(curve, with_effects).into(),
            None => Panel::Notice { title: name.into(), text: "not compared with simulated recordings".into() },
        };
        // what the first three panels do not show; elapsed time shows what time does
        let largest = |elapsed: bool| {
            let others = self.curves.iter().filter(|c| !matches!(c.shown, Shown::Power | Shown::AllanDeviation));
            let others = others.filter(|c| c.over != Over::Time && c.share > 0.0);
            others
                .filter(|c| elapsed || c.over != Over::ElapsedTime || c.shown != Shown::Deviation)
                .max_by(|a, b| a.share.total_cmp(&b.share))
        };
        let fourth = largest(false).or_else(|| largest(true)).or_else(|| find(Over::Amplitude, Shown::ShareOfSamples));
        Page::new(self.title)
            .subtitle(self.verdict)
            .size(1800, 1150)
            .row([
                panel("Deviation over time", find(Over::Time, Shown::Deviation)),
                panel("Spectrum", find(Over::Frequency, Shown::Power)),
                panel("Allan deviation", find(Over::AveragingTime, Shown::AllanDeviation)),
            ])
            .row([panel("Amplitude", fourth), self.probabilities(), self.how_far()])
            .draw()
    }

    /// Corrections of equations over time, then against what they go with.
    pub(in crate::report) fn corrections(&self) -> Vec<Panel> {
        correction::rows(&self.answer.equations).map(|rows| rows.concat()).unwrap_or_default()
    }

    /// Log-likelihood that free corrections of the nominal equations gain, nats.
    fn equations(&self) -> Panel {
        let name = "Which equation: what a free correction gains, nats";
        let all = &self.answer.equations;
        let Some(largest) = all.iter().map(|e| e.gain_nats).reduce(f64::max) else {
            return Panel::Notice { title: name.into(), text: "no equation asks for a correction".into() };
        };
        let mut chart = BarChart::new(name);
        for e in all {
            // gains span decades: the bar is their logarithm
            let length = (e.gain_nats.max(1.0).ln() / largest.max(std::f64::consts::E).ln()).clamp(0.0, 1.0);
            let text = format!("{:.0}, {}", e.gain_nats, e.follows.replace('_', " "));
            chart = chart.row(correction::short(&e.equation), [Bar { length, text, color: BEFORE }]);
        }
        chart.into()
    }

    pub(in crate::report) fn probabilities(&self) -> Panel {
        let a = self.answer;
        let bar = |probability: f64, color| {
            // rounding may lead a hair beyond one
            [Bar { length: probability.clamp(0.0, 1.0), text: format!("{probability:.2}"), color }]
        };
        let mut chart = BarChart::new("Which effect: probability of being present");
        for effect in a.effects.iter().take(EFFECTS) {
            let present = a.together.contains(&effect.id);
            let color = if present { AFTER } else { palette::SKY };
            chart = chart.row(title(&effect.id), bar(effect.probability, color));
        }
        chart
            .row("nothing is lacking", bar(a.none_probability, BEFORE))
            .row("not in the library", bar(a.unknown_probability, palette::PURPLE))
            .into()
    }

    pub(in crate::report) fn how_far(&self) -> Panel {
        let name = format!("How far the gap shrinks, {}", measured_on(self.held_out));
        // after a short time all are as good as their sensors, and the numbers of fewer rows can be read
        let horizons: Vec<f64> =
            self.answer.gap.iter().filter_map(|m| pose_horizon(&m.metric)).map(|p| p.horizon_s).collect();
        let [shortest, longest] = [f64::min, f64::max].map(|of| horizons.iter().copied().reduce(of));
        let short = |m: &&Metric| {
            let horizon_s = pose_horizon(&m.metric).map(|p| p.horizon_s);
            horizon_s.is_some() && horizon_s == shortest && shortest < longest
        };
        let shown = self.answer.gap.iter().filter(|m| !short(m));
        let rows: Vec<(String, [(f64, String); 3])> = shown.filter_map(row).collect();
        if rows.is_empty() {
            return Panel::Notice { title: name, text: "no recording was held out to measure it on".into() };
        }
        let mut chart = BarChart::new(name).legend("before", BEFORE).legend("after", AFTER).legend("floor", FLOOR);
        for (name, bars) in rows {
            let longest = bars.iter().map(|b| b.0).fold(f64::MIN_POSITIVE, f64::max);
            let bars = bars.into_iter().zip([BEFORE, AFTER, FLOOR]).map(|((value, text), color)| Bar {
                length: (value / longest).clamp(0.0, 1.0),
                text,
                color,
            });
            chart = chart.row(name, bars);
        }
        chart.into()
    }
}

/// Name, and value and text of before, after and floor; smaller is better. None where a number is missing.
fn row(metric: &Metric) -> Option<(String, [(f64, String); 3])> {
    let values = [metric.before, metric.after, metric.floor];
    if values.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let shown = |unit: Quantity| values.map(|v| (v.max(0.0), format!("{} {}", significant(unit.of(v), 3), unit.unit)));
    Some(match (metric.metric.as_str(), heading_horizon_s(metric), pose_horizon(&metric.metric)) {
        (_, Some(horizon_s), _) => {
            (format!("heading drift, {}", quantity::duration(horizon_s, 3)), shown(quantity::angle(largest)))
        }
        (_, _, Some(pose)) => {
            let unit = if pose.heading { quantity::angle(largest) } else { quantity::length(largest) };
            (format!("{}, {}", pose.what(), duration_text(pose.horizon_s)), shown(unit))
        }
        ("log_score", ..) => {
            // a score has no zero: what it falls short of the floor has
            let shown = |v: f64| ((metric.floor - v).max(0.0), significant(v, 4));
            ("log score (bar: short of floor)".into(), values.map(shown))
        }
        (other, ..) => {
            let name = match other {
                "allan_deviation_ln_rms" => "Allan deviation, ln rms".into(),
                "spectrum_ln_rms" => "spectrum, ln rms".into(),
                other => other.to_string(),
            };
            (name, values.map(|v| (v.max(0.0), significant(v, 3))))
        }
    })
}

/// The recording over the bands of the simulators.
pub(in crate::report) fn chart(curve: &Curve, with_effects: bool) -> Chart {
    let log_x = !matches!(curve.over, Over::Time | Over::TemperatureC | Over::TemperatureRate | Over::SupplyV);
    let log_y =
        matches!(curve.shown, Shown::Power | Shown::LargestPower | Shown::AllanDeviation | Shown::ShareOfSamples);
    let all = || curve.recorded.iter().chain(curve.before.iter().chain(&curve.after).flatten()).copied();
    let largest = all().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    // empty bins lie at the foot of a logarithmic axis
    let foot = all().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min) / 2.0;
    let y_unit = match curve.shown {
        Shown::Deviation => quantity::rate(largest, None),
        Shown::AllanDeviation => Quantity { unit: "rad/s", per_si: 1.0 },
        Shown::Power | Shown::LargestPower => Quantity { unit: "rad²/s²/Hz", per_si: 1.0 },
        Shown::ShareOfSamples | Shown::NoiseLevel => Quantity { unit: "", per_si: 1.0 },
    };
    let span = curve.x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let x_unit = match curve.over {
        Over::Time | Over::ElapsedTime => quantity::time(span),
        Over::TemperatureC => Quantity { unit: "°C", per_si: 1.0 },
        Over::TemperatureRate => Quantity { unit: "°C/min", per_si: 60.0 },
        Over::SupplyV => Quantity { unit: "V", per_si: 1.0 },
        Over::Frequency => Quantity { unit: "Hz", per_si: 1.0 },
        Over::AveragingTime => Quantity { unit: "s", per_si: 1.0 },
        Over::Amplitude => Quantity { unit: "standard deviations", per_si: 1.0 },
    };
    let x_label = match curve.over {
        Over::Time => "Time",
        Over::Frequency => "Frequency",
        Over::AveragingTime => "Averaging time",
        Over::Amplitude => "Difference of neighbours",
        Over::TemperatureC => "Temperature",
        Over::TemperatureRate => "Temperature rate",
        Over::SupplyV => "Supply",
        Over::ElapsedTime => "Time since power-on",
    };
    let y_label = match curve.shown {
        Shown::Deviation => "Deviation from the warm-up",
        Shown::Power => "Power spectral density",
        Shown::LargestPower => "Largest line",
        Shown::AllanDeviation => "Allan deviation",
        Shown::ShareOfSamples => "Share of samples",
        Shown::NoiseLevel => "Noise, relative to all",
    };
    let x_axis = if log_x { Axis::log(x_label, x_unit.unit) } else { Axis::linear(x_label, x_unit.unit) };
    let y_axis = if log_y { Axis::log(y_label, y_unit.unit) } else { Axis::linear(y_label, y_unit.unit) };
    let y = |v: f64| y_unit.of(if log_y { v.max(foot) } else { v });
    // a bin at zero has no place on a logarithmic axis
    let rows: Vec<usize> = (0..curve.x.len()).filter(|i| !log_x || curve.x[*i] > 0.0).collect();
    let x = |i: &usize| x_unit.of(curve.x[*i]);
    let band = |of: &[[f64; 2]]| rows.iter().map(|i| [x(i), y(of[*i][0]), y(of[*i][1])]).collect::<Vec<_>>();
    let there = |v: f64| if log_y && v <= 0.0 { f64::NAN } else { y(v) };
    let recorded: Vec<[f64; 2]> = rows.iter().map(|i| [x(i), there(curve.recorded[*i])]).collect();
    let name = capitalised(&curve_name(curve));
    let share = if curve.share >= 0.005 { format!(", share {:.2}", curve.share) } else { String::new() };
    let mut chart = Chart::new(x_axis, y_axis).title(format!("{name}{share}"));
    if let Some([from, to]) = curve.most_in {
        let from = if log_x && from <= 0.0 { f64::NEG_INFINITY } else { x_unit.of(from) };
        chart = chart.span_x("", [from, x_unit.of(to)], palette::ORANGE, 0.12);
    }
    chart = chart.band("nominal, 95 %", band(&curve.before), BEFORE, 0.45);
    if with_effects {
        chart = chart.band("with effects, 95 %", band(&curve.after), AFTER, 0.30);
    }
    chart.line("recording", recorded.iter().copied(), palette::BLUE.stroke(1.5)).dots("", recorded, palette::BLUE, 2.5)
}
