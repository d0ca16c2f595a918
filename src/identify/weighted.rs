//! Generalised least squares where the bias walks: y = C1 g(t; T) + C2 + w + ε, w a random walk of K², ε white.
//!
//! Plain least squares follow a walk that comes as far as the warm-up is large: in a log of weeks they find the slow
//! wave of the walk, and not the minutes of the warm-up. Weighed by the inverse of the noise's covariance the first
//! minutes count as what they are, the walk having had no time (Aitken, Proc. R. Soc. Edinburgh 55 (1935) 42). The sums are those
//! of groups of samples whose lengths grow with time; the ratio K²/σ² is the mode of the restricted likelihood over
//! the ratios of `noise`, T at its best for each.

use super::minimum::{Minimum, Termination};
use super::noise::{self, Member, NoiseFit, ratios, regress, whiten};
use super::projection::{BlockSum, Projection};
use super::search::{lattice, pivot};
use super::surface::{Linear, Surface};
use crate::math::brent;
use nalgebra::DVector;

/// Turns of ratio and T at most; a second one corrects the grid's T, a third finds nothing left to do.
const TURNS: u32 = 5;

/// The weighed sum of squares.
pub(super) struct Weighted<'a, 'm> {
    p: &'a Projection<'m>,
    ratio: f64,
}

/// The weighed fit and the noise that goes with it.
pub(super) struct WeightedFit<'a, 'm> {
    pub surface: Weighted<'a, 'm>,
    pub minimum: Minimum,
    pub noise: NoiseFit,
}

/// Means of the groups: y less the given terms, and the free columns g, 1.
fn series(p: &Projection, groups: &[BlockSum]) -> Vec<Vec<f64>> {
    let given = |g: &BlockSum| p.c1.map_or(0.0, |c1| c1 * g.g / g.n) + p.c2.map_or(0.0, |c2| c2 - p.moments.reference);
    let mut out = vec![groups.iter().map(|g| g.y / g.n - given(g)).collect()];
    let [free_c1, free_c2] = p.free();
    if free_c1 {
        out.push(groups.iter().map(|g| g.g / g.n).collect());
    }
    if free_c2 {
        out.push(vec![1.0; groups.len()]);
    }
    out
}

impl Surface for Weighted<'_, '_> {
    fn linear_at(&self, time_constant: f64) -> Linear {
        let groups = self.p.growing_groups(time_constant, noise::GROUPS);
        let white = whiten(&groups, &series(self.p, &groups), self.ratio);
        let given = [self.p.c1.unwrap_or(0.0), self.p.c2.map_or(0.0, |c2| c2 - self.p.moments.reference)];
        let Some(found) = regress(&white.columns) else {
            // so short a T leaves a constant to the groups
            let mut columns = white.columns;
            columns.drain(1..1 + usize::from(self.p.free()[0]));
            let found = regress(&columns);
            let c2 = found.as_ref().and_then(|f| f.coefficients.first().copied()).unwrap_or(given[1]);
            return Linear { c1: given[0], c2, rss: found.map_or(f64::INFINITY, |f| f.rss) };
        };
        let mut next = found.coefficients.iter().copied();
        let [c1, c2] = self.p.free();
        let mut place = |free: bool, given: f64| if free { next.next().unwrap_or(given) } else { given };
        Linear { c1: place(c1, given[0]), c2: place(c2, given[1]), rss: found.rss }
    }

    fn inverse_normal(&self, time_constant: f64) -> [[f64; 2]; 2] {
        let groups = self.p.growing_groups(time_constant, noise::GROUPS);
        let white = whiten(&groups, &series(self.p, &groups), self.ratio);
        let free = self.p.free();
        let place = [0, usize::from(free[0])];
        let inverse = regress(&white.columns).and_then(|r| noise::inverse(&r.normal));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| match &inverse {
                Some(m) if free[i] && free[j] => m[(place[i], place[j])],
                _ => 0.0,
            })
        })
    }

    fn clock_s(&self) -> f64 {
        self.p.clock_s()
    }

    fn reference(&self) -> f64 {
        self.p.moments.reference
    }
}

/// Fits with weights. `None` where the groups show no walk after all, or the parameters cannot be told apart.
pub(super) fn fit<'a, 'm>(p: &'a Projection<'m>, fixed_time_constant: Option<f64>) -> Option<WeightedFit<'a, 'm>> {
    let grid: Vec<f64> = match fixed_time_constant {
        Some(t) => vec![t.ln()],
        None => lattice(p),
    };
    // every second T and ratio: enough to weigh by
    let at: Vec<Vec<BlockSum>> = grid.iter().step_by(2).map(|x| p.growing_groups(x.exp(), noise::GROUPS)).collect();
    let mut ratio = best_ratio(p, &at)?;
    // what T between the grid's points leaves looks like a walk: the ratio and T are found in turns
    for turn in 1.. {
        let surface = Weighted { p, ratio };
        let minimum = minimum(&surface, &grid, fixed_time_constant.is_some());
        let noise = members(p, &minimum, fixed_time_constant.is_none(), ratio)?;
        let likeliest = noise.members.iter().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        let better = likeliest.walk_variance_rate / likeliest.white_variance;
        if !(better > 0.0) {
            return None;
        }
        if turn == TURNS || (better / ratio - 1.0).abs() < 0.01 {
            return Some(WeightedFit { surface, minimum, noise });
        }
        ratio = better;
    }
    None
}

