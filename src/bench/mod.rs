//! accuracy = right / asked, over recordings whose truth was sealed before the diagnosis saw them
//!
//! - [`make`]: cases of [`crate::bench::worlds`] in a folder, their labels sealed, a commitment to them in the open
//! - [`run`]: a diagnosis over every case that has no answer yet
//! - [`oracle()`]: the gain of an oracle that is told the effects
//! - [`score()`]: labels unsealed, the commitment checked, answers judged by the contract's rules
//! - [`calibrate()`]: temperature and prior odds under which the truth is most probable
//! - [`doubt()`]: how often answers are wrong whatever their evidence
//!
//! The labels are encrypted with a key that is not in the folder. The commitment is the SHA-256 of the labels with a
//! random salt: who has the commitment from before can tell afterwards that the labels are the same.

mod bands;
mod calibrate;
#[cfg(test)]
mod covered;
mod doubt;
mod folder;
mod intervals;
mod judge;
mod oracle;
mod runner;
mod score;
mod seal;
mod table;
mod workers;
pub(crate) mod worlds;

pub(crate) use calibrate::{Calibrated, Fit, calibrate, examples, prior_of};
pub(crate) use doubt::doubt;
pub(crate) use folder::{BENCH, Bench, Order, make};
pub(crate) use oracle::{OfOracle, oracle};
pub(crate) use runner::run;
pub(crate) use score::{Bin, Score, answers, judged, labels, left_out, score, seconds};
pub(crate) use seal::SealKey;

#[cfg(test)]
mod tests;
