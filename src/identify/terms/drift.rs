//! Is it time or temperature? e(t) = C1 (1 - exp(-t/T)) + C2, or a (θ - θ̄) + b (θ - θ̄)², or both, or neither
//!
//! Each explanation is columns in the likelihood of the noise terms, its coefficients integrated out under a normal prior as
//! wide as the slow part of the log varies, T even in its logarithm, the noise at its best for each. Odds under
//! twenty to one leave the question open: a sensor that warms itself has both at once.

use super::model::{Likelihood, Model};
use super::observed::{Column, EvenLog, Observed};
use super::shape::Shape;
use crate::error::Result;
use crate::noise::TermKind;
use crate::signal::TimeAxis;
use serde::Serialize;
use std::f64::consts::TAU;

/// Odds at which one explanation is believed.
const DECISIVE: f64 = 20.0;
/// Steps between the time constants that are tried first.
const TIMES: usize = 20;
/// A peak over them is resolved where its neighbours lie within this of its ln evidence ...
const RESOLVED: f64 = 0.5;
/// ... or so many times half as far away.
const HALVINGS: usize = 12;
/// Prior of the quadratic coefficient beside the linear one.
const BEND: f64 = 0.3;
/// Block means that show the slow part.
const SLOW_BLOCKS: usize = 64;

/// Candidate explanation of a drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Explanation {
    /// Neither: noise alone.
    None,
    /// Time since power-on.
    ElapsedTime,
    /// Temperature.
    Temperature,
    /// Both.
    Both,
}

impl Explanation {
    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::None => "neither",
            Self::ElapsedTime => "elapsed time",
            Self::Temperature => "temperature",
            Self::Both => "both",
        }
    }
}

/// The comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DriftCause {
    /// ln evidence of each explanation above the best, and its probability, even odds before.
    pub explanations: Vec<(Explanation, f64, f64)>,
    /// The explanation that the evidence decides for; `None` where the log cannot tell.
    pub decided: Option<Explanation>,
    /// Range of the temperature, °C.
    pub temperature_range_c: f64,
    /// Correlation of temperature with 1 - exp(-t/T) at the best T: near ±1 they cannot be told apart.
    pub correlation: f64,
}

fn column<'a>(at: impl Fn(f64) -> f64 + 'a, changes_over_s: f64, std: f64) -> Column<'a> {
    Column { at: Box::new(at), changes_over_s, std: Some(std) }
}

/// ln evidence of the columns, noise terms at their mode.
fn evidence(log: &EvenLog, kinds: &[TermKind], start: &[f64], columns: &[Column]) -> Option<f64> {
    let observed = Observed::new(log, columns);
    let likelihood = Likelihood::new(&observed, Model::new(kinds, &Shape::default()));
    let peak = likelihood.climb(start, &vec![true; start.len()])?;
    let ln_det = 2.0 * likelihood.curvature(&peak.point).cholesky()?.l().diagonal().iter().map(|v| v.ln()).sum::<f64>();
    Some(peak.point.value + 0.5 * (start.len() as f64 * TAU.ln() - ln_det))
}

