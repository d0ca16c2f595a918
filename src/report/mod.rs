//! Floor 6: what people and programs read: text, JSON, pictures.

pub mod fit;
mod numbers;

pub use fit::{FitReport, LogFacts, Verdict};
