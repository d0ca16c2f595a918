//! y_k = μ + m + ε:  earlier power-ons of a gyro, of which those of one calendar month are alike
//!
//! ```text
//! Cov(y) = σ² V,   V = I + ρ J,   J_kl = 1 where k and l are of one month:   μ, slopes and predictions by generalised least squares
//! ```
//!
//! ρ is the variance between the months of a unit over that between the power-ons of a month. It comes from all gyros: σ² from within the months,
//! ρ where the sum of squares of the months' means about a line of each gyro has its mean (Paule and Mandel, J. Res. NBS 87 (1982) 377).
//! About lines, so that a gyro that drifts does not pass for one whose months differ. From three months on; else ρ is 0.

use super::variance_prior::VariancePrior;
use crate::math::mean;
use crate::math::random_effects::variance_where;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Fewest earlier power-ons against which one is held.
pub(super) const FEWEST: usize = 3;
/// Relative tolerance of ρ.
const TOLERANCE: f64 = 1e-6;

/// A power-on: when it was, in which month, its value and the standard deviation of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PowerOn {
    /// Days, or its number.
    pub at: f64,
    /// Number of the month, from 0; its own where dates are not known.
    pub month: usize,
    /// Value and standard deviation.
    pub seen: [f64; 2],
}

/// A value held against earlier ones.
pub(super) struct Held {
    /// Its prediction.
    pub expected: f64,
    pub half_width: f64,
    pub t: f64,
    pub degrees: f64,
    pub p_value: f64,
    pub outside: bool,
}

/// Power-ons with their V.
struct Correlated<'a> {
    all: &'a [PowerOn],
    rho: f64,
    /// V⁻¹ 1.
    weights: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<'a> Correlated<'a> {
    fn new(all: &'a [PowerOn], rho: f64) -> Self {
        let mut own = Self { all, rho, weights: Vec::new() };
        own.weights = own.solve(&vec![1.0; all.len()]);
        own
    }

    /// V⁻¹ a: of each month, a less ρ/(1 + ρ n) of its sum.
    fn solve(&self, a: &[f64]) -> Vec<f64> {
        let months = self.all.iter().map(|p| p.month + 1).max().unwrap_or(0);
        let mut sums = vec![[0.0; 2]; months];
        for (p, a) in self.all.iter().zip(a) {
            let [sum, n] = sums[p.month];
            sums[p.month] = [sum + a, n + 1.0];
        }
        let less = |p: &PowerOn| self.rho * sums[p.month][0] / (1.0 + self.rho * sums[p.month][1]);
        self.all.iter().zip(a).map(|(p, a)| a - less(p)).collect()
    }

    fn mean(&self, a: &[f64]) -> f64 {
        dot(&self.weights, a) / self.weights.iter().sum::<f64>()
    }

    fn of(&self, value: impl Fn(&PowerOn) -> f64) -> Vec<f64> {
        self.all.iter().map(value).collect()
    }

    /// Values less their mean.
    fn centred(&self, value: impl Fn(&PowerOn) -> f64) -> Vec<f64> {
        let values = self.of(value);
        let mean = self.mean(&values);
        values.into_iter().map(|v| v - mean).collect()
    }
}

/// Sum of squares of the values about their mean, weighted by V⁻¹, and its degrees of freedom.
pub(super) fn squares(all: &[PowerOn], rho: f64) -> (f64, f64) {
    let own = Correlated::new(all, rho);
    let left = own.centred(|p| p.seen[0]);
    (dot(&left, &own.solve(&left)), all.len() as f64 - 1.0)
}

/// `today` held against those of `earlier`; none where these are too few.
pub(super) fn held(earlier: &[PowerOn], today: &PowerOn, prior: &VariancePrior, rho: f64, level: f64) -> Option<Held> {
    if earlier.len() < FEWEST {
        return None;
    }
    let own = Correlated::new(earlier, rho);
    let left = own.centred(|p| p.seen[0]);
    let solved = own.solve(&left);
    // covariance of today's with the earlier ones
    let with = own.of(|p| if p.month == today.month { rho } else { 0.0 });
    let expected = own.mean(&own.of(|p| p.seen[0])) + dot(&with, &solved);
    let weight: f64 = own.weights.iter().sum();
    let unit = 1.0 + rho - dot(&with, &own.solve(&with)) + (1.0 - dot(&with, &own.weights)).powi(2) / weight;
    let (variance, degrees) = prior.moderated(dot(&left, &solved), earlier.len() as f64 - 1.0);
    // the variance holds the errors of the earlier estimates; a shorter log today errs by more
    let more = (today.seen[1].powi(2) - mean(earlier.iter().map(|p| p.seen[1].powi(2)))).max(0.0);
    let scale = (variance * unit + more).sqrt();
    let t = (today.seen[0] - expected) / scale;
    let (p_value, quantile) = student(t, degrees, level)?;
    Some(Held { expected, half_width: quantile * scale, t, degrees, p_value, outside: p_value < level })
}