/// Ratios K²/σ² up to where the walk hides the white noise between the shortest of the groups.
fn all_ratios(p: &Projection, groups: &[BlockSum]) -> Vec<(f64, f64)> {
    let shortest = groups.iter().map(|g| g.n).fold(f64::INFINITY, f64::min);
    ratios(p.moments.count as f64, p.moments.span_s, (p.moments.count as f64 / shortest) as usize)
}

/// The most probable ratio, T at its best for each. `None` if that is none.
fn best_ratio(p: &Projection, at: &[Vec<BlockSum>]) -> Option<f64> {
    let first = at.first()?;
    let columns: Vec<Vec<Vec<f64>>> = at.iter().map(|groups| series(p, groups)).collect();
    // y and 1 are the same at every T, unless C1 is given
    let flat: Vec<Vec<f64>> = columns.iter().flatten().cloned().collect();
    let each = columns[0].len();
    let freedom = first.len() as f64 - (each - 1) as f64;
    let score = |ratio: f64| -> f64 {
        let white = whiten(first, &flat, ratio);
        let best = white.columns.chunks_exact(each).filter_map(regress).min_by(|a, b| a.rss.total_cmp(&b.rss));
        best.map_or(f64::NEG_INFINITY, |r| {
            -0.5 * (freedom * (r.rss / freedom).max(f64::MIN_POSITIVE).ln() + white.ln_det + r.ln_det)
        })
    };
    let scored = all_ratios(p, first).into_iter().step_by(2).map(|(ratio, prior)| (ratio, prior.ln() + score(ratio)));
    let (ratio, _) = scored.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (ratio > 0.0).then_some(ratio)
}

/// The minimum over T.
fn minimum(surface: &Weighted, grid: &[f64], given: bool) -> Minimum {
    let at = |ln_t: f64, termination, scan| {
        let time_constant = ln_t.exp();
        Minimum { time_constant, linear: surface.linear_at(time_constant), termination, scan }
    };
    if given {
        return at(grid[0], Termination::Linear, Vec::new());
    }
    let scan: Vec<(f64, f64)> = grid.iter().map(|&x| (x, surface.rss(x))).collect();
    let best = (0..scan.len()).min_by(|&a, &b| scan[a].1.total_cmp(&scan[b].1)).unwrap_or(0);
    if best == 0 {
        return at(scan[0].0, Termination::TooFast, scan);
    }
    if best + 1 == scan.len() {
        return at(scan[best].0, Termination::StraightLine, scan);
    }
    // values alone know the minimum to half the digits: far more than the walk leaves known
    match brent::minimum(|x| surface.rss(x), scan[best - 1].0, scan[best + 1].0, 1e-8) {
        Some(f) => at(f.x, Termination::Converged { iterations: f.iterations, polish_steps: 0, last_step: 1e-8 }, scan),
        None => at(scan[best].0, Termination::StepLimit { last_step: scan[best + 1].0 - scan[best].0 }, scan),
    }
}

/// The mixture over the ratios, each with the covariance that it gives the weighed estimates: that of its own, and the
/// square of how far its own estimates lie from these.
fn members(p: &Projection, min: &Minimum, free_t: bool, ratio: f64) -> Option<NoiseFit> {
    let pivot = pivot(p, min, free_t);
    let groups = p.growing_groups(pivot, noise::GROUPS);
    let mut columns = series(p, &groups);
    let l = if pivot < min.time_constant { Weighted { p, ratio }.linear_at(pivot) } else { min.linear };
    columns[0] = groups.iter().map(|g| (g.y - l.c1 * g.g - l.c2 * g.n) / g.n).collect();
    if free_t {
        columns.push(groups.iter().map(|g| -l.c1 / pivot * g.d / g.n).collect());
    }
    let k = columns.len() - 1;
    let freedom = groups.len() as f64 - k as f64;
    if freedom < 1.0 {
        return None;
    }
    let mut members = Vec::new();
    let mut ln_weights = Vec::new();
    for (ratio, prior) in all_ratios(p, &groups) {
        let white = whiten(&groups, &columns, ratio);
        let Some(found) = regress(&white.columns) else { continue };
        let Some(inverse) = noise::inverse(&found.normal) else { continue };
        let variance = (found.rss / freedom).max(f64::MIN_POSITIVE);
        ln_weights.push(prior.ln() - 0.5 * (freedom * variance.ln() + white.ln_det + found.ln_det));
        let off = DVector::from_vec(found.coefficients);
        members.push(Member {
            weight: 0.0,
            white_variance: variance,
            walk_variance_rate: ratio * variance,
            covariance: inverse * variance + &off * off.transpose(),
        });
    }
    let inverse_normal = noise::inverse(&regress(&whiten(&groups, &columns, ratio).columns)?.normal)?;
    NoiseFit::weigh(members, &ln_weights, inverse_normal, freedom)
}
