//! Floor 6: what people and programs read: text, JSON, pictures.

mod check;
pub mod fit;
mod numbers;

pub use check::ModelCheck;
pub use fit::{FitReport, LogFacts, Verdict};
