//! gyroid
#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod bias;
pub mod config;
pub mod error;
pub mod files;
pub mod ingest;
pub mod math;
pub mod navigate;
pub mod signal;
pub mod simulate;
pub mod units;
pub mod vehicle;

pub use error::{Error, ErrorKind, Result};
