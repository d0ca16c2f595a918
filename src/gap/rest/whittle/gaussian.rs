//! z ~ N(X β, diag S), β ~ N(0, diag P): ln p(z) = -½ [Σ ln 2πS + Σ z²/S - bᵀ A⁻¹ b + ln det A + ln det P]
//!
//! Computed by [`crate::math::binned`]: products of columns are stored, so that a spectrum costs a few hundred
//! multiplications.

use super::basis::{ColumnId, Data, SpectralBasis};
use super::memo::Memo;
pub(crate) use crate::math::binned::{Posterior, solve, spectral};
use std::sync::Arc;

/// Inner products of selected columns with each other and with the recording, by bins, for repeated evaluation.
pub(crate) struct Picked {
    gram: Vec<Arc<Vec<f64>>>,
    data: Vec<Arc<Vec<f64>>>,
}

/// Inner products of columns with one recording, by bins.
pub(crate) type DataProducts = Memo<ColumnId, Arc<Vec<f64>>>;

impl Picked {
    /// Selects `columns`; the columns `offsets` are subtracted from the recording.
    pub(crate) fn new(
        frame: &SpectralBasis,
        data: &Data,
        products: &DataProducts,
        columns: impl Iterator<Item = ColumnId>,
        offsets: &[ColumnId],
    ) -> Self {
        let ids: Vec<_> = columns.collect();
        let mut gram = Vec::with_capacity(ids.len() * (ids.len() + 1) / 2);
        for (i, a) in ids.iter().enumerate() {
            gram.extend(ids[..=i].iter().map(|b| frame.gram(*a, *b)));
        }
        let with_data = |c: &ColumnId| {
            let mut products = products.get(*c, || Arc::new(frame.with_data(*c, data)));
            for offset in offsets {
                let taken = frame.gram(*c, *offset);
                Arc::make_mut(&mut products).iter_mut().zip(taken.iter()).for_each(|(p, t)| *p -= t);
            }
            products
        };
        let data = ids.iter().map(with_data).collect();
        Self { gram, data }
    }

    /// XᵀS⁻¹X, lower triangle row by row, and XᵀS⁻¹z.
    pub(crate) fn normal(&self, inverse_spectrum: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let sum = |products: &Arc<Vec<f64>>| products.iter().zip(inverse_spectrum).map(|(g, w)| g * w).sum::<f64>();
        (self.gram.iter().map(sum).collect(), self.data.iter().map(sum).collect())
    }
}

/// Contribution of the columns to [`spectral`], coefficients integrated out; none where the matrix is not positive
/// definite.
pub(crate) fn columns(picked: &Picked, std: &[f64], inverse_spectrum: &[f64], full: bool) -> Option<Posterior> {
    solve(&picked.normal(inverse_spectrum), std, full)
}
