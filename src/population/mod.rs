//! Floor 4: many logs at rest: one row a log, gyro and axis, and how much C1, C2 and T differ from log to log
//!
//! ```text
//! y_i ~ N(μ, s_i² + τ²)      y = C2, C1 or ln T of log i, s_i its own standard deviation, τ the population's
//! ```
//!
//! [`find()`] lists the logs of folders, [`analyse_all`] works on them, some at a time, and takes over the [`Row`]s of an earlier run;
//! [`results`] keeps the rows as Parquet or CSV, [`Shard`] deals logs out to several runs, [`read_merged`] makes their rows one table. [`track()`]
//! holds the last power-on of each unit against its earlier ones, and tells what is between power-ons, months, units and types
//! ([`FleetLevels`]). [`Population`] is what they have in common: τ of C2 is the turn-on
//! repeatability, τ of C1 and ln T together that of the warm-up (`crate::math::random_effects`); logs that are not of one population
//! with the others (`crate::math::outlying`) are named.

mod axis;
mod engine;
mod find;
mod history;
mod levels;
mod merge;
mod noise_row;
mod quantity;
pub(crate) mod results;
mod row;
mod run;
mod shard;
mod source;
mod statistics;
#[cfg(test)]
mod tests;
mod track;
mod variance_prior;
mod warm_up;

pub(crate) use axis::AxisChoice;
pub(crate) use engine::{Done, Known, Origin, fault, run_all};
pub(crate) use find::find;
pub(crate) use levels::{Apart, Between, FleetLevels, FleetParameter, LEVEL as FLEET_LEVEL};
pub(crate) use merge::{Merged, read_merged};
pub(crate) use noise_row::{NoisePopulation, NoiseRow, NoiseTerms, noise_populations};
pub(crate) use row::Row;
pub(crate) use run::{Settings, Topics, analyse_all};
pub(crate) use shard::Shard;
pub(crate) use source::{Kind, Record, Source, failed};
pub(crate) use statistics::{Options, Parameter, Population};
pub(crate) use track::{Standing, Tracked, TrackedParameter, track};
pub(crate) use warm_up::WarmUp;
