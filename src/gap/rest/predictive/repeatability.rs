//! min_β |d - X β|²,  |β_j| ≤ 3: what the stated repeatability of C2, C1 and T explains of a deviation
//!
//! X holds the derivatives of the warm-up times their stated standard deviations. A bound instead of a prior: a free fit
//! would take a ramp for another C1 and T, whatever they are said to vary by.

use crate::model::Scene;
use nalgebra::{DMatrix, DVector};

/// Largest deviation that counts as repeatability, standard deviations: among 39 simulated recordings hardly one has more.
const BOUND: f64 = 3.0;

/// The columns of X, and their products over the rows that were recorded.
pub(super) struct Repeatability {
    columns: Vec<Vec<f64>>,
    gram: DMatrix<f64>,
}

impl Repeatability {
    pub(crate) fn new(scene: &Scene, there: &[bool]) -> Self {
        let warm_up = &scene.warm_up;
        let relative = scene.warm_up_relative_std;
        let stds =
            [relative * warm_up.c1_rad_s.abs(), scene.turn_on_bias_std_rad_s, relative * warm_up.time_constant_s];
        let mut columns = vec![Vec::new(); 3];
        for (row, there) in there.iter().enumerate() {
            let gradient = warm_up.gradient(scene.time.at(row));
            for ((column, by), std) in columns.iter_mut().zip(gradient).zip(stds) {
                column.push(if *there { by * std } else { 0.0 });
            }
        }
        columns.retain(|c| c.iter().any(|v| *v != 0.0));
        let gram = DMatrix::from_fn(columns.len(), columns.len(), |i, j| dot(&columns[i], &columns[j]));
        Self { columns, gram }
    }

    /// Takes the explained part out of `deviation`; missing values stay missing.
    pub(crate) fn remove(&self, deviation: &mut [f64]) {
        let target: Vec<f64> = self.columns.iter().map(|c| dot_there(c, deviation)).collect();
        let beta = bounded(&self.gram, &DVector::from_vec(target));
        for (column, beta) in self.columns.iter().zip(&beta) {
            deviation.iter_mut().zip(column).for_each(|(d, x)| *d -= beta * x);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn dot_there(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).filter(|(_, y)| y.is_finite()).map(|(x, y)| x * y).sum()
}

/// Minimum of βᵀGβ/2 - bᵀβ with every |β_j| at most [`BOUND`]: of all ways to put coefficients at their bounds, the
/// feasible one with the smallest value (3³ systems at most).
fn bounded(gram: &DMatrix<f64>, target: &DVector<f64>) -> Vec<f64> {
    let n = target.len();
    let value = |beta: &DVector<f64>| 0.5 * beta.dot(&(gram * beta)) - target.dot(beta);
    let mut best = DVector::zeros(n);
    let mut least = 0.0;
    for ways in 0..3_usize.pow(n as u32) {
        let way = |j: usize| ways / 3_usize.pow(j as u32) % 3;
        let mut beta = DVector::from_fn(n, |j, _| match way(j) {
            0 => 0.0,
            1 => BOUND,
            _ => -BOUND,
        });
        let free: Vec<usize> = (0..n).filter(|j| way(*j) == 0).collect();
        if !free.is_empty() {
            let left = target - gram * &beta;
            let system = DMatrix::from_fn(free.len(), free.len(), |i, j| gram[(free[i], free[j])]);
            let right = DVector::from_fn(free.len(), |i, _| left[free[i]]);
            let Some(factor) = system.cholesky() else { continue };
            let solved = factor.solve(&right);
            free.iter().zip(solved.iter()).for_each(|(j, b)| beta[*j] = *b);
        }
        let v = value(&beta);
        if beta.iter().all(|b| b.abs() <= BOUND) && v < least {
            (best, least) = (beta, v);
        }
    }
    best.iter().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounded_minimum_satisfies_its_conditions() {
        // a strongly correlated system: the unbounded solution lies far outside
        let gram = DMatrix::from_row_slice(3, 3, &[1.0, 0.9, 0.2, 0.9, 1.0, 0.3, 0.2, 0.3, 1.0]);
        for target in [[5.0, -4.0, 0.3], [0.1, 0.2, -0.1], [-20.0, -20.0, 9.0]] {
            let beta = bounded(&gram, &DVector::from_row_slice(&target));
            let slope = &gram * DVector::from_vec(beta.clone()) - DVector::from_row_slice(&target);
            for (b, s) in beta.iter().zip(slope.iter()) {
                // at a bound the slope points outwards, inside it vanishes
                match *b {
                    b if b >= BOUND => assert!(*s <= 1e-12),
                    b if b <= -BOUND => assert!(*s >= -1e-12),
                    _ => assert!(s.abs() < 1e-10, "{beta:?} {slope}"),
                }
            }
        }
    }
}
