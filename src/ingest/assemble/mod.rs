//! Recordings from tables: one axis of a gyro, held or read in bounded memory; a drive from one file or several.

pub(crate) mod drive;
pub(crate) mod inspect;
pub(crate) mod merge;
pub(crate) mod plan;
pub(crate) mod query;
pub(crate) mod recording;
pub(crate) mod stream;
