//! The gap of a drive: which equation, which effect, how far.

mod bursts;
pub mod candidates;
pub mod column;
pub mod evidence;
pub mod fit;
pub mod judge;
pub mod pass;
pub mod record;
pub mod search;
