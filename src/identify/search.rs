//! From no starting value to the minimum: logarithmic scan in T, Brent on the sum of squares, Brent on its
//! derivative, Gauss-Newton polish.

use super::minimum::{Minimum, Termination};
use super::projection::Projection;
use super::surface::Surface;
use crate::math::brent;

/// T is searched from a fraction of the sample time to far beyond the log.
pub(super) fn range(p: &Projection) -> (f64, f64) {
    let m = p.moments;
    let shortest = if m.step_s.is_finite() { 0.3 * m.step_s } else { 1e-3 };
    (shortest, 300.0 * (m.span_s + p.offset_s).max(m.step_s))
}

/// Points of the scan for each factor e of T: the sum of squares has no structure finer than that.
const PER_E_FOLD: f64 = 4.0;

/// Values of ln T that are looked at first.
pub(super) fn lattice(p: &Projection) -> Vec<f64> {
    let (low, high) = range(p);
    let n = ((high / low).ln() * PER_E_FOLD).ceil().max(8.0);
    (0..=n as usize).map(|i| low.ln() + (high / low).ln() * i as f64 / n).collect()
}

/// Finds the least-squares T and the parameters that go with it.
pub(super) fn minimum(p: &Projection, fixed_time_constant: Option<f64>) -> Minimum {
    let at = |time_constant: f64, termination, scan| {
        let linear = p.linear(&p.sums(time_constant, false));
        Minimum { time_constant, linear, termination, scan }
    };
    if let Some(time_constant) = fixed_time_constant {
        return at(time_constant, Termination::Linear, Vec::new());
    }
    let scan: Vec<(f64, f64)> = lattice(p).into_iter().map(|ln_t| (ln_t, p.rss(ln_t))).collect();
    let best = (0..scan.len()).min_by(|&a, &b| scan[a].1.total_cmp(&scan[b].1)).unwrap_or(0);
    if best == 0 {
        return at(scan[0].0.exp(), Termination::TooFast, scan);
    }
    if best == scan.len() - 1 {
        return at(scan[best].0.exp(), Termination::StraightLine, scan);
    }
    let (low, high) = (scan[best - 1].0, scan[best + 1].0);
    let coarse = brent::minimum(|x| p.rss(x), low, high, 1e-8);
    let mut ln_t = coarse.map_or(scan[best].0, |f| f.x);
    let mut iterations = coarse.map_or(0, |f| f.iterations);
    // values alone know the minimum to half the digits; the root of the derivative knows it to all
    for width in [1e-6, 1e-3, high - low] {
        let (a, b) = ((ln_t - width).max(low), (ln_t + width).min(high));
        if let Some(found) = brent::root(|x| p.slope(x), a, b, 0.0) {
            ln_t = found.x;
            iterations += found.iterations;
            break;
        }
    }
    let (ln_t, termination) = polish(p, ln_t, iterations);
    at(ln_t.exp(), termination, scan)
}

const POLISH_STEPS: u32 = 8;

/// Gauss-Newton in ln T with the linear parameters projected out (Kaufman's step): ln T, and how it ended.
fn polish(p: &Projection, start: f64, iterations: u64) -> (f64, Termination) {
    let mut ln_t = start;
    let mut last_step = f64::INFINITY;
    for step in 1..=POLISH_STEPS {
        let s = p.sums(ln_t.exp(), true);
        let l = p.linear(&s);
        let slope = l.c1 * (s.dy - l.c1 * s.gd - l.c2 * s.d);
        // squared norm of the part of ∂f/∂ln T that the free linear columns cannot follow
        let d = [s.gd, s.d];
        let curvature = l.c1 * l.c1 * (s.dd - projected(p, &s, d));
        let delta = -slope / curvature;
        if !(delta.is_finite() && delta.abs() < 1.0) {
            break;
        }
        ln_t += delta;
        let shrinks = delta.abs() < 0.5 * last_step;
        last_step = delta.abs();
        // at the rounding of the sums steps stop shrinking: there is nothing left to gain
        if last_step < 1e-14 || (!shrinks && last_step < 1e-9) {
            return (ln_t, Termination::Converged { iterations, polish_steps: step, last_step });
        }
    }
    if last_step < 1e-9 {
        (ln_t, Termination::Converged { iterations, polish_steps: POLISH_STEPS, last_step })
    } else {
        (ln_t, Termination::StepLimit { last_step })
    }
}

/// vᵀ (XᵀX)⁻¹ v over the free columns g, 1 with v = (gᵀd, 1ᵀd).
fn projected(p: &Projection, s: &super::projection::Sums, v: [f64; 2]) -> f64 {
    match p.free() {
        [true, true] => {
            let gg = s.gg - s.g * s.g / s.n;
            let gv = v[0] - s.g * v[1] / s.n;
            gv * gv / gg + v[1] * v[1] / s.n
        }
        [true, false] => v[0] * v[0] / s.gg,
        [false, true] => v[1] * v[1] / s.n,
        [false, false] => 0.0,
    }
}

/// T at which the model is linearised: at the end of the searched range C1 and T are one parameter, and the pivot lies
/// where they are still two.
pub(super) fn pivot(p: &Projection, min: &Minimum, free_t: bool) -> f64 {
    let longest = 10.0 * (p.moments.span_s + p.offset_s);
    if free_t { min.time_constant.min(longest) } else { min.time_constant }
}
