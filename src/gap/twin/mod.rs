//! The twin: the model of ours that stands for a simulator of anybody's, identified from that simulator's log.
//!
//! Start values by instrumental variables on the integrated equations of motion (`start`), refinement by the likelihood of the
//! extended Kalman filter (`refine`), then the diagnosis of the log against what came out: what it names becomes part of the
//! twin, until it names nothing more. What is left is the simulator's *account*: what it has and our model has not. A recording is
//! judged against the twin, and its account less the simulator's is the gap (`difference`).

mod at_rest;
mod compared;
mod constants;
mod difference;
mod drives;
mod integrals;
mod levels;
mod pairs;
mod parameters;
mod quality;
mod refine;
mod regression;
mod start;
mod told;
mod unnamed;

pub use at_rest::twin_at_rest;
pub use compared::{Compared, Inherited, Said};
pub use difference::{compare_at_rest, compare_drives};
pub use drives::twin_of_drives;
pub use pairs::{Pair, paired};
pub use told::{ChannelFit, Parameter, Provenance, Twin, TwinEffect};
