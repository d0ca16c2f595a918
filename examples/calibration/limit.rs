//! How well any interval of C1 or T can do where a log cannot tell a random walk from white noise.
//!
//! Linear in C1, C2 and T about the truth, white variance known, y = X β + noise of covariance V = 1 + K² W. A rule that shifts with
//! β sees two things: z, the part of y outside X, and β̂ - β, of which it does not know β. Under K the density of z is p_K, that of
//! b = β̂ - β given z a normal f_K(b | z). Of all rules that hold β with probability c under K and 0.95 under white noise, the
//! least expected width under white noise has (Pratt, J. Am. Stat. Assoc. 56 (1961) 549, with Lagrange's multipliers)
//!
//! ```text
//! {b: λ0 f_0(b | z) + λ1 p_K(z)/p_0(z) f_K(b | z) >= 1}
//! ```
//!
//! A rule for gyros of unknown K does no better at any one K, and with an unknown white variance none does.
//! Draws of z are by explicit seeds; given z all is integrated over b.

use crate::fit;
use gyroid::math::random::Stream;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};
use std::fmt::Write;

/// Groups of samples that the log is seen in.
const GROUPS: usize = 256;
/// Points in b are sinh of even steps from -LAST to LAST.
const POINTS: usize = 241;
const LAST: f64 = 5.5;
const TURNS: u32 = 24;
const LEVEL: f64 = 0.95;

/// The part of the residuals that a walk shows in, and how β̂'s error goes with it. Unit: K L / N = 1.
struct Linear {
    /// Variance of each z beyond 1.
    walk: DVector<f64>,
    /// Covariance of the errors of C1, C2 and T with each z.
    with: DMatrix<f64>,
    /// Their covariances by white noise and by the walk.
    white: DMatrix<f64>,
    walked: DMatrix<f64>,
}

impl Linear {
    /// A log of `length` time constants.
    fn new(length: f64) -> Self {
        let n = GROUPS;
        let age = |i: usize| length * (i as f64 + 0.5) / n as f64;
        let x = DMatrix::from_fn(n, 3, |i, j| [-(-age(i)).exp_m1(), 1.0, -age(i) * (-age(i)).exp()][j]);
        let qr = x.qr();
        let (q, r) = (qr.q(), qr.r());
        // R is 3 x 3 with a diagonal of which none is zero: the columns are independent
        let inverse = r.solve_upper_triangular(&DMatrix::identity(3, 3)).unwrap_or_else(|| DMatrix::zeros(3, 3));
        let w = DMatrix::from_fn(n, n, |i, j| (i.min(j) + 1) as f64 / (n * n) as f64);
        let outside = DMatrix::identity(n, n) - &q * q.transpose();
        let eigen = (&outside * &w * &outside).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        order.truncate(n - 3);
        let z = eigen.eigenvectors.select_columns(&order);
        Self {
            walk: DVector::from_iterator(n - 3, order.iter().map(|i| eigen.eigenvalues[*i])),
            with: &inverse * q.transpose() * &w * z,
            white: &inverse * inverse.transpose(),
            walked: &inverse * q.transpose() * &w * &q * inverse.transpose(),
        }
    }

    /// Standard deviation of the error of parameter `j` given all of y and K, over that by white noise.
    fn oracle(&self, j: usize, ratio: f64) -> f64 {
        let told: f64 =
            self.with.row(j).iter().zip(&self.walk).map(|(c, l)| (ratio * c).powi(2) / (1.0 + ratio * l)).sum();
        ((self.white[(j, j)] + ratio * self.walked[(j, j)] - told) / self.white[(j, j)]).sqrt()
    }
}

/// Draws of z under white noise, and the same numbers under the walk.
struct Pair {
    b: Vec<[f64; 2]>,
    white: Vec<f64>,
    /// p_K/p_0 f_K at each b, and f_K.
    draws: [Vec<(Vec<f64>, Vec<f64>)>; 2],
    /// Power of the best test of level 0.05 of white noise against the walk.
    power: f64,
}

