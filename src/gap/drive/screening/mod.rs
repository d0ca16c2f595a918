//! Deficient equations of the nominal model, its discrepancy as a process, and the best single effect.

pub(crate) mod best_single_effect;
pub(crate) mod deficient_equations;
pub(crate) mod model_discrepancy;
