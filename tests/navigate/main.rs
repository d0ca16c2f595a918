//! The navigation filter on simulated and recorded drives, and `gyroid simulate` and `gyroid navigate` as a user runs
//! them.

mod augmented;
mod commands;
mod definite;
mod encoder_ticks;
mod filter;
mod fit_for_use;
#[path = "../common/place.rs"]
mod place;
mod real_drives;
mod sensors;
mod standstill;
mod warm_restart;
