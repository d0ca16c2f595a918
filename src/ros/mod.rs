//! Floor 6: the live correction as a ROS 2 node, over DDS in Rust, without a ROS installation.
//!
//! ```text
//!     imu/data_raw ──┐                                  ┌──► imu/data      corrected, with covariance
//!     joint_states ──┼──► take up ──► live::Corrector ──┼──► ~/bias        with its variance
//!     or odom      ──┤      one thread, no allocation   │
//!     temperature  ──┘                                  └──► keeper: /diagnostics, state file, reload, parameters
//!                                                            recorder: MCAP
//! ```
//!
//! What takes time (files, configurations, texts) is done by threads of their own, so that no sample waits for a disk.

mod diagnostics;
mod keeper;
mod messages;
mod node;
mod options;
mod parameters;
mod recorder;
mod report;
mod services;
#[cfg(test)]
mod tests;
mod wheels;
mod wires;

pub use node::run;
pub use options::{Axis, Gyro, Options, Signals, Topics};