/// Two-sided probability of as large a t, and its quantile at `level`.
fn student(t: f64, degrees: f64, level: f64) -> Option<(f64, f64)> {
    let law = StudentsT::new(0.0, 1.0, degrees).ok()?;
    Some((2.0 * law.sf(t.abs()), -law.inverse_cdf(0.5 * level))).filter(|(p, _)| p.is_finite())
}

/// Slope over time, its standard deviation and the probability of as steep a one by chance.
pub(super) fn slope(all: &[PowerOn], prior: &VariancePrior, rho: f64) -> Option<[f64; 3]> {
    let own = Correlated::new(all, rho);
    let [x, y] = [own.centred(|p| p.at), own.centred(|p| p.seen[0])];
    let weighted = own.solve(&x);
    let sxx = dot(&weighted, &x);
    let slope = dot(&weighted, &y) / sxx;
    let left: Vec<f64> = x.iter().zip(&y).map(|(x, y)| y - slope * x).collect();
    let (variance, degrees) = prior.moderated(dot(&left, &own.solve(&left)), all.len() as f64 - 2.0);
    let std = (variance / sxx).sqrt();
    let (p_value, _) = student(slope / std, degrees, 0.5)?;
    Some([slope, std, p_value])
}

/// ρ of the power-ons of all gyros.
pub(super) fn month_ratio<'a>(gyros: impl Iterator<Item = &'a [PowerOn]>) -> f64 {
    let (mut squares, mut degrees) = (0.0, 0.0);
    // time, value and number of power-ons of each month of each gyro
    let mut months: Vec<Vec<[f64; 3]>> = Vec::new();
    for all in gyros {
        let mut own: Vec<[f64; 3]> = Vec::new();
        for month in all.chunk_by(|a, b| a.month == b.month) {
            let [at, y] = [0, 1].map(|k| mean(month.iter().map(|p| if k == 0 { p.at } else { p.seen[0] })));
            squares += month.iter().map(|p| (p.seen[0] - y).powi(2)).sum::<f64>();
            degrees += month.len() as f64 - 1.0;
            own.push([at, y, month.len() as f64]);
        }
        months.push(own);
    }
    months.retain(|own| own.len() > 2);
    let target = months.iter().map(|own| own.len() as f64 - 2.0).sum::<f64>();
    if !(degrees > 0.0 && squares > 0.0 && target > 0.0) {
        return 0.0;
    }
    let variance = squares / degrees;
    let q = |rho: f64| {
        let all = months.iter().map(|own| about_a_line(own, rho));
        Some(all.fold([0.0; 2], |[q, by], [own, own_by]| [q + own / variance, by + own_by / variance]))
    };
    variance_where(q, target, 1.0, TOLERANCE).filter(|rho| rho.is_finite()).unwrap_or(0.0)
}

/// Squares of months about their line, weighted by 1/(1/n + ρ), and the derivative by ρ.
fn about_a_line(months: &[[f64; 3]], rho: f64) -> [f64; 2] {
    let weight = |m: &[f64; 3]| 1.0 / (1.0 / m[2] + rho);
    let sum: f64 = months.iter().map(weight).sum();
    let [x, y] = [0, 1].map(|k| months.iter().map(|m| weight(m) * m[k]).sum::<f64>() / sum);
    let sxx: f64 = months.iter().map(|m| weight(m) * (m[0] - x).powi(2)).sum();
    let slope = months.iter().map(|m| weight(m) * (m[0] - x) * (m[1] - y)).sum::<f64>() / sxx;
    months.iter().fold([0.0; 2], |[q, by], m| {
        let (w, left) = (weight(m), m[1] - y - slope * (m[0] - x));
        [q + w * left * left, by - (w * left).powi(2)]
    })
}
