//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.

pub mod answer;
pub mod bench;

pub use answer::Answer;
