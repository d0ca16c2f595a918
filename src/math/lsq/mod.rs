//! min over c of |A c - y|², and min over p of |r(p)|²: small dense least squares by column-pivoted QR.
//!
//! The columns are scaled to unit length before they are factored, so that the units of the parameters decide
//! neither the rank nor the digits. No normal equations are formed.
//!
//! ```
//! use gyroid::math::lsq::polish;
//!
//! // y = exp(-p x), fitted to noise-free samples of p = 0.3
//! let data: Vec<(f64, f64)> = (0..20).map(|i| (f64::from(i), (-0.3 * f64::from(i)).exp())).collect();
//! let fit = polish(
//!     &[0.2],
//!     &mut |p, residual, jacobian| {
//!         residual.extend(data.iter().map(|(x, y)| (-p[0] * x).exp() - y));
//!         jacobian.push(data.iter().map(|(x, _)| -x * (-p[0] * x).exp()).collect());
//!     },
//!     30,
//! )?;
//! assert!(fit.termination.converged());
//! assert!((fit.parameters[0] - 0.3).abs() < 1e-14);
//! # Ok::<(), gyroid::Error>(())
//! ```

mod factor;
mod gauss_newton;

pub use factor::QrFactor;
pub use gauss_newton::{Polished, ResidualAndJacobian, Termination, polish};

use crate::error::Result;

/// A linear least-squares fit.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearFit {
    /// One coefficient a column; 0 for a column that depends on others (see [`LinearFit::dropped`]).
    pub coefficients: Vec<f64>,
    /// y - A c.
    pub residuals: Vec<f64>,
    /// Sum of the squared residuals.
    pub rss: f64,
    /// Number of independent columns.
    pub rank: usize,
    /// Columns that were left out because they depend on the others to rounding.
    pub dropped: Vec<usize>,
    /// F with (AᵀA)⁻¹ = F Fᵀ, one row a coefficient, one column an independent direction; rows of dropped columns
    /// are 0.
    pub covariance_factor: Vec<Vec<f64>>,
}

impl LinearFit {
    /// (AᵀA)⁻¹ of the columns that were kept; times the residual variance it is the covariance.
    #[must_use]
    pub fn inverse_normal(&self) -> Vec<Vec<f64>> {
        factor::outer(&self.covariance_factor)
    }
}

/// Fits `y` by the `columns`, each as long as `y`.
///
/// # Errors
/// As [`QrFactor::new`]; [`crate::ErrorKind::Value`] if `y` holds a value that is not finite,
/// [`crate::ErrorKind::Usage`] if its length is another.
pub fn solve_qr(columns: &[Vec<f64>], y: &[f64]) -> Result<LinearFit> {
    let factor = QrFactor::new(columns)?;
    let coefficients = factor.solve(y)?;
    let mut residuals = y.to_vec();
    for (column, c) in columns.iter().zip(&coefficients) {
        for (r, a) in residuals.iter_mut().zip(column) {
            *r -= c * a;
        }
    }
    let rss = dot(&residuals, &residuals);
    Ok(LinearFit {
        coefficients,
        residuals,
        rss,
        rank: factor.rank(),
        dropped: factor.dropped(),
        covariance_factor: factor.covariance_factor(),
    })
}

/// Inner product. Partial sums of 256 keep the rounding error of long series near that of pairwise summation.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.chunks(256).zip(b.chunks(256)).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()).sum()
}

/// Euclidean length, without overflow or underflow on the way.
#[must_use]
pub fn norm(a: &[f64]) -> f64 {
    if a.iter().any(|v| v.is_nan()) {
        return f64::NAN;
    }
    let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 || largest.is_infinite() {
        return largest;
    }
    if (1e-140..1e140).contains(&largest) {
        return dot(a, a).sqrt();
    }
    let scaled = a.chunks(256).map(|a| a.iter().map(|v| (v / largest).powi(2)).sum::<f64>()).sum::<f64>();
    largest * scaled.sqrt()
}

#[cfg(test)]
mod tests;
