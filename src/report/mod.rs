//! Floor 6: what people and programs read: text, JSON, pictures, pages.

mod check;
mod colour;
mod explain;
mod figure;
pub(crate) mod fit;
mod fleet;
mod gap;
pub(crate) mod html;
mod levels;
pub(crate) mod mcap;
mod noise;
mod noise_table;
mod numbers;
mod plan;
pub(crate) mod plot;
mod population;
mod power;
mod study;
mod temperature;
mod track;
mod twin;

pub(crate) use check::ModelCheck;
pub(crate) use explain::ExplainReport;
pub(crate) use figure::fit_picture;
pub use fit::{FitReport, LogFacts, Verdict};
pub(crate) use fleet::FleetReport;
pub(crate) use gap::GapReport;
pub(crate) use noise::NoiseReport;
pub(crate) use noise_table::NoiseTableReport;
pub(crate) use plan::PlanReport;
pub(crate) use population::PopulationReport;
pub(crate) use power::PowerReport;
pub(crate) use study::StudyReport;
pub(crate) use track::TrackReport;
pub(crate) use twin::TwinReport;
