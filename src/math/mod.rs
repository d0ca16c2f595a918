//! Floor 0: numerics that know nothing of gyros.

pub mod random;
pub mod robust;
