//! Fits of the warm-up: the library on problems of known answers, and `gyroid fit` and `gyroid validate` on logs in memory
//! and in one pass, of one axis and of three, by time and by temperature.

mod axes;
mod command;
#[path = "../common/mod.rs"]
mod common;
mod fleet;
mod frames;
mod many;
mod nist;
mod properties;
mod stream;
mod temperature;
