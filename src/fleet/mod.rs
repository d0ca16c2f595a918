//! Floor 6: the gap of many robots: each drive by itself, and which effect is the fleet's and which is one robot's
//!
//! [`diagnose_all`] makes one [`DriveRow`] a recording, some at a time, and takes over rows of an earlier run. The effects that any of them names
//! are then fitted together to every recording ([`crate::gap::explain`]), also where they were not named: what is weak in each can be strong in
//! all. [`over_robots`] weighs these sizes: in how many robots the effect is, in which, how large, and how much they differ.

mod effects;
mod row;
mod run;
mod share;

pub(crate) use effects::{FleetEffect, HAS, Reach, over_robots};
pub(crate) use row::DriveRow;
pub(crate) use run::{Fleet, diagnose_all, named};
