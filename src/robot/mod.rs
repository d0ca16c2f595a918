//! Floor 2: what the description of a robot says of it: URDF, SDF or MJCF.
//!
//! Links, joints and shapes of all three come into one form; driven wheels are those that a plugin for differential drives
//! names, else joints that turn without end about a level axle and are called wheels or look like them. Of a robot with two
//! driven wheels, and of one that skids on several a side, mass, yaw inertia, track, wheel radius and wheel inertia follow,
//! each with its source.

mod facts;
mod mjcf;
mod mjcf_defaults;
mod model;
mod plugin;
mod read;
mod sdf;
mod types;
mod urdf;
mod wheels;
mod xml;

pub use read::{parse, read};
pub use types::{Choice, Fact, Format, Robot};

#[cfg(test)]
mod tests;
