//! ẋ = f(x, u) + b,  z = h(x) + b,  db = s dW:   ŝ = argmax ln p(z | s),  b̂ = E(b | z, ŝ)
//!
//! Correction that an equation of the nominal model needs, before any effect is named: the process noise s, and the
//! course b̂ of the correction (Kristensen, Madsen and Jørgensen, Automatica 40, 2004, 225). b is a random walk in each
//! drive, linear between knots. The innovations of one pass of the filter are linear in b, so the likelihood for every
//! s follows from one Gram matrix.
//!
//! s = 0 leaves a constant. The test of s > 0 is a likelihood ratio on the boundary: half of it is χ² with one degree
//! of freedom, the other half zero (Self and Liang, J. Am. Stat. Assoc. 82, 1987, 605). For a single walk more than
//! half is zero (Crainiceanu and Ruppert, J. R. Stat. Soc. B 66, 2004, 165): the stated p-value is an upper bound.

use crate::gap::answer::{Against, Correction, Regressor};
use crate::gap::drive::ekf::innovations::run_scoped;
use crate::gap::drive::ekf::noise::Noise;
use crate::gap::drive::fit::models;
use crate::gap::drive::record::covariates::{Covariate, Knots};
use crate::gap::drive::record::{Record, covariates};
use crate::gap::drive::regressors::basis::{Column, Equation, Scoped, nuisances};
use crate::gap::drive::regressors::candidates::no_constant;
use crate::math::registers::free_upper_halves;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use statrs::function::erf::erfc;

/// Least time between knots, s.
const STEP_S: f64 = 1.0;
/// Most knots of all drives together.
const KNOTS: usize = 300;
/// Fewest knots of one drive.
const FEWEST: usize = 3;
/// Prior standard deviation of a level in units of the drive's own error of it: practically flat.
const LEVEL: f64 = 1e4;
/// Grid points of the walk's variance, and steps of the refinement about the best of them.
const GRID: usize = 240;
const REFINED: usize = 60;
/// Lowest grid point of the variance, as a share of the variance that would show.
const LEAST: f64 = 1e-4;
/// Share of a function's variance beside the others below which it counts as collinear and is not fitted.
const COLLINEAR: f64 = 1e-6;
/// Independent values of the signal needed for each fitted function.
const PER_FUNCTION: f64 = 3.0;

/// Estimated correction of `equation` of the nominal model; none where no reading determines it.
#[must_use]
pub(crate) fn of(record: &Record, noise: &Noise, equation: Equation) -> Option<Correction> {
    let knots = knots(record);
    let about_mean = has_own_level(record, equation);
    let smoother = Smoother::new(record, noise, equation, &knots, about_mean)?;
    let walk = Walk::new(&smoother)?;
    let (variance, gain) = walk.most_likely();
    let smoothed = smoother.smooth(variance)?;
    let degrees_of_freedom = walk.degrees_of_freedom(variance);
    let mut regressors = Vec::new();
    let mut against = None;
    if variance > 0.0 {
        let models = models(record, &[], &Vec::new(), false);
        let all = covariates::about(record, &models, noise, &knots);
        let mut shares: Vec<(f64, &Covariate)> =
            all.iter().map(|c| (smoothed.share(&smoother, c, degrees_of_freedom), c)).collect();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0));
        regressors = shares.iter().map(|(share, c)| Regressor { name: c.name.into(), share: *share }).collect();
        let best = shares.first().filter(|best| best.0 > 0.0);
        against = best.map(|(_, c)| Against { name: c.name.into(), unit: c.unit.into(), values: c.values.clone() });
    }
    let mut times_s = Vec::with_capacity(smoother.knots);
    let mut starts = Vec::with_capacity(knots.len());
    for (rows, knots) in record.drives().zip(&knots) {
        starts.push(times_s.len());
        times_s.extend((0..knots.count).map(|k| record.times_s[rows.start] + k as f64 * knots.step_s));
    }
    if starts.len() == 1 {
        starts.clear();
    }
    Some(Correction {
        diffusion: variance.sqrt(),
        unit: equation.unit().into(),
        gain_nats: gain,
        p_value: if variance > 0.0 { 0.5 * erfc(gain.max(0.0).sqrt()) } else { 1.0 },
        about_mean,
        degrees_of_freedom,
        times_s,
        starts,
        values: smoothed.values,
        std: smoothed.std,
        regressors,
        against,
    })
}

