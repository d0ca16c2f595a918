//! Floor 1: a log in memory, its blocks and their moments; a log of any length, reduced in one pass.

pub mod clock;
mod course;
pub mod log;
pub mod moments;
pub mod reduced;
mod reducer;
pub mod slots;
pub mod ticks;

pub use clock::{increasing_times, since_power_on};
pub use course::{Course, bridged};
pub use log::{Channel, Log, TimeAxis, names};
pub use moments::Moments;
pub use reduced::{Coarse, Reduced, Stretch};
pub use reducer::{Limits, Reducer};
pub use ticks::tick_speeds_rad_s;
