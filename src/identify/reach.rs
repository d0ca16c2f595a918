//! φ(T) = v(T̂)/v(T): contribution of a random walk to S(T) - S_min, relative to its contribution next to the minimum
//!
//! If T is the truth, the sum of squares at T̂ is smaller by (u·y)² at most, u being the unit vector of g(T̂) less its part
//! along the columns at T: exactly so many squares does g(T̂) explain beside g(T) and 1. u·y has the variance
//! v(T) = σ² + K² Σ Δt s², s the sums of u from each time to the end, whatever C1 and C2 are. Under white noise that is the
//! same for every T. Under a walk it is not: a T̂ as long as a log of weeks follows the walk's own wave, and the minutes
//! of a warm-up, whose sum of squares lies far above, are not ruled out by it. Next to T̂ u is the direction of ∂g/∂T, and
//! v that of the covariance.

use super::minimum::Minimum;
use super::noise::{GROUPS, NoiseFit};
use super::projection::{BlockSum, Projection};

/// Below this part of its length what is left of g(T̂) is rounding, or T is T̂: the derivative stands for it.
const ROUNDING: f64 = 1e-9;

/// φ as a function of ln T.
pub(super) struct Reach {
    /// ln T, ascending, and ln φ.
    points: Vec<(f64, f64)>,
}

impl Reach {
    /// φ = 1: of a surface that is weighed by the walk already.
    pub(crate) fn alike() -> Self {
        Self { points: Vec::new() }
    }

    /// φ for plain least squares with its minimum at `min`, linearised at `pivot` (s), and for the noise of its
    /// residuals.
    pub(crate) fn new(p: &Projection, min: &Minimum, pivot: f64, noise: &NoiseFit) -> Self {
        let white = noise.mean(|m| m.white_variance);
        let walk = noise.mean(|m| m.walk_variance_rate);
        if !(walk > 0.0) || min.scan.is_empty() {
            return Self::alike();
        }
        let best = p.growing_groups(pivot, GROUPS);
        let variance = |ratio: f64| (white + walk * ratio).ln();
        let d: Vec<f64> = best.iter().map(|b| b.d / b.n).collect();
        let Some(here) = walked(p, &best, &d, 0.0).map(variance) else { return Self::alike() };
        let g: Vec<f64> = best.iter().map(|b| b.g / b.n).collect();
        let mut points: Vec<(f64, f64)> = min
            .scan
            .iter()
            // smooth: every second of them is enough
            .step_by(2)
            .map(|&(ln_t, _)| {
                let groups = p.growing_groups(ln_t.exp(), GROUPS);
                let there = walked(p, &groups, &g, ROUNDING).map_or(here, variance);
                (ln_t, here - there)
            })
            .collect();
        points.push((pivot.ln(), 0.0));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self { points }
    }

    /// φ at ln T.
    pub(crate) fn factor(&self, ln_t: f64) -> f64 {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return 1.0 };
        let at = self.points.partition_point(|x| x.0 < ln_t);
        if at == 0 {
            return first.1.exp();
        }
        if at == self.points.len() {
            return last.1.exp();
        }
        let (a, b) = (self.points[at - 1], self.points[at]);
        let share = if b.0 > a.0 { (ln_t - a.0) / (b.0 - a.0) } else { 0.0 };
        (a.1 + share * (b.1 - a.1)).exp()
    }
}

/// Σ Δt s² of the unit vector of `column` (group means) less its part along the columns of `groups`; `None` where less than
/// `least` of its length is left.
fn walked(p: &Projection, groups: &[BlockSum], column: &[f64], least: f64) -> Option<f64> {
    let dot = |a: &[f64], b: &[f64]| -> f64 { groups.iter().zip(a).zip(b).map(|((g, x), y)| g.n * x * y).sum() };
    let without = |u: &mut Vec<f64>, of: &[f64]| {
        let size = dot(of, of);
        if size > 0.0 {
            let along = dot(u, of) / size;
            u.iter_mut().zip(of).for_each(|(u, v)| *u -= along * v);
        }
    };
    let one = vec![1.0; groups.len()];
    let mut g: Vec<f64> = groups.iter().map(|b| b.g / b.n).collect();
    let [free_c1, free_c2] = p.free();
    let mut u = column.to_vec();
    let before = dot(&u, &u);
    if !free_c1 && least > 0.0 {
        // a given C1 leaves the difference of both curves
        u.iter_mut().zip(&g).for_each(|(u, g)| *u -= g);
    }
    // twice: once leaves what rounding brings back
    for _ in 0..2 {
        if free_c2 {
            without(&mut u, &one);
            without(&mut g, &one);
        }
        if free_c1 {
            without(&mut u, &g);
        }
    }
    let size = dot(&u, &u);
    if !(size > least * least * before) {
        return None;
    }
    let (mut tail, mut sum) = (0.0, 0.0);
    for i in (1..groups.len()).rev() {
        tail += groups[i].n * u[i];
        sum += (groups[i].mid_s - groups[i - 1].mid_s) * tail * tail;
    }
    Some(sum / size)
}
