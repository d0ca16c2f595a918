//! Gaussian part of a recording at rest: coefficients and spectra in the cosine basis, and the search over sets of candidates.

pub(crate) mod add_term;
pub(crate) mod basis;
mod bounded;
pub(crate) mod evidence;
pub(crate) mod gaussian;
pub(crate) mod hypothesis;
pub(crate) mod lines;
pub(crate) mod memo;
pub(crate) mod nonparametric;
pub(crate) mod search;
