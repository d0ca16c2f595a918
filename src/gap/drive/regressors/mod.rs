//! Columns for everything that may be missing from the model, and which of them readings cannot tell apart.

pub(crate) mod apparent_delays;
pub(crate) mod basis;
pub(crate) mod candidates;
pub(crate) mod common_delay;
pub(crate) mod practical_identifiability;
pub(crate) mod structural_identifiability;
