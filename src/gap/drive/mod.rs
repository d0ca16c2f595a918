//! The gap of a drive: which equation, which effect, how far.

pub mod alike;
mod along;
mod branch;
mod bursts;
pub mod candidates;
pub mod closest;
pub mod column;
pub mod correction;
mod covariates;
mod diagnose;
pub mod evidence;
mod explain;
pub mod far;
mod filter;
pub mod fit;
pub mod judge;
mod lag;
pub mod late;
pub mod model;
pub mod mounting;
mod navigating;
pub mod onset;
pub mod own;
pub mod pass;
mod pinpoint;
pub mod record;
mod ripple;
pub mod search;
mod several;
mod tangents;
mod twins;
mod unforced;

pub use diagnose::diagnose;
pub use explain::explain;
pub(in crate::gap) use explain::known_gain;
