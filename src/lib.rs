//! gyroid
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod bias;
pub mod config;
pub mod error;
pub mod files;
pub mod identify;
pub mod math;
pub mod report;
pub mod signal;
pub mod units;
pub mod validate;

pub use error::{Error, ErrorKind, Result};
