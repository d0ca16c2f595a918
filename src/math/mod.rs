//! Floor 0: numerics that know nothing of gyros.

pub(crate) mod basis;
pub(crate) mod binned;
pub(crate) mod brent;
#[cfg(test)]
#[path = "../../tests/common/cases.rs"]
pub(crate) mod cases;
pub(crate) mod curvature;
pub(crate) mod dct;
pub(crate) mod distributions;
pub(crate) mod expression;
pub(crate) mod lattice;
pub(crate) mod legendre;
pub(crate) mod minimum_phase;
pub(crate) mod nested;
pub(crate) mod outlying;
pub(crate) mod phi;
pub mod random;
pub(crate) mod random_effects;
pub(crate) mod registers;
pub(crate) mod robust;
pub(crate) mod scan;
pub mod spectra;
pub mod whiteness;

/// Quantile 0.975 of the normal distribution: half width of a 95 % interval, in standard deviations.
pub(crate) const NORMAL_975: f64 = 1.959_963_984_540_054;

/// Mean of `values`; NaN where there are none.
#[must_use]
pub(crate) fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len();
    values.sum::<f64>() / n as f64
}
