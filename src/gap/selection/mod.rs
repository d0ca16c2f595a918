//! Sets of effects with their probabilities, the same for recordings at rest and drives.

pub(crate) mod findings;
pub(crate) mod leave_out;
pub(crate) mod prior;
pub(crate) mod search;
pub(crate) mod sets;
mod trail;
