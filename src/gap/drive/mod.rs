//! The gap of a drive: which equation, which effect, how far.

mod diagnose;
pub(crate) mod ekf;
mod explain;
pub(crate) mod fit;
pub(crate) mod holdout;
pub(crate) mod model_selection;
pub(crate) mod options;
pub(crate) mod preprocess;
pub(crate) mod record;
pub(crate) mod regressors;
pub(crate) mod screening;
mod trail;

pub(crate) use diagnose::diagnose;
pub(crate) use explain::explain;
pub(in crate::gap) use explain::known_gain;
