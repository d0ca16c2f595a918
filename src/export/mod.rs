//! Floor 6: results of a fit for other readers: the project's own configuration, and the files of other programs.
//!
//! N: angle random walk, rad/√s (the same as rad/s/√Hz); K: rate random walk, rad/s/√s; f: rate of the gyro, Hz; dt: step of
//! the target's filter, s; two-sided spectra throughout. A number goes out as the target's own code takes it; the derivation
//! stands at the top of the target's file. One file a target, one line in [`registry()`].

mod about;
mod configuration;
mod effects;
mod log_snippet;
mod noise;
mod number;
mod population;
mod ranges;
mod sheet;
mod source;
mod starter;
mod target;
mod targets;

pub use about::{About, Comment, Key};
pub use configuration::{ConfigurationOptions, configuration};
pub use log_snippet::{Snippet, log_snippet, on_log};
pub use noise::{NoiseOptions, check_origin, with_noise};
pub use number::digits;
pub(crate) use population::population_configuration;
pub(crate) use ranges::ranges;
pub use ranges::{Event, NoPlace, Observation, Range, Ranges};
pub use sheet::{LeftOut, Sheet, Written};
pub use source::{Options, Origin, Source};
pub use starter::Starter;
pub(crate) use starter::starter;
pub use target::{Export, Target, export};
pub use targets::{by_id, registry};
