//! r(θ) = (I - Φ Φ⁺) y with Φ = [1, exp(-e^θ₁ x), ...]: the fit as a function of the logarithms of the rates alone.
//!
//! Source: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413.

use super::{Samples, Shape};
use crate::error::Result;
use crate::math::lsq::{QrFactor, dot};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, storage::Owned};

/// Logarithms of rates beyond this are decays of one sample, or none at all; exponents beyond it are none.
const LOG_LIMIT: f64 = 700.0;

/// exp(-r x) of one rate. What would be below 1e-304 is 0: subnormal numbers take ten times as long.
pub(super) fn decay(rate: f64, x: f64) -> f64 {
    let exponent = rate * x;
    if exponent < LOG_LIMIT { (-exponent).exp() } else { 0.0 }
}

/// exp(-r x), one column a rate.
pub(super) fn decays(samples: &Samples, rates: &[f64]) -> Vec<Vec<f64>> {
    rates.iter().map(|r| samples.x.iter().map(|x| decay(*r, *x)).collect()).collect()
}

fn columns(samples: &Samples, shape: Shape, log_rates: &[f64]) -> Vec<Vec<f64>> {
    let rates: Vec<f64> = log_rates.iter().map(|t| t.exp()).collect();
    let mut columns = if shape.offset { vec![vec![1.0; samples.x.len()]] } else { Vec::new() };
    columns.extend(decays(samples, &rates));
    columns
}

/// The best offset (if there is one) and amplitudes for these rates.
pub(super) fn linear(samples: &Samples, shape: Shape, log_rates: &[f64]) -> Result<Vec<f64>> {
    QrFactor::new(&columns(samples, shape, log_rates))?.solve(&samples.y)
}

/// Levenberg-Marquardt from `start`: logarithms of the rates, ascending, and the sum of squares there. None where it left
/// the finite numbers.
pub(super) fn refine(samples: &Samples, shape: Shape, start: &[f64]) -> Option<(Vec<f64>, f64)> {
    let problem = Projection::new(samples, shape, DVector::from_column_slice(start));
    let (problem, report) = LevenbergMarquardt::new().with_tol(1e-10).with_patience(30).minimize(problem);
    let rss = 2.0 * report.objective_function;
    let mut log_rates: Vec<f64> = problem.log_rates.iter().copied().collect();
    log_rates.sort_by(f64::total_cmp);
    (rss.is_finite() && log_rates.iter().all(|t| t.abs() < LOG_LIMIT)).then_some((log_rates, rss))
}

/// The projected problem at one point; both faces of it share the factorisation.
struct Projection<'a> {
    samples: &'a Samples,
    shape: Shape,
    log_rates: DVector<f64>,
    state: Option<State>,
}

struct State {
    columns: Vec<Vec<f64>>,
    factor: QrFactor,
    residual: Vec<f64>,
}

impl<'a> Projection<'a> {
    fn new(samples: &'a Samples, shape: Shape, log_rates: DVector<f64>) -> Self {
        let mut problem = Self { samples, shape, log_rates: log_rates.clone(), state: None };
        problem.set_params(&log_rates);
        problem
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Projection<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, log_rates: &DVector<f64>) {
        self.log_rates.copy_from(log_rates);
        let clamped: Vec<f64> = log_rates.iter().map(|t| t.clamp(-LOG_LIMIT, LOG_LIMIT)).collect();
        let columns = columns(self.samples, self.shape, &clamped);
        self.state = QrFactor::new(&columns).ok().map(|factor| {
            let mut residual = self.samples.y.clone();
            factor.project_out(&mut residual);
            State { columns, factor, residual }
        });
    }

    fn params(&self) -> DVector<f64> {
        self.log_rates.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.state.as_ref().map(|state| DVector::from_column_slice(&state.residual))
    }

    /// ∂r/∂θ_k = -(I - ΦΦ⁺) φ'_k a_k - (Φ⁺)ᵀ_k (φ'_kᵀ r), with φ'_k = -r_k x exp(-r_k x).
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let State { columns, factor, residual } = self.state.as_ref()?;
        let linear = factor.solve(&self.samples.y).ok()?;
        let first = usize::from(self.shape.offset);
        let mut jacobian = DMatrix::zeros(residual.len(), self.shape.terms);
        for (k, mut out) in jacobian.column_iter_mut().enumerate() {
            let rate = self.log_rates[k].exp();
            let slope: Vec<f64> = columns[first + k].iter().zip(&self.samples.x).map(|(d, x)| -rate * x * d).collect();
            let along = dot(&slope, residual);
            let mut across: Vec<f64> = slope.iter().map(|s| s * linear[first + k]).collect();
            factor.project_out(&mut across);
            for ((out, across), dual) in out.iter_mut().zip(across).zip(factor.dual(first + k)) {
                *out = -across - along * dual;
            }
        }
        Some(jacobian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jacobian_agrees_with_differences() {
        let x: Vec<f64> = (0..30).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| (0.4 * x).sin() + (-0.2 * x).exp()).collect();
        for shape in [Shape { terms: 2, offset: true }, Shape { terms: 3, offset: false }] {
            let samples = Samples::new(&x, &y, shape).unwrap();
            let here = DVector::from_iterator(shape.terms, (0..shape.terms).map(|k| 0.3 + 1.1 * k as f64));
            let jacobian = Projection::new(&samples, shape, here.clone()).jacobian().unwrap();
            for k in 0..shape.terms {
                let h = 1e-5;
                let at = |d: f64| {
                    let mut shifted = here.clone();
                    shifted[k] += d;
                    Projection::new(&samples, shape, shifted).residuals().unwrap()
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let error = (difference - jacobian.column(k)).norm();
                assert!(error < 1e-7 * jacobian.column(k).norm(), "{shape:?} column {k}: {error}");
            }
        }
    }
}