/// Compares the explanations of what is slow in `log`; `None` if the temperature is constant or the comparison fails.
/// `temperature_c` is on the lattice of `log` ([`EvenLog::beside`]); `kinds` and `start` are the noise terms and the
/// logarithms of their parameters.
///
/// # Errors
/// None so far; the signature leaves room for logs that are read in pieces.
pub(super) fn drift_cause(
    log: &EvenLog,
    temperature_c: &[f64],
    kinds: &[TermKind],
    start: &[f64],
) -> Result<Option<DriftCause>> {
    // the slow part is all that both can explain: a log of block means is enough, and quick
    let block = (log.values.len() / 8192).max(1);
    let means =
        |v: &[f64]| -> Vec<f64> { v.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect() };
    let coarse = EvenLog {
        first_s: log.first_s + 0.5 * (block as f64 - 1.0) * log.step_s,
        step_s: log.step_s * block as f64,
        values: means(&log.values),
        filled: 0,
    };
    let temperature = means(temperature_c);
    let mean = temperature.iter().sum::<f64>() / temperature.len() as f64;
    let (low, high) = temperature.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if !(high - low > 1e-6) {
        return Ok(None);
    }
    let axis = TimeAxis::Uniform { start_s: coarse.first_s, step_s: coarse.step_s, len: temperature.len() };
    let wide = (coarse.values.len() / SLOW_BLOCKS).max(1);
    let slow: Vec<f64> = coarse.values.chunks_exact(wide).map(|c| c.iter().sum::<f64>() / wide as f64).collect();
    let centre = slow.iter().sum::<f64>() / slow.len() as f64;
    let std = (slow.iter().map(|v| (v - centre).powi(2)).sum::<f64>() / slow.len() as f64).sqrt();
    let theta = |t: f64| {
        let row = ((t - coarse.first_s) / coarse.step_s).round().clamp(0.0, (temperature.len() - 1) as f64);
        temperature[row as usize] - mean
    };
    let span = coarse.span_s();
    let warm = |time: f64| move |t: f64| -(-t / time).exp_m1();
    let by_temperature = || vec![column(theta, 0.0, std), column(move |t| theta(t).powi(2), 0.0, BEND * std)];
    let over_times = |also: bool| {
        let value = |ln_time: f64| {
            let mut columns = vec![column(warm(ln_time.exp()), 0.0, std)];
            if also {
                columns.extend(by_temperature());
            }
            evidence(&coarse, kinds, start, &columns).unwrap_or(f64::NEG_INFINITY)
        };
        over_ln_times([(4.0 * coarse.step_s).ln(), (3.0 * span).ln()], value)
    };
    let Some(none) = evidence(&coarse, kinds, start, &[]) else { return Ok(None) };
    let Some(temperature_alone) = evidence(&coarse, kinds, start, &by_temperature()) else { return Ok(None) };
    let (elapsed, best_time) = over_times(false);
    let (both, _) = over_times(true);
    let all = [
        (Explanation::None, none),
        (Explanation::ElapsedTime, elapsed),
        (Explanation::Temperature, temperature_alone),
        (Explanation::Both, both),
    ];
    let top = all.iter().map(|a| a.1).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = all.iter().map(|a| (a.1 - top).exp()).sum();
    if !sum.is_finite() {
        return Ok(None);
    }
    let mut explanations: Vec<_> = all.iter().map(|(e, v)| (*e, v - top, (v - top).exp() / sum)).collect();
    explanations.sort_by(|a, b| b.1.total_cmp(&a.1));
    let decided = (explanations[1].1 < -DECISIVE.ln()).then_some(explanations[0].0);
    let shape: Vec<f64> = axis.to_vec().into_iter().map(warm(best_time)).collect();
    Ok(Some(DriftCause {
        explanations,
        decided,
        temperature_range_c: high - low,
        correlation: correlation(&shape, &temperature),
    }))
}

/// ln of the mean of exp(`value`) over ln T between `ends`, and T at its largest. Points are added about the peak until it is
/// resolved: the better the log, the narrower it is. Between points `value` is taken as a straight line.
fn over_ln_times(ends: [f64; 2], value: impl Fn(f64) -> f64) -> (f64, f64) {
    let [low, high] = ends;
    let mut points: Vec<(f64, f64)> = (0..=TIMES)
        .map(|i| low + (high - low) * i as f64 / TIMES as f64)
        .map(|ln_time| (ln_time, value(ln_time)))
        .collect();
    let peak = |points: &[(f64, f64)]| (0..points.len()).fold(0, |b, i| if points[i].1 > points[b].1 { i } else { b });
    for _ in 0..HALVINGS {
        let best = peak(&points);
        let (at, top) = points[best];
        let beside = [best.checked_sub(1), Some(best + 1).filter(|i| *i < points.len())];
        let steep = beside.into_iter().flatten().map(|i| points[i]).filter(|p| top - p.1 > RESOLVED);
        let between: Vec<f64> = steep.map(|p| 0.5 * (p.0 + at)).collect();
        if between.is_empty() {
            break;
        }
        points.extend(between.into_iter().map(|ln_time| (ln_time, value(ln_time))));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let (best, top) = points[peak(&points)];
    let piece = |w: &[(f64, f64)]| {
        let (a, b) = (w[0].1 - top, w[1].1 - top);
        let mean = if (a - b).abs() < 1e-6 { a.exp() } else { (a.exp() - b.exp()) / (a - b) };
        if mean.is_finite() { mean * (w[1].0 - w[0].0) } else { 0.0 }
    };
    let sum: f64 = points.windows(2).map(piece).sum();
    (top + (sum / (high - low)).ln(), best.exp())
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma).powi(2);
        bb += (y - mb).powi(2);
    }
    ab / (aa * bb).sqrt()
}

#[cfg(test)]
mod tests {
    use super::over_ln_times;
    use std::f64::consts::TAU;

    #[test]
    fn a_narrow_peak_is_integrated_as_a_wide_one() {
        for std in [1.0, 0.1, 1e-3] {
            let (mean, best) = over_ln_times([0.0, 8.0], |x| -0.5 * ((x - 3.2) / std).powi(2));
            // chords of a concave curve lose a sixth at most; odds of twenty to one are 3.0
            let exact = (TAU.sqrt() * std / 8.0).ln();
            assert!((mean - exact).abs() < 0.25, "{std}: {mean} {exact}");
            assert!((best.ln() - 3.2).abs() < std.min(0.25), "{std}: {best}");
        }
    }
}
