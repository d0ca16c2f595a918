//! Floor 6: what people and programs read: text, JSON, pictures, pages.

mod check;
mod colour;
mod explain;
mod figure;
pub(crate) mod fit;
mod gap;
pub mod html;
mod noise;
mod numbers;
mod plan;
pub mod plot;
mod population;
mod power;
mod study;
mod temperature;
mod twin;

pub use check::ModelCheck;
pub use explain::ExplainReport;
pub use figure::fit_picture;
pub use fit::{FitReport, LogFacts, Verdict};
pub use gap::GapReport;
pub use noise::NoiseReport;
pub use plan::PlanReport;
pub use population::PopulationReport;
pub use power::PowerReport;
pub use study::StudyReport;
pub use twin::TwinReport;
