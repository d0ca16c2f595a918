//! Starting values: every combination of rates on a logarithmic grid, each with its best amplitudes.

use super::{Samples, Shape, projection};
use crate::error::{Error, ErrorKind, Result};
use crate::math::lsq::{dot, norm};
use faer::Mat;

/// Which rates were tried before the refinement.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Slowest rate tried, in 1/unit of x.
    pub slowest_rate: f64,
    /// Fastest rate tried, in 1/unit of x.
    pub fastest_rate: f64,
    /// Rates on the logarithmic grid between them.
    pub rates: usize,
    /// Combinations of rates compared.
    pub combinations: usize,
    /// How many of the best were refined.
    pub refined: usize,
}

/// Over the record, the slowest decay tried falls by this part: slower ones look like straight lines.
const SLOWEST: f64 = 0.05;
/// Decay of the fastest rate tried from the first to the fourth place, as an exponent.
const FASTEST: f64 = 6.0;

/// Grid points by number of terms: some thousand combinations at most.
fn grid_points(terms: usize) -> usize {
    match terms {
        1 => 64,
        2 => 48,
        3 => 24,
        4 => 18,
        _ => 15,
    }
}

/// The best starts, as logarithms of the scaled rates, no two of them neighbours on the grid.
pub(super) fn starts(samples: &Samples, shape: Shape) -> Result<(Scan, Vec<Vec<f64>>)> {
    let points = grid_points(shape.terms);
    let mut places: Vec<f64> = samples.x.clone();
    places.dedup();
    let fourth = places[3.min(places.len() - 1)];
    let (slow, fast) = (SLOWEST.ln(), (FASTEST / fourth).clamp(10.0, 1e15).ln());
    let log_rates: Vec<f64> = (0..points).map(|k| slow + (fast - slow) * k as f64 / (points - 1) as f64).collect();

    let rates: Vec<f64> = log_rates.iter().map(|log| log.exp()).collect();

    // One QR turns the n samples into as many rows as there are columns: a combination then costs the same for any n.
    let lead = usize::from(shape.offset);
    let table = Mat::from_fn(samples.x.len(), lead + points + 1, |i, j| match j {
        0 if shape.offset => 1.0,
        j if j < lead + points => projection::decay(rates[j - lead], samples.x[i]),
        _ => samples.y[i],
    });
    let qr = table.qr();
    let triangle = qr.thin_R();
    let mut columns: Vec<Vec<f64>> = (0..triangle.ncols()).map(|j| triangle.col(j).iter().copied().collect()).collect();
    let mut rest = columns.pop().unwrap_or_default();
    let mut basis = Vec::new();
    if shape.offset {
        extend(&mut basis, &columns.remove(0));
        remove(&basis, &mut rest);
    }
    let mut search = Search { columns: &columns, terms: shape.terms, found: Vec::new(), chosen: Vec::new() };
    search.descend(&mut basis, &rest, 0);
    let mut found = search.found;
    if found.is_empty() {
        return Err(Error::new(ErrorKind::Numeric, super::INPUT, "no combination of rates has a finite fit")
            .hint("check the range of x and y"));
    }
    let combinations = found.len();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // local minima grow with the number of terms
    let most = 2 + 2 * shape.terms;
    let mut kept: Vec<&[usize]> = Vec::new();
    for (_, indices) in &found {
        let near = |other: &&[usize]| indices.iter().zip(*other).all(|(a, b)| a.abs_diff(*b) <= 1);
        if !kept.iter().any(near) {
            kept.push(indices);
        }
        if kept.len() == most {
            break;
        }
    }
    let scan = Scan {
        slowest_rate: slow.exp() / samples.x_span,
        fastest_rate: fast.exp() / samples.x_span,
        rates: points,
        combinations,
        refined: kept.len(),
    };
    Ok((scan, kept.iter().map(|indices| indices.iter().map(|&k| log_rates[k]).collect()).collect()))
}

/// Takes from `v` its parts along the orthonormal `basis`, twice: once leaves rounding where little remains.
fn remove(basis: &[Vec<f64>], v: &mut [f64]) {
    for _ in 0..2 {
        for q in basis {
            let part = dot(q, v);
            for (v, q) in v.iter_mut().zip(q) {
                *v -= part * q;
            }
        }
    }
}

/// Adds `column` to the orthonormal basis; false if it is dependent.
fn extend(basis: &mut Vec<Vec<f64>>, column: &[f64]) -> bool {
    let mut q = column.to_vec();
    remove(basis, &mut q);
    let length = norm(&q);
    if length.is_nan() || length <= 1e-13 * norm(column) {
        return false;
    }
    for v in &mut q {
        *v /= length;
    }
    basis.push(q);
    true
}

/// Depth-first over ascending combinations, so that the common part of neighbours is orthogonalised once.
struct Search<'a> {
    columns: &'a [Vec<f64>],
    terms: usize,
    found: Vec<(f64, Vec<usize>)>,
    chosen: Vec<usize>,
}

impl Search<'_> {
    fn descend(&mut self, basis: &mut Vec<Vec<f64>>, rest: &[f64], from: usize) {
        if self.chosen.len() == self.terms {
            self.found.push((dot(rest, rest), self.chosen.clone()));
            return;
        }
        for k in from..self.columns.len() {
            if !extend(basis, &self.columns[k]) {
                continue;
            }
            let mut left = rest.to_vec();
            remove(&basis[basis.len() - 1..], &mut left);
            self.chosen.push(k);
            self.descend(basis, &left, k + 1);
            self.chosen.pop();
            basis.pop();
        }
    }
}
