//! Floor 5: the gap between the nominal simulator and a recording: where it lies, which effect causes it, how far it shrinks.

pub mod answer;
pub(crate) mod diagnose;
mod diagnosis;
pub mod drive;
mod explain;
pub mod holdout;
pub mod plan;
pub mod power;
pub mod rest;
pub mod selection;
pub mod trace;
pub mod twin;

pub use crate::gap::answer::calibration::Calibration;
pub use crate::gap::drive::holdout::traces::{DriveTraces, Trace, TraceCurve};
pub use crate::gap::holdout::oracle::known_gain;
pub use crate::gap::rest::explain::Explanations;
pub use crate::gap::rest::model_selection::Options as JudgeOptions;
pub use crate::gap::rest::whittle::search::Prior;
pub use answer::Answer;
pub(crate) use diagnose::compare;
pub use diagnose::{diagnose, diagnose_drives, diagnose_observed};
pub use diagnosis::{Diagnosis, Drive, Options, Stage};
pub use explain::explain;
