//! Floor 1: a log in memory, its blocks and their moments.

pub mod log;
pub mod moments;
pub mod slots;

pub use log::{Channel, Log, TimeAxis, names};
pub use moments::Moments;
