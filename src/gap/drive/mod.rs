//! The gap of a drive: which equation, which effect, how far.

mod diagnose;
pub mod ekf;
mod explain;
pub mod fit;
pub(crate) mod holdout;
pub mod model_selection;
pub mod options;
pub mod preprocess;
pub mod record;
pub mod regressors;
pub mod screening;
mod trail;

pub use diagnose::diagnose;
pub use explain::explain;
pub(in crate::gap) use explain::known_gain;
