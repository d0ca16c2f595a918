//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.

pub mod answer;
pub mod believe;
pub mod bench;
pub mod calibration;
mod clean;
mod compose;
pub mod diagnose;
pub mod drive;
mod evidence;
pub mod explain;
mod extend;
pub mod far;
pub mod findings;
mod frame;
mod free;
mod gaussian;
mod hypothesis;
mod judge;
mod known;
mod layers;
mod lines;
mod parts;
pub mod place;
mod popcorn;
pub mod prepare;
mod search;
pub mod state_space;

pub use answer::Answer;
pub use calibration::Calibration;
pub use diagnose::{Diagnosis, Drive, Options, Stage, compare, diagnose, diagnose_drives, diagnose_observed};
pub use explain::explain;
pub use judge::Options as JudgeOptions;
pub use known::known_gain;
pub use search::Prior;