/// Knots of each drive, at even distances.
fn knots(record: &Record) -> Vec<Knots> {
    let spans = record.spans_s();
    let step_s = (spans.iter().sum::<f64>() / KNOTS.saturating_sub(2 * spans.len()).max(1) as f64).max(STEP_S);
    let of = |span: &f64| {
        let count = ((span / step_s).round() as usize + 1).max(FEWEST);
        Knots { step_s: (span / (count - 1) as f64).max(f64::MIN_POSITIVE), count }
    };
    spans.iter().map(of).collect()
}

/// Whether the level of an equation differs from run to run, or is confounded with another quantity.
fn has_own_level(record: &Record, equation: Equation) -> bool {
    let varies = |(scoped, _): &(Scoped, f64)| match scoped.column {
        Column::TurnOn => equation == Equation::Gyro,
        Column::Free(of, _) => {
            of == equation && matches!(of, Equation::PoseAlong | Equation::PoseAcross | Equation::PoseHeading)
        }
        _ => false,
    };
    no_constant(record, equation) || nuisances(record).iter().any(varies)
}

/// Normal equations of one pass in coordinates x: nuisances, the level of each drive, and the increments of the walk
/// from knot to knot about its mean, in units of √(time between them).
struct Smoother {
    /// Gram matrix of x.
    gram: Mat<f64>,
    /// Products of x with the innovations.
    moment: Mat<f64>,
    /// Products of x with the columns of the knots.
    with_knots: Mat<f64>,
    /// The signal at the knots as a linear function of x: knots by x.
    shown: Mat<f64>,
    /// Prior standard deviations of nuisances and levels.
    fixed: Vec<f64>,
    knots: usize,
}

impl Smoother {
    fn new(record: &Record, noise: &Noise, equation: Equation, knots: &[Knots], about_mean: bool) -> Option<Self> {
        let (mut columns, mut fixed): (Vec<Scoped>, Vec<f64>) = nuisances(record).into_iter().unzip();
        let n = columns.len();
        for (d, k) in knots.iter().enumerate() {
            columns.extend((0..k.count).map(|i| Column::Hat(equation, i as f64 * k.step_s, k.step_s).of_drive(d)));
        }
        let (all, drives) = (columns.len(), knots.len());
        let m = all - n;
        let summed = run_scoped(record, &models(record, &[], &Vec::new(), false), noise, &columns, |_| {});
        // columns by x
        let mut map = Mat::<f64>::zeros(all, n + drives + m - drives);
        (0..n).for_each(|i| map[(i, i)] = 1.0);
        let (mut row, mut step) = (n, n + drives);
        for (d, k) in knots.iter().enumerate() {
            for i in 0..k.count {
                map[(row + i, n + d)] = 1.0;
                for j in 1..k.count {
                    let after = if i >= j { 1.0 } else { 0.0 };
                    let mean = (k.count - j) as f64 / k.count as f64;
                    map[(row + i, step + j - 1)] = k.step_s.sqrt() * (after - mean);
                }
            }
            row += k.count;
            step += k.count - 1;
        }
        let gram = summed.gram.submatrix(0, 0, all, all);
        let innovations = summed.gram.submatrix(0, all, all, 1);
        let in_x = map.transpose() * (gram * &map);
        free_upper_halves();
        for d in 0..drives {
            let known = in_x[(n + d, n + d)];
            fixed.push(if known > 0.0 { LEVEL / known.sqrt() } else { 0.0 });
        }
        if fixed[n..].iter().all(|s| *s == 0.0) || !(0..in_x.ncols()).all(|i| in_x[(i, i)].is_finite()) {
            return None;
        }
        let mut shown = Mat::from_fn(m, map.ncols(), |i, j| map[(n + i, j)]);
        if about_mean {
            shown.submatrix_mut(0, n, m, drives).fill(0.0);
        }
        Some(Self {
            moment: map.transpose() * innovations,
            with_knots: map.transpose() * gram.submatrix(0, n, all, m),
            gram: in_x,
            shown,
            fixed,
            knots: m,
        })
    }

