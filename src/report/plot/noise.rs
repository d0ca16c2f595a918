//! Allan deviation as engineers read it: log-log, intervals, the terms and their sum, and the slopes that name them.

use super::palette::{BLACK, BLUE, Color, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION};
use super::{Axis, Chart, Page, Picture};
use crate::error::Result;
use crate::identify::terms::{NoiseModel, TermEstimate};
use crate::noise::{AllanPoint, Deviation, TermKind};
use crate::report::numbers::significant;
use crate::units::RAD_S_PER_DEG_H;

/// Points of a curve.
const CURVE: usize = 200;
/// Room above and below the measured deviations, as a factor: curves of single terms are cut off beyond.
const ROOM: f64 = 2.5;

/// The page of a noise model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoiseFigure<'a> {
    /// Title.
    pub title: &'a str,
    /// The verdict in one line.
    pub verdict: &'a str,
    /// The model, with its deviations.
    pub model: &'a NoiseModel,
}

fn colour(kind: TermKind) -> Color {
    match kind {
        TermKind::Quantization => PURPLE,
        TermKind::AngleRandomWalk => GREEN,
        TermKind::BiasInstability => ORANGE,
        TermKind::RateRandomWalk => VERMILION,
        TermKind::RateRamp => SKY,
        TermKind::GaussMarkov => Color(0x8C, 0x56, 0x4B),
        TermKind::Bandwidth | TermKind::NarrowBandNoise => GREY,
    }
}

fn deg_h(rate_rad_s: f64) -> f64 {
    rate_rad_s / RAD_S_PER_DEG_H
}

fn legend(t: &TermEstimate) -> String {
    if let Some(center) = t.center_hz {
        return format!("band at {} Hz", significant(center.estimate, 3));
    }
    let unit = t.id.datasheet_units()[0];
    let size = significant(t.estimate.abs() * unit.per_si, 3);
    let slope = match t.id.slope() {
        Some(s) => format!("slope {}", ["−1", "−½", "0", "+½", "+1"][(2.0 * s + 2.0) as usize]),
        None => format!("τ {} s", significant(t.correlation_time_s.map_or(f64::NAN, |c| c.estimate), 3)),
    };
    format!("{} = {size} {} ({slope})", t.id.symbol(), unit.name)
}

impl NoiseFigure<'_> {
    /// Draws the page.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Value`] if no deviation can be shown.
    pub(crate) fn draw(&self) -> Result<Picture> {
        let none = Vec::new();
        let of = |d: Deviation| self.model.deviations.iter().find(|f| f.0 == d).map_or(&none, |f| &f.1);
        let allan = of(Deviation::Overlapping);
        let total = of(Deviation::Total);
        let seen = allan.iter().chain(&self.model.with_warm_up).map(|p| deg_h(p.deviation_rad_s));
        let (low, high) =
            seen.filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
        let taus: Vec<f64> = allan.iter().map(|p| p.tau_s).collect();
        let (first, last) = (taus.first().copied().unwrap_or(1.0), taus.last().copied().unwrap_or(2.0));
        let (bottom, top) = (low / ROOM, high * ROOM);
        let mut chart = Chart::new(
            Axis::log("Averaging time τ", "s").limits(first / 1.3, last * 1.3),
            Axis::log("Deviation σ(τ)", "°/h").limits(bottom, top),
        );
        let curve = |f: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            (0..=CURVE)
                .map(|i| first * (last / first).powf(i as f64 / CURVE as f64))
                .map(|t| [t, deg_h(f(t))])
                .collect()
        };
        // the five slopes through the lowest point
        let corner = allan.iter().filter(|p| p.degrees_of_freedom > 8.0);
        if let Some(p) = corner.min_by(|a, b| a.deviation_rad_s.total_cmp(&b.deviation_rad_s)) {
            for (i, slope) in [-1.0, -0.5, 0.0, 0.5, 1.0].into_iter().enumerate() {
                let name = if i == 0 { "slopes −1, −½, 0, +½, +1" } else { "" };
                let line = curve(&|t| p.deviation_rad_s * (t / p.tau_s).powf(slope));
                let stroke = GREY.tint(0.45).stroke(1.0);
                chart = chart.line(name, line, super::Stroke { dash: Some([3.0, 5.0]), ..stroke });
            }
        }
        let points = |all: &[AllanPoint]| all.iter().map(|p| [p.tau_s, deg_h(p.deviation_rad_s)]).collect::<Vec<_>>();
        if !self.model.with_warm_up.is_empty() {
            chart = chart.line("with the warm-up left in", points(&self.model.with_warm_up), GREY.stroke(2.0));
        }
        let band = allan.iter().map(|p| [p.tau_s, deg_h(p.ci95[0]), deg_h(p.ci95[1]).min(10.0 * top)]);
        chart = chart.band("95 % interval", band, BLUE, 0.18);
        for term in self.model.terms.iter().filter(|t| t.low_pass.is_none()) {
            let line = curve(&|t| term.allan_variance(t).sqrt());
            chart = chart.line(legend(term), line, colour(term.id).stroke(2.0).dashed());
        }
        let picture = chart
            .line("all terms", curve(&|t| self.model.allan_deviation(t)), BLACK.stroke(2.5))
            .dots("total deviation", points(total), SKY, 3.0)
            .dots("overlapping Allan deviation", points(allan), BLUE, 4.0);
        Page::new(self.title).subtitle(self.verdict).size(1300, 950).row([picture.into()]).draw()
    }
}
