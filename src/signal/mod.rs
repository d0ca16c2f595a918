//! Floor 1: a log in memory, its blocks and their moments; a log of any length, reduced in one pass.

pub(crate) mod clock;
mod course;
pub(crate) mod log;
pub mod moments;
pub(crate) mod reduced;
mod reducer;
pub(crate) mod slots;
pub(crate) mod ticks;

pub(crate) use clock::increasing_times;
pub use clock::since_power_on;
pub use course::{Course, bridged};
pub use log::{Channel, Log, TimeAxis, names};
pub use moments::Moments;
pub use reduced::{Coarse, Reduced, Stretch};
pub use reducer::{Limits, Reducer};
pub(crate) use ticks::tick_speeds_rad_s;