    /// The signal at the knots where the walk has this variance per s; none where the matrix is not positive definite.
    fn smooth(&self, variance: f64) -> Option<Smoothed> {
        let size = self.gram.ncols();
        let std: Vec<f64> = (0..size).map(|i| self.fixed.get(i).copied().unwrap_or(variance.sqrt())).collect();
        let scaled = Mat::from_fn(size, size, |i, j| std[i] * self.gram[(i, j)] * std[j] + f64::from(u8::from(i == j)));
        let factor = scaled.llt(Side::Lower).ok()?;
        let shown = Mat::from_fn(size, self.knots, |i, k| std[i] * self.shown[(k, i)]);
        let spread = factor.solve(&shown);
        free_upper_halves();
        let variance = |k: usize| (0..size).map(|i| shown[(i, k)] * spread[(i, k)]).sum::<f64>();
        let known = (0..self.knots).map(|k| variance(k).max(0.0).sqrt()).collect();
        let mut smoothed = Smoothed { std_of_x: std, spread, values: Vec::new(), std: known };
        smoothed.values = smoothed.of(&self.moment);
        Some(smoothed)
    }
}

/// The smoothed signal at the knots, and the smoother.
struct Smoothed {
    std_of_x: Vec<f64>,
    /// (I + U G U)⁻¹ U shown'
    spread: Mat<f64>,
    values: Vec<f64>,
    std: Vec<f64>,
}

impl Smoothed {
    /// Output of the smoother for innovations with this moment.
    fn of(&self, moment: &Mat<f64>) -> Vec<f64> {
        let size = self.std_of_x.len();
        let at = |k: usize| (0..size).map(|i| self.spread[(i, k)] * self.std_of_x[i] * moment[(i, 0)]).sum();
        (0..self.spread.ncols()).map(at).collect()
    }

    /// Share of the signal's variance, 0 to 1, that functions of a covariate explain, adjusted for their number.
    ///
    /// Each function is smoothed as the signal was, so that it is what the smoother shows of a correction that follows
    /// it exactly. Knots are weighted by the precision of the signal.
    fn share(&self, smoother: &Smoother, covariate: &Covariate, degrees_of_freedom: f64) -> f64 {
        let weights: Vec<f64> = self.std.iter().map(|s| if *s > 0.0 { s.powi(-2) } else { 0.0 }).collect();
        let total: f64 = weights.iter().sum();
        // about the mean, in units of the standard deviation
        let centred = |values: &[f64]| -> Vec<f64> {
            let mean = values.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>() / total;
            values.iter().zip(&weights).map(|(v, w)| (v - mean) * w.sqrt()).collect()
        };
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut left = centred(&self.values);
        let before = product(&left, &left);
        let most = (degrees_of_freedom / PER_FUNCTION).floor().max(1.0) as usize;
        let mut fitted: Vec<Vec<f64>> = Vec::new();
        for function in &covariate.functions {
            let values = Mat::from_fn(smoother.knots, 1, |k, _| function[k]);
            let mut own = centred(&self.of(&(&smoother.with_knots * values)));
            free_upper_halves();
            let whole = product(&own, &own);
            for other in &fitted {
                let along = product(&own, other);
                own.iter_mut().zip(other).for_each(|(o, f)| *o -= along * f);
            }
            let rest = product(&own, &own);
            if fitted.len() == most || !(rest > COLLINEAR * whole && rest > 0.0) {
                continue;
            }
            own.iter_mut().for_each(|o| *o /= rest.sqrt());
            let along = product(&left, &own);
            left.iter_mut().zip(&own).for_each(|(l, o)| *l -= along * o);
            fitted.push(own);
        }
        let free = degrees_of_freedom - fitted.len() as f64;
        if fitted.is_empty() || free <= 0.0 || !(before > 0.0) {
            return 0.0;
        }
        let unexplained = product(&left, &left) / before * degrees_of_freedom / free;
        (1.0 - unexplained).clamp(0.0, 1.0)
    }
}

