//! Floor 6: what a fit becomes for others to read. Today the project's own configuration.

mod configuration;

pub use configuration::{ConfigurationOptions, configuration};
