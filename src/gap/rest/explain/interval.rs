//! Estimates with their intervals, and the maximum of a smooth function with its curvature.

use crate::math::NORMAL_975;
use crate::math::curvature::curvature;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// A parameter and how well the recording knows it, in the unit of its name.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Posterior mode.
    pub estimate: f64,
    /// Standard deviation.
    pub std: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

impl Estimate {
    /// With an interval symmetric in the logarithm where the parameter is `positive` by nature, else about the estimate.
    pub(super) fn normal(estimate: f64, std: f64, positive: bool) -> Self {
        let ci95 = if positive && estimate > 0.0 {
            let factor = (NORMAL_975 * std / estimate).exp();
            [estimate / factor, estimate * factor]
        } else {
            [estimate - NORMAL_975 * std, estimate + NORMAL_975 * std]
        };
        Self { estimate, std, ci95 }
    }
}

/// The maximum of `f` near `x` by Newton's method with differences of `steps`: where it is, and the inverse of the
/// curvature there; none where it does not curve downwards in all directions.
pub(super) fn maximum(f: impl Fn(&[f64]) -> f64, x: &mut [f64], steps: &[f64]) -> Option<DMatrix<f64>> {
    /// Most Newton steps, and the gain of ln p that ends them, nats.
    const ROUNDS: usize = 30;
    const FAR_ENOUGH: f64 = 1e-4;
    let d = x.len();
    let mut best = f(x);
    let mut damping = 1e-3;
    for round in 0..=ROUNDS {
        let (gradient, curved) = curvature(&f, x, best, steps);
        let (gradient, curvature) = (DVector::from_vec(gradient), DMatrix::from_row_slice(d, d, &curved));
        let mut gained = 0.0;
        for _ in 0..10 {
            let damped = DMatrix::from_fn(d, d, |i, j| {
                let extra = if i == j { damping * curvature[(i, i)].abs().max(1e-6) } else { 0.0 };
                curvature[(i, j)] + extra
            });
            let next: Option<Vec<f64>> = damped.cholesky().map(|c| {
                let by = c.solve(&gradient);
                x.iter().zip(by.iter()).map(|(x, b)| x + b.clamp(-1.0, 1.0)).collect()
            });
            let value = next.as_deref().map_or(f64::NEG_INFINITY, &f);
            if value > best
                && let Some(next) = next
            {
                x.copy_from_slice(&next);
                gained = value - best;
                best = value;
                damping *= 0.2;
                break;
            }
            damping = (damping * 8.0_f64).max(1e-3);
        }
        if gained < FAR_ENOUGH || round == ROUNDS {
            return curvature.cholesky().map(|c| c.inverse());
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_has_its_maximum_and_covariance() {
        let f = |x: &[f64]| -0.5 * ((x[0] - 1.0).powi(2) / 4.0 + (x[1] - 0.5 * x[0]).powi(2));
        let mut x = [0.0, 0.0];
        let covariance = maximum(f, &mut x, &[0.1, 0.1]).unwrap();
        // a ten-thousandth of a nat: a hundredth of the standard deviations
        assert!((x[0] - 1.0).abs() < 0.02 && (x[1] - 0.5).abs() < 0.02, "{x:?}");
        // x0 ~ N(1, 4), x1 = x0/2 + N(0, 1)
        for (at, v) in [((0, 0), 4.0), ((1, 1), 2.0), ((0, 1), 2.0)] {
            assert!((covariance[at] - v).abs() < 1e-6, "{covariance}");
        }
    }

    #[test]
    fn a_positive_parameter_has_a_positive_interval() {
        let e = Estimate::normal(2.0, 3.0, true);
        assert!(e.ci95[0] > 0.0 && (e.ci95[0] * e.ci95[1] - 4.0).abs() < 1e-12);
        let e = Estimate::normal(2.0, 3.0, false);
        assert!(e.ci95[0] < 0.0 && (e.ci95[0] + e.ci95[1] - 4.0).abs() < 1e-12);
    }
}
