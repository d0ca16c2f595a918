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
mod track;
mod validate;

pub(crate) use document::Origin;
pub(crate) use explain::explain_page;
pub(crate) use fit::fit_page;
pub(crate) use gap::gap_page;
pub(crate) use navigate::{DrivePage, drive_page};
pub(crate) use noise::noise_page;
pub(crate) use study::study_page;
pub(crate) use track::track_page;
pub(crate) use validate::validate_page;
