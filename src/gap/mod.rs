//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.

pub mod answer;
pub mod far;
pub mod state_space;

pub use answer::Answer;
