//! Deficient equations of the nominal model, its discrepancy as a process, and the best single effect.

pub mod best_single_effect;
pub(crate) mod deficient_equations;
pub mod model_discrepancy;
