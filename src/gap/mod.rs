//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.

pub mod answer;
pub mod believe;
pub mod bench;
pub mod clean;
pub mod diagnose;
pub mod evidence;
pub mod far;
pub mod findings;
pub mod frame;
pub mod free;
pub mod gaussian;
pub mod hypothesis;
pub mod judge;
pub mod layers;
pub mod lines;
pub mod parts;
pub mod place;
pub mod popcorn;
pub mod prepare;
pub mod search;
pub mod state_space;

pub use answer::Answer;
pub use diagnose::{Diagnosis, Options, diagnose};
