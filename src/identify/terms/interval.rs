//! {v : 2 [max ln p - max over the rest ln p(v)] < 3.84}: profile-likelihood intervals of sizes and correlation times

use super::model::{Likelihood, Model, Peak};
use super::views::Views;
use crate::noise::TermKind;

/// Half the quantile of χ² with one degree of freedom at 0.95.
pub(super) const DROP: f64 = 0.5 * 3.841_458_820_694_124;
/// The same for one side alone: half the square of the normal quantile at 0.95.
const DROP_ONE_SIDED: f64 = 0.5 * 2.705_543_454_095_404;
/// Digits of an end: a hundredth of a standard deviation.
const TOLERANCE: f64 = 0.01;

/// The end of the interval of parameter `i` on the side of `direction`; infinite (or minus infinity) where the likelihood
/// never falls by `drop` inside the bounds.
fn end(likelihood: &Likelihood, peak: &Peak, i: usize, std: f64, direction: f64, drop: f64) -> f64 {
    let mut free = vec![true; peak.x.len()];
    free[i] = false;
    let bound = likelihood.bounds[i][usize::from(direction > 0.0)];
    let mut from = peak.x.clone();
    let mut lost = |v: f64| {
        let mut start = from.clone();
        start[i] = v;
        match likelihood.climb(&start, &free) {
            Some(p) => {
                let lost = peak.point.value - p.point.value;
                from = p.x;
                lost
            }
            None => f64::INFINITY,
        }
    };
    let (mut inside, mut step) = (peak.x[i], 1.9 * std.clamp(1e-6, 1.0));
    let mut outside = loop {
        let next = inside + direction * step;
        let stopped = direction * (next - bound) >= 0.0;
        let next = if stopped { bound } else { next };
        if lost(next) > drop {
            break next;
        }
        if stopped {
            return direction * f64::INFINITY;
        }
        inside = next;
        step *= 1.6;
    };
    while (outside - inside).abs() > TOLERANCE * std.min(1.0) {
        let middle = 0.5 * (inside + outside);
        if lost(middle) > drop {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    0.5 * (inside + outside)
}

/// The 95 % interval of parameter `i`, a logarithm at the mode, as a size; an open end is 0 or infinite.
pub(super) fn interval(likelihood: &Likelihood, peak: &Peak, i: usize, std: f64) -> [f64; 2] {
    [-1.0, 1.0].map(|direction| end(likelihood, peak, i, std, direction, DROP).exp())
}

/// Upper bound of the size of `kind` with 95 % probability, beside the terms of `likelihood`'s model. The model must
/// hold `kind`; else the bound is infinite.
pub(super) fn upper(likelihood: &Likelihood, peak: &Peak, kind: TermKind) -> f64 {
    let Some(i) = likelihood.model.place(kind) else { return f64::INFINITY };
    let std = likelihood.covariance(&peak.point).map_or(1.0, |c| c[(i, i)].sqrt());
    end(likelihood, peak, i, std, 1.0, DROP_ONE_SIDED).exp()
}

/// Estimate, standard deviation and 95 % interval of the ramp, rad/s²: its likelihood with everything else at its best.
pub(super) fn ramp(views: &Views, model: &Model, peak: &Peak) -> (f64, f64, [f64; 2]) {
    let j = views.ramp.columns() - 1;
    let [slope, std] = views.slope(peak);
    let rms = views.ramp.column_rms[j];
    let free = vec![true; model.parameters()];
    let mut from = peak.x.clone();
    let mut value = |v: f64| {
        let log = views.ramp.without(j, v * rms);
        match Likelihood::new(&log, model.clone()).climb(&from, &free) {
            Some(p) => {
                from = p.x;
                p.point.value
            }
            None => f64::NEG_INFINITY,
        }
    };
    // the mode of the slope itself, by parabolas: the noise that suits it best is not that which suits all slopes
    let mut best = slope;
    for width in [1.0, 0.3, 0.1] {
        let h = width * std;
        let [a, b, c] = [best - h, best, best + h].map(&mut value);
        let bend = a - 2.0 * b + c;
        if bend < 0.0 {
            best += (0.5 * h * (a - c) / bend).clamp(-std, std);
        }
    }
    let top = value(best);
    let ends = [-1.0, 1.0].map(|direction| {
        let (mut inside, mut step) = (best, 1.9 * std);
        let mut outside = loop {
            let next = inside + direction * step;
            if top - value(next) > DROP {
                break next;
            }
            if (next - best).abs() > 1e3 * std {
                return direction * f64::INFINITY;
            }
            inside = next;
            step *= 1.6;
        };
        while (outside - inside).abs() > TOLERANCE * std {
            let middle = 0.5 * (inside + outside);
            if top - value(middle) > DROP {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        0.5 * (inside + outside)
    });
    (best, std, ends)
}
