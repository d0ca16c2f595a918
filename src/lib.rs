//! gyroid
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod bias;
pub mod config;
pub mod error;
pub mod files;
pub mod ingest;
pub mod math;
pub mod signal;
pub mod units;

pub use error::{Error, ErrorKind, Result};
