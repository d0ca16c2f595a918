//! Profile-likelihood intervals: all values that some choice of the other parameters makes nearly as good as the best.
//!
//! {θ : min over the rest of φ (S - S_min) ≤ κ}, φ(T) the factor of [`super::reach`], 1 under white noise. κ is chosen for each parameter so that near the minimum the interval
//! has the half width that the fitted noise gives it (the vertical adjustment of a working likelihood; Chandler and
//! Bate, Biometrika 94 (2007) 167); away from it the shape is the profile's own, lopsided where T is badly known.
//! Given T all is linear, so C1's and C2's profiles need a search in T alone.

use super::minimum::Minimum;
use super::reach::Reach;
use super::surface::Surface;
use crate::math::brent;

/// Points in T at which the profiles of C1 and C2 are looked at first.
const POINTS: usize = 12;
/// Ends of an interval are known to this part of ln T: more digits than anyone reads.
const PRECISION: f64 = 1e-6;

/// The set of ln T with φ (S - S_min) ≤ κ, as an interval; an end without a crossing is infinite.
fn feasible(p: &impl Surface, min: &Minimum, reach: &Reach, kappa: f64) -> [f64; 2] {
    let excess = |x: f64| reach.factor(x) * (p.rss(x) - min.linear.rss) - kappa;
    let grid: Vec<f64> = min.scan.iter().map(|s| s.0).collect();
    let best = min.time_constant.ln();
    let inside: Vec<bool> = min.scan.iter().map(|s| reach.factor(s.0) * (s.1 - min.linear.rss) <= kappa).collect();
    // outermost crossings: a second valley that is as deep belongs to the interval
    let crossing = |inner: f64, outer: f64| {
        let (a, b) = (inner.min(outer), inner.max(outer));
        brent::root(excess, a, b, PRECISION).map_or(inner, |f| f.x)
    };
    let low = match inside.iter().position(|&i| i) {
        Some(0) => f64::NEG_INFINITY,
        Some(i) if grid[i] < best => crossing(grid[i], grid[i - 1]),
        _ => {
            let outer = grid.iter().rev().find(|x| **x < best).copied();
            outer.map_or(f64::NEG_INFINITY, |outer| crossing(best, outer))
        }
    };
    let high = match inside.iter().rposition(|&i| i) {
        Some(i) if i + 1 == grid.len() => f64::INFINITY,
        Some(i) if grid[i] > best => crossing(grid[i], grid[i + 1]),
        _ => {
            let outer = grid.iter().find(|x| **x > best).copied();
            outer.map_or(f64::INFINITY, |outer| crossing(best, outer))
        }
    };
    [low, high]
}

/// Interval of T, s: (0, ∞) are the open ends.
pub(super) fn time_constant(p: &impl Surface, min: &Minimum, reach: &Reach, kappa: f64) -> [f64; 2] {
    feasible(p, min, reach, kappa).map(f64::exp)
}

/// A linear function of C1 and C2 (power-on clock) whose interval is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target {
    C1,
    C2,
}

/// Interval of C1 or C2 at power-on, rad/s.
pub(super) fn linear(p: &impl Surface, min: &Minimum, reach: &Reach, target: Target, kappa: f64) -> [f64; 2] {
    let grid = &min.scan;
    let [low, high] = feasible(p, min, reach, kappa);
    let open = high == f64::INFINITY;
    let (a, b) = (low.max(grid[0].0), high.min(grid[grid.len() - 1].0));
    let bound = |ln_t: f64, sign: f64| -> f64 {
        let (center, variance, excess) = conditional(p, min, target, ln_t);
        let room = (kappa - reach.factor(ln_t) * excess) * variance;
        center + sign * room.max(0.0).sqrt()
    };
    let best = min.time_constant.ln();
    let mut points: Vec<f64> = (0..POINTS).map(|i| a + (b - a) * (i as f64 + 0.5) / POINTS as f64).collect();
    points.push(best.clamp(a, b));
    points.sort_by(f64::total_cmp);
    let end = |sign: f64| -> f64 {
        let values: Vec<f64> = points.iter().map(|&x| sign * bound(x, sign)).collect();
        let Some(top) = (0..values.len()).max_by(|&i, &j| values[i].total_cmp(&values[j])) else { return f64::NAN };
        if open && top + 1 == points.len() && matches!(target, Target::C1) {
            return sign * f64::INFINITY;
        }
        let (from, to) = (if top == 0 { a } else { points[top - 1] }, points.get(top + 1).copied().unwrap_or(b));
        let refined = brent::minimum(|x| -sign * bound(x, sign), from, to, PRECISION).map(|f| sign * bound(f.x, sign));
        sign * refined.unwrap_or(f64::NEG_INFINITY).max(values[top])
    };
    [end(-1.0), end(1.0)]
}

/// Estimate of the target given T, its variance there for unit noise, and S - S_min.
fn conditional(p: &impl Surface, min: &Minimum, target: Target, ln_t: f64) -> (f64, f64, f64) {
    let time_constant = ln_t.exp();
    let l = p.linear_at(time_constant);
    // power-on parameters are (C1, C2) = (E c1, c2 + (1 - E) c1), E = exp(clock/T)
    let e = (p.clock_s() / time_constant).exp();
    let w = match target {
        Target::C1 => [e, 0.0],
        Target::C2 => [1.0 - e, 1.0],
    };
    let [[a, b], [_, d]] = p.inverse_normal(time_constant);
    // as a sum of squares: no rounding makes it negative
    let variance =
        if a > 0.0 { a * (w[0] + w[1] * b / a).powi(2) + w[1] * w[1] * (d - b * b / a) } else { w[1] * w[1] * d };
    let center = w[0] * l.c1 + w[1] * (l.c2 + p.reference());
    (center, variance, l.rss - min.linear.rss)
}
