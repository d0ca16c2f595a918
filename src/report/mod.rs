//! Floor 6: what people look at.

pub mod plot;
