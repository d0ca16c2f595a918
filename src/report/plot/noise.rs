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
        let (mut bottom, top) = (low / ROOM, high * ROOM);
        let curve = |f: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            (0..=CURVE)
                .map(|i| first * (last / first).powf(i as f64 / CURVE as f64))
                .map(|t| [t, deg_h(f(t))])
                .collect()
        };
        let beside = SlopeGuides::clear_of(allan, &self.model.with_warm_up, &mut bottom, top);
        let mut chart = Chart::new(
            Axis::log("Averaging time τ", "s").limits(first / 1.3, last * 1.3),
            Axis::log("Deviation σ(τ)", "°/h").limits(bottom, top),
        );
        for (i, line) in beside.lines().enumerate() {
            let name = if i == 0 { "slopes −1, −½, 0, +½, +1" } else { "" };
            chart = chart.line(name, line, GREY.stroke(1.0));
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

/// A fan of the five slopes by which terms are told, in a corner of the plot that the deviations leave free.
struct SlopeGuides {
    /// Averaging time, s, and deviation, °/h, from which they spread.
    from: [f64; 2],
    /// How far they go in averaging time, decades.
    decades: f64,
}

impl SlopeGuides {
    /// Longest fan, and one that still tells its slopes apart, decades.
    const LONGEST: f64 = 0.5;
    const SHORTEST: f64 = 0.2;
    /// Room that stays between a fan and what is beside it, decades.
    const AROUND: f64 = 0.15;
    /// Factor on averaging times up to which deviations lie beside it: the next ones are drawn to it.
    const BESIDE: f64 = 2.1;

    /// In the corner with most room; where none has enough, the plot gets room below.
    fn clear_of(allan: &[AllanPoint], with_warm_up: &[AllanPoint], bottom: &mut f64, top: f64) -> Self {
        let all = || allan.iter().chain(with_warm_up);
        let ends = |of: fn(f64, f64) -> f64, begin: f64| all().map(|p| p.tau_s).fold(begin, of);
        let (first, last) = (ends(f64::min, f64::INFINITY), ends(f64::max, 0.0));
        let reach = (last / first).log10().clamp(0.0, Self::LONGEST);
        let at_left = |p: &&AllanPoint| p.tau_s <= first * 10f64.powf(reach) * Self::BESIDE;
        let at_right = |p: &&AllanPoint| p.tau_s >= last / 10f64.powf(reach) / Self::BESIDE;
        let lowest = |p: &AllanPoint| deg_h(p.ci95[0].min(p.deviation_rad_s)).max(f64::MIN_POSITIVE);
        let highest = |p: &AllanPoint| deg_h(p.ci95[1].max(p.deviation_rad_s));
        let least = |side: &dyn Fn(&&AllanPoint) -> bool| all().filter(side).map(lowest).fold(top, f64::min);
        let most = |side: &dyn Fn(&&AllanPoint) -> bool| all().filter(side).map(highest).fold(*bottom, f64::max);
        let (left, right) = (first, last / 10f64.powf(reach));
        // averaging time, limits of the free deviations
        let corners = [
            (left, *bottom, least(&at_left)),
            (right, *bottom, least(&at_right)),
            (right, most(&at_right), top),
            (left, most(&at_left), top),
        ];
        let decades = |low: f64, high: f64| (((high / low).log10() - 2.0 * Self::AROUND) / 2.0).min(reach);
        let best = corners.into_iter().max_by(|a, b| decades(a.1, a.2).total_cmp(&decades(b.1, b.2)));
        let (tau_s, low, high) = match best {
            Some(corner) if decades(corner.1, corner.2) >= Self::SHORTEST => corner,
            _ => {
                let under = corners[0].2;
                *bottom = under / 10f64.powf(2.0 * (Self::SHORTEST + Self::AROUND));
                (left, *bottom, under)
            }
        };
        Self { from: [tau_s, (low * high).sqrt()], decades: decades(low, high).max(0.0) }
    }

    fn lines(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let [tau_s, deviation] = self.from;
        let to = move |slope: f64| [tau_s * 10f64.powf(self.decades), deviation * 10f64.powf(self.decades * slope)];
        [-1.0, -0.5, 0.0, 0.5, 1.0].into_iter().map(move |slope| [self.from, to(slope)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deviations that go as `f`, with intervals of a third.
    fn deviations(f: impl Fn(f64) -> f64) -> Vec<AllanPoint> {
        let of = |k: i32| {
            let (tau_s, deviation_rad_s) = (2f64.powi(k), f(2f64.powi(k)) * RAD_S_PER_DEG_H);
            let ci95 = [deviation_rad_s / 1.3, deviation_rad_s * 1.3];
            AllanPoint { m: 1 << k, tau_s, deviation_rad_s, ci95, degrees_of_freedom: 20.0, noise_exponent: 0 }
        };
        (0..12).map(of).collect()
    }

    #[test]
    fn the_slopes_lie_beside_the_deviations_whichever_way_these_go() {
        let ways: [(&str, &dyn Fn(f64) -> f64); 5] = [
            ("falling", &|t| 500.0 / t.sqrt()),
            ("rising", &|t| 2.0 * t),
            ("flat", &|_| 10.0),
            ("down and up", &|t| 100.0 / t + 0.1 * t),
            ("up and down", &|t| 100.0 / (1.0 + (t / 40.0 - 40.0 / t).abs())),
        ];
        for (way, f) in ways {
            let all = deviations(f);
            let ends = |of: fn(f64, f64) -> f64, begin| all.iter().map(|p| deg_h(p.deviation_rad_s)).fold(begin, of);
            let (mut bottom, top) = (ends(f64::min, f64::INFINITY) / ROOM, ends(f64::max, 0.0) * ROOM);
            let guides = SlopeGuides::clear_of(&all, &[], &mut bottom, top);
            assert!((SlopeGuides::SHORTEST - 1e-9..=SlopeGuides::LONGEST).contains(&guides.decades), "{way}");
            let lines: Vec<_> = guides.lines().collect();
            assert_eq!(lines.len(), 5);
            for [a, b] in lines {
                for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    let at = |i: usize| a[i] * (b[i] / a[i]).powf(share);
                    let (tau_s, deviation) = (at(0), at(1));
                    assert!((bottom..=top).contains(&deviation) && (1.0..=2048.0 + 1e-6).contains(&tau_s), "{way}");
                    // the deviations on both sides lie on the same side of the line
                    let near: Vec<_> = all.iter().filter(|p| (p.tau_s / tau_s).ln().abs() < 0.7).collect();
                    let above = near.iter().filter(|p| deg_h(p.ci95[0]) > deviation).count();
                    let below = near.iter().filter(|p| deg_h(p.ci95[1]) < deviation).count();
                    assert!(above == near.len() || below == near.len(), "{way}: {tau_s} s, {deviation} °/h");
                }
            }
        }
    }
}
