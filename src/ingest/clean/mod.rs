//! Time and rows of a log: the clock, the order of rows, gaps, and the audit of everything that is wrong.

pub(crate) mod audit;
pub(crate) mod clock;
pub(crate) mod coverage;
pub(crate) mod decimals;
pub(crate) mod findings;
pub(crate) mod motion;
pub(crate) mod quantization;
pub(crate) mod rows;
pub(crate) mod stream_audit;
