//! Floor 1: a log in memory, its blocks and their moments.

pub mod log;

pub use log::{Channel, Log, TimeAxis, names};
