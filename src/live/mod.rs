//! Floor 4: the correction sample by sample, on a robot that runs.
//!
//! ```text
//!     rate = reading - b,   b = e(t) and what was learnt at rest of its deviation from e(t)
//! ```
//!
//! - [`Corrector`]: takes stamps, rates, wheel readings and temperatures; gives rate, bias, their standard deviations, NIS and flags
//! - [`Start`]: what is known at its first sample
//! - [`Saved`]: how warm the gyro was, over a restart
//!
//! The state and its equations are in `bias_filter`, the rule for rest and its false alarms in `rest`, the rule for stamps in
//! `clock`. A step allocates nothing. Nothing here knows of ROS or a network.
//!
//! ```
//! use gyroid::config::Config;
//! use gyroid::live::{Corrector, Settings, Start};
//!
//! let config = Config::parse(
//!     "schema = 1\n[gyro]\nc1_rad_s = -2.4e-3\nc2_rad_s = 8e-3\ntime_constant_s = 240.0\n\
//!      angle_random_walk_rad_sqrt_s = 1.5e-4\nturn_on_bias_std_rad_s = 2e-4\n",
//!     "gyroid.toml",
//! )?;
//! let start = Start { stamp_ns: 0, arrival_s: 0.0, ..Start::default() };
//! let (mut corrector, _notes) = Corrector::new(&config, Settings::default(), &start)?;
//! let got = corrector.sample(5_000_000, 0.005, 0.108);
//! assert!((got.rate_rad_s - 0.1).abs() < 1e-6);
//! # Ok::<(), gyroid::Error>(())
//! ```

mod bias_filter;
mod clock;
mod corrector;
mod nis;
mod rest;
mod saved;
#[cfg(test)]
mod tests;

pub use clock::Stamped;
pub use corrector::{Corrected, Corrector, Flags, Settings, Start};
pub use nis::NisSummary;
pub use saved::Saved;