/// ln p(z | s) - ln p(z | 0) = ½ Σ_i [s² β_i² / (1 + s² μ_i) - ln(1 + s² μ_i)]: likelihood ratio of the walk in the
/// eigenvectors of its information matrix, with nuisances and levels integrated out.
struct Walk {
    /// μ and β² of each eigenvector
    terms: Vec<[f64; 2]>,
}

impl Walk {
    fn new(smoother: &Smoother) -> Option<Self> {
        let (fixed, size) = (smoother.fixed.len(), smoother.gram.ncols());
        let steps = size - fixed;
        let std = &smoother.fixed;
        let (gram, moment) = (&smoother.gram, &smoother.moment);
        let inside = Mat::from_fn(fixed, fixed, |i, j| std[i] * gram[(i, j)] * std[j] + f64::from(u8::from(i == j)));
        let factor = inside.llt(Side::Lower).ok()?;
        let cross = Mat::from_fn(fixed, steps, |i, j| std[i] * gram[(i, fixed + j)]);
        let solved = factor.solve(&cross);
        let explained = cross.transpose() * &solved;
        let own = Mat::from_fn(steps, steps, |i, j| gram[(fixed + i, fixed + j)] - explained[(i, j)]);
        let level = Mat::from_fn(fixed, 1, |i, _| std[i] * moment[(i, 0)]);
        let explained = solved.transpose() * level;
        let left = Mat::from_fn(steps, 1, |i, _| moment[(fixed + i, 0)] - explained[(i, 0)]);
        let eigen = own.self_adjoint_eigen(Side::Lower).ok()?;
        let beta = eigen.U().transpose() * left;
        free_upper_halves();
        let mu = eigen.S().column_vector();
        let largest = (0..steps).map(|i| mu[i]).fold(0.0, f64::max);
        // eigenvalues that are rounding errors are dropped
        let terms: Vec<[f64; 2]> =
            (0..steps).filter(|i| mu[*i] > 1e-12 * largest).map(|i| [mu[i], beta[(i, 0)].powi(2)]).collect();
        (!terms.is_empty()).then_some(Self { terms })
    }

    fn gain(&self, variance: f64) -> f64 {
        let term = |[mu, square]: &[f64; 2]| variance * square / (1.0 + variance * mu) - (variance * mu).ln_1p();
        0.5 * self.terms.iter().map(term).sum::<f64>()
    }

    /// Most likely variance of the walk per s, and its gain over none, nats.
    fn most_likely(&self) -> (f64, f64) {
        // each term is largest at β²/μ² - 1/μ
        let highest = self.terms.iter().map(|[mu, square]| square / (mu * mu) - 1.0 / mu).fold(0.0, f64::max);
        let lowest = LEAST / self.terms.iter().map(|t| t[0]).fold(0.0, f64::max);
        if highest <= lowest {
            return (0.0, 0.0);
        }
        let step = (highest / lowest).ln() / (GRID - 1) as f64;
        let at = |i: f64| lowest * (step * i).exp();
        let best = (0..GRID).max_by(|a, b| self.gain(at(*a as f64)).total_cmp(&self.gain(at(*b as f64))));
        let Some(best) = best else { return (0.0, 0.0) };
        // ternary search between the neighbours of the best grid point
        let (mut low, mut high) = (best as f64 - 1.0, best as f64 + 1.0);
        for _ in 0..REFINED {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if self.gain(at(a)) < self.gain(at(b)) { low = a } else { high = b }
        }
        let variance = at(0.5 * (low + high));
        let gain = self.gain(variance);
        if gain > 0.0 { (variance, gain) } else { (0.0, 0.0) }
    }

    /// Effective degrees of freedom: the trace of the smoother.
    fn degrees_of_freedom(&self, variance: f64) -> f64 {
        self.terms.iter().map(|[mu, _]| variance * mu / (1.0 + variance * mu)).sum()
    }
}
