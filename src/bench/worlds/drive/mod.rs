//! log = sensors( ∫ robot(commanded torques, floor, effects) dt ): drives of real robots, for trying a diagnosis on
//!
//! The robot moves by equations of its own, integrated in steps of 1 ms at most, under a controller of its wheel speeds; each
//! of its effects is modelled otherwise than the textbook. What is different in it is one `World`; where nothing is,
//! its logs are those of the contract's nominal simulator.
//!
//! How strong an effect is, is said in nats as at rest, by a Kalman filter of the generator's own (`nats`).

mod body;
mod case;
pub(crate) mod catalogue;
mod effect;
mod grip;
mod keep;
mod listed;
mod machine;
mod nats;
mod record;
mod unlisted;
mod world;

pub(super) use case::make;
pub(crate) use catalogue::{LISTED, UNLISTED};

#[cfg(test)]
mod tests;
