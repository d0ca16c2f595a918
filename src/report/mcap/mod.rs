//! One MCAP of a command's results, for Foxglove, Rerun and ROS: sensors and poses as ROS 2 messages in CDR, innovations,
//! bands and the verdict in protobuf.
//!
//! Format: mcap.dev/spec, in chunks with an index, compressed by LZ4. A message's log time is the time of its log; a log that
//! begins before zero is shifted to begin there, since the format has no negative times.

mod drive;
pub(crate) mod fixed;
mod gap;
mod layout;
mod message;
pub(crate) mod messages;
mod noise;
mod protobuf;
mod recording;
#[cfg(test)]
mod tests;

pub(crate) use drive::DriveRecording;
pub(crate) use gap::GapRecording;
pub(crate) use layout::{Shown, layout};
pub(crate) use noise::NoiseRecording;
#[cfg(feature = "ros2")]
pub(crate) use recording::{Stream, Topic};
