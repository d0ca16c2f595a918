//! Recordings at rest: the likelihood is Gaussian in frequency (Whittle) beside non-Gaussian features of the whitened series.

pub(crate) mod explain;
pub(crate) mod model_selection;
pub(crate) mod nongaussian;
pub(crate) mod parts;
pub mod predictive;
pub(crate) mod prepare;
pub(crate) mod state_space;
pub(crate) mod whittle;
