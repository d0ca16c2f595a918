//! Floor 4: many logs at rest: one row a log, gyro and axis, and how much C1, C2 and T differ from log to log
//!
//! ```text
//! y_i ~ N(μ, s_i² + τ²)      y = C2, C1 or ln T of log i, s_i its own standard deviation, τ the population's
//! ```
//!
//! [`find()`] lists the logs of folders, [`fit_all`] fits them, some at a time, and takes over the [`Row`]s of an earlier run;
//! [`results`] keeps the rows as Parquet or CSV, [`Shard`] deals logs out to several runs, [`read_merged`] makes their rows one table. [`track()`]
//! holds the last power-on of each unit against its earlier ones. [`Population`] is what they have in common: τ of C2 is the turn-on
//! repeatability, τ of C1 and ln T together that of the warm-up (`crate::math::random_effects`); logs that are not of one population
//! with the others (`crate::math::outlying`) are named.

mod axis;
mod find;
mod merge;
pub(crate) mod results;
mod row;
mod run;
mod shard;
mod statistics;
#[cfg(test)]
mod tests;
mod track;
mod variance_prior;

pub(crate) use axis::AxisChoice;
pub(crate) use find::find;
pub(crate) use merge::{Merged, read_merged};
pub(crate) use row::Row;
pub(crate) use run::{Origin, Settings, Topics, fit_all};
pub(crate) use shard::Shard;
pub(crate) use statistics::{Options, Parameter, Population};
pub(crate) use track::{Standing, Tracked, TrackedParameter, track};
