//! From no starting value to the minimum: logarithmic scan in T, Brent on the sum of squares, Brent on its
//! derivative, Gauss-Newton polish.

use super::projection::{Linear, Projection};
use crate::math::brent;
use serde::Serialize;

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "reason")]
pub enum Termination {
    /// A minimum inside the range of T: the last Gauss-Newton step was below the rounding of the sums.
    Converged {
        /// Iterations of both Brent searches.
        iterations: u64,
        /// Gauss-Newton steps of the polish.
        polish_steps: u32,
        /// Last relative step of T.
        last_step: f64,
    },
    /// The polish ended by its limit of steps; the last relative step of T says how far it still moved.
    StepLimit {
        /// Last relative step of T.
        last_step: f64,
    },
    /// The sum of squares falls towards ever longer T: a straight line fits as well.
    StraightLine,
    /// The sum of squares falls towards T = 0: a constant after the first sample fits as well.
    TooFast,
    /// T was given: the rest is linear.
    Linear,
}

impl Termination {
    /// Whether there is a minimum.
    #[must_use]
    pub fn converged(&self) -> bool {
        matches!(self, Self::Converged { .. } | Self::Linear)
    }
}

/// Result of the search, in the clock of the projection.
#[derive(Debug, Clone, Copy)]
pub(super) struct Minimum {
    pub time_constant: f64,
    pub linear: Linear,
    pub termination: Termination,
}

/// T is searched from a fraction of the sample time to far beyond the log.
pub(super) fn range(p: &Projection) -> (f64, f64) {
    let m = p.moments;
    let shortest = if m.step_s.is_finite() { 0.3 * m.step_s } else { 1e-3 };
    (shortest, 300.0 * (m.span_s + p.offset_s).max(m.step_s))
}

/// Points of the scan for each factor e of T: the sum of squares has no structure finer than that.
const PER_E_FOLD: f64 = 4.0;

/// The logarithmic grid in T, as ln T.
pub(super) fn grid(p: &Projection) -> Vec<f64> {
    let (low, high) = range(p);
    let n = ((high / low).ln() * PER_E_FOLD).ceil().max(8.0);
    (0..=n as usize).map(|i| low.ln() + (high / low).ln() * i as f64 / n).collect()
}

/// Finds the least-squares T and the parameters that go with it.
pub(super) fn minimum(p: &Projection, fixed_time_constant: Option<f64>) -> Minimum {
    if let Some(time_constant) = fixed_time_constant {
        let linear = p.linear(&p.sums(time_constant, false));
        return Minimum { time_constant, linear, termination: Termination::Linear };
    }
    let grid = grid(p);
    let rss: Vec<f64> = grid.iter().map(|&x| p.rss(x)).collect();
    let best = (0..grid.len()).min_by(|&a, &b| rss[a].total_cmp(&rss[b])).unwrap_or(0);
    let at = |ln_t: f64, termination| {
        let time_constant: f64 = ln_t.exp();
        Minimum { time_constant, linear: p.linear(&p.sums(time_constant, false)), termination }
    };
    if best == 0 {
        return at(grid[0], Termination::TooFast);
    }
    if best == grid.len() - 1 {
        return at(grid[best], Termination::StraightLine);
    }
    let (low, high) = (grid[best - 1], grid[best + 1]);
    let coarse = brent::minimum(|x| p.rss(x), low, high);
    let mut ln_t = coarse.map_or(grid[best], |f| f.x);
    let mut iterations = coarse.map_or(0, |f| f.iterations);
    // values alone know the minimum to half the digits; the root of the derivative knows it to all
    for width in [1e-6, 1e-3, high - low] {
        let (a, b) = ((ln_t - width).max(low), (ln_t + width).min(high));
        if let Some(found) = brent::root(|x| p.slope(x), a, b) {
            ln_t = found.x;
            iterations += found.iterations;
            break;
        }
    }
    polish(p, ln_t, iterations)
}

const POLISH_STEPS: u32 = 8;

/// Gauss-Newton in ln T with the linear parameters projected out (Kaufman's step).
fn polish(p: &Projection, start: f64, iterations: u64) -> Minimum {
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
            let termination = Termination::Converged { iterations, polish_steps: step, last_step };
            return Minimum { time_constant: ln_t.exp(), linear: p.linear(&p.sums(ln_t.exp(), false)), termination };
        }
    }
    let termination = if last_step < 1e-9 {
        Termination::Converged { iterations, polish_steps: POLISH_STEPS, last_step }
    } else {
        Termination::StepLimit { last_step }
    };
    Minimum { time_constant: ln_t.exp(), linear: p.linear(&p.sums(ln_t.exp(), false)), termination }
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