fn normal(x: f64) -> f64 {
    (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
}

impl Pair {
    fn new(linear: &Linear, j: usize, walk: f64, draws: u64) -> Self {
        let ratio = walk * walk;
        let std = linear.oracle(j, ratio);
        let unit = linear.white[(j, j)].sqrt();
        let step = 2.0 * LAST / (POINTS - 1) as f64;
        let b: Vec<[f64; 2]> =
            (0..POINTS).map(|i| -LAST + step * i as f64).map(|u| [u.sinh(), step * u.cosh()]).collect();
        let of = |under_walk: bool| -> Vec<(f64, Vec<f64>, Vec<f64>)> {
            (0..draws)
                .into_par_iter()
                .map(|i| {
                    let mut draw = Stream::new(501_000 + i, 0);
                    let (mut shift, mut ln) = (0.0, 0.0);
                    for (l, c) in linear.walk.iter().zip(linear.with.row(j).iter()) {
                        let variance = 1.0 + ratio * l;
                        let z = draw.normal() * if under_walk { variance.sqrt() } else { 1.0 };
                        shift += ratio * c / variance * z / unit;
                        ln += 0.5 * (z * z * (1.0 - 1.0 / variance) - variance.ln());
                    }
                    let density: Vec<f64> = b.iter().map(|[b, _]| normal((b - shift) / std) / std).collect();
                    (ln, density.iter().map(|f| ln.exp() * f).collect(), density)
                })
                .collect()
        };
        let sets = [of(false), of(true)];
        let mut none: Vec<f64> = sets[0].iter().map(|d| d.0).collect();
        none.sort_by(f64::total_cmp);
        let limit = none[(LEVEL * none.len() as f64) as usize];
        let power = sets[1].iter().filter(|d| d.0 > limit).count() as f64 / draws as f64;
        let white = b.iter().map(|[b, _]| normal(*b)).collect();
        Self { b, white, draws: sets.map(|set| set.into_iter().map(|d| (d.1, d.2)).collect()), power }
    }

    /// Width under white noise over that of the interval that knows of no walk, coverage under white noise and under the walk.
    fn outcome(&self, [l0, l1]: [f64; 2]) -> [f64; 3] {
        let sum = |set: &[(Vec<f64>, Vec<f64>)], under_walk: bool| -> [f64; 2] {
            let one = |(weighed, density): &(Vec<f64>, Vec<f64>)| {
                let own = if under_walk { density } else { &self.white };
                let points = self.b.iter().zip(&self.white).zip(weighed).zip(own);
                points
                    .filter(|(((_, white), weighed), _)| l0 * **white + l1 * **weighed >= 1.0)
                    .fold([0.0; 2], |[width, held], ((([_, db], _), _), own)| [width + db, held + own * db])
            };
            let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
            set.par_iter().map(one).reduce(|| [0.0; 2], add).map(|s| s / set.len() as f64)
        };
        let [white, walk] = [sum(&self.draws[0], false), sum(&self.draws[1], true)];
        [white[0] / (2.0 * quantile()), white[1], walk[1]]
    }

    /// The best rule with this weight of the walk: as [`Self::outcome`].
    fn best(&self, l1: f64) -> [f64; 3] {
        let enough = |ln: f64| self.outcome([ln.exp(), l1])[1] >= LEVEL;
        let l0 = if self.outcome([0.0, l1])[1] >= LEVEL { 0.0 } else { bisect([-10.0, 3.0], enough).exp() };
        self.outcome([l0, l1])
    }

    /// The best rule at which `reached` first holds.
    fn where_first(&self, reached: impl Fn([f64; 3]) -> bool) -> [f64; 3] {
        self.best(bisect([-8.0, 10.0], |ln| reached(self.best(ln.exp()))).exp())
    }
}

fn quantile() -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * LEVEL)
}

/// Where `holds`, false on the left and true on the right, begins to hold.
fn bisect([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..TURNS {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}

/// The table.
pub fn table(draws: u64) -> gyroid::Result<String> {
    let mut out = String::from(
        "| log | | K L / N | test | K known | ours | at most | at least |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for (length, len) in [(6.0, 1800), (3.0, 900)] {
        let linear = Linear::new(length);
        let widths = fit::white_widths(draws, len)?;
        for (j, name) in [(0, "C1"), (2, "T")] {
            for walk in [3.0, 6.0, 12.0, 20.0, 30.0] {
                let pair = Pair::new(&linear, j, walk, draws);
                let [_, _, covered] = pair.where_first(|o| o[0] >= widths[j]);
                let [least, ..] = pair.where_first(|o| o[2] >= LEVEL);
                let (power, known) = (pair.power, linear.oracle(j, walk * walk));
                let _ = writeln!(
                    out,
                    "| {length} T | {name} | {walk} | {power:.2} | {known:.2} | {:.2} | {covered:.2} | {least:.2} |",
                    widths[j]
                );
            }
        }
    }
    Ok(out)
}
