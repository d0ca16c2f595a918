//! Sets of effects with their probabilities, the same for recordings at rest and drives.

pub mod findings;
pub mod sets;
mod trail;
