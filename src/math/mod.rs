//! Floor 0: numerics that know nothing of gyros.

pub mod basis;
pub mod binned;
pub mod brent;
pub mod curvature;
pub mod dct;
pub mod distributions;
pub mod lattice;
pub mod legendre;
pub mod minimum_phase;
pub mod outlying;
pub mod phi;
pub mod random;
pub mod random_effects;
pub mod robust;
pub mod scan;
pub mod spectra;
pub mod whiteness;

/// Quantile 0.975 of the normal distribution: half width of a 95 % interval, in standard deviations.
pub const NORMAL_975: f64 = 1.959_963_984_540_054;
