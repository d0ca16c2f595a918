//! Results as one HTML file that needs nothing beside it: verdict first, then figures that zoom, tables that can be copied, and at
//! the end the command and the hashes of what it read.
//!
//! A page shows everything without its script, which only lets curves zoom and tells values under the pointer.

mod chart;
mod document;
mod explain;
mod fit;
mod gap;
mod ink;
mod navigate;
mod noise;
mod panel;
mod points;
mod study;
#[cfg(test)]
mod tests;
mod text;
mod traces;
mod validate;

pub use document::Origin;
pub use explain::explain_page;
pub use fit::fit_page;
pub use gap::gap_page;
pub use navigate::{DrivePage, drive_page};
pub use noise::noise_page;
pub use study::study_page;
pub use validate::validate_page;
