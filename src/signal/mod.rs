//! Floor 1: a log in memory, its blocks and their moments.

pub mod clock;
pub mod log;
pub mod moments;
pub mod slots;
pub mod ticks;

pub use clock::{increasing_times, since_power_on};
pub use log::{Channel, Log, TimeAxis, names};
pub use moments::Moments;
pub use ticks::tick_speeds_rad_s;
