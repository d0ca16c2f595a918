//! Floor 0: numerics that know nothing of gyros.

pub mod brent;
pub mod expsum;
pub mod legendre;
pub mod lsq;
pub mod random;
pub mod robust;
pub mod spectra;
pub mod whiteness;
