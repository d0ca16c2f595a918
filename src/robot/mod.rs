//! Floor 2: what the description of a robot says of it: URDF, SDF or MJCF.
//!
//! Links, joints and shapes of all three come into one form; driven wheels are those that a plugin for differential drives
//! names, else joints that turn without end about a level axle and are called wheels or look like them. Of a robot with two
//! driven wheels, and of one that skids on several a side, mass, yaw inertia, track, wheel radius and wheel inertia follow,
//! each with its source. What is found to be true of the robot is written back into a copy.

mod chassis;
mod facts;
mod mjcf;
mod mjcf_defaults;
mod model;
mod patch;
mod patch_edits;
mod patch_mjcf;
mod patch_places;
mod patch_sdf;
mod patch_urdf;
mod plugin;
mod read;
mod sdf;
mod types;
mod urdf;
mod wheels;
mod xml;

pub(crate) use chassis::{Chassis, chassis};
pub(crate) use patch::{Finding, Patched, Truth, format_of, patch};
pub(crate) use read::{parse, read};
pub(crate) use types::{Choice, Fact, Format, Robot};

#[cfg(test)]
mod patch_tests;
#[cfg(test)]
mod tests;
