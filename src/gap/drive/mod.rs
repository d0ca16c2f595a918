//! The gap of a drive: which equation, which effect, how far.

mod branch;
mod bursts;
pub mod candidates;
pub mod closest;
pub mod column;
mod diagnose;
pub mod evidence;
pub mod far;
mod filter;
pub mod fit;
pub mod judge;
pub mod late;
pub mod model;
pub mod mounting;
mod navigating;
pub mod onset;
pub mod own;
pub mod pass;
mod pinpoint;
pub mod record;
pub mod search;
mod several;
mod tangents;

pub use diagnose::diagnose;
