//! Sets of effects with their probabilities, the same for recordings at rest and drives.

pub mod findings;
pub(crate) mod leave_out;
pub(crate) mod prior;
pub(crate) mod search;
pub mod sets;
mod trail;
