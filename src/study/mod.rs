//! Floor 4: the paper's study: two filters, with and without slip, on simulated drives whose wheels slip.
//!
//! Alessandri et al., section 5: measurements from the model (5), the root mean square errors of both filters over 100
//! runs (figures 3 and 4), one run against its estimates (figures 5 to 7). Each run draws anew the torque noise, the
//! sensors' noise, and the gyro's turn-on inside its repeatability. Beside the two filters: both without the gyro's
//! error model, and dead reckoning.
//!
//! - [`study`]: the runs, and their statistics
//! - `run_errors`: one run
//! - [`by_ground`], [`wrong_beliefs`], `convergence`: studies that the paper leaves out
//!
//! Same setup, same numbers, on one thread or many: runs are drawn from their own seeds and summed in their order.

mod one_run;
mod setup;
mod statistics;
mod sweeps;

pub(crate) use one_run::step_costs;
pub(crate) use one_run::{RunErrors, run_errors};
pub(crate) use setup::{Estimator, QUANTITIES, Setup};
pub(crate) use statistics::{Comparison, EstimatorResult, Nees, Study};
pub(crate) use sweeps::{Belief, FACTORS, Ground, by_ground, wrong_beliefs};
pub(crate) use sweeps::{RunCount, convergence};

use crate::error::{Error, ErrorKind, Result};
use rayon::prelude::*;

/// The robot that is studied where the user gives none.
pub(crate) const DEFAULT_CONFIG: &str = include_str!("../../data/study.toml");

/// Runs between two reports of progress, and between two sums: bounds the memory.
const BATCH: usize = 64;

/// Runs the study; `progress` hears how many runs are done.
///
/// # Errors
/// [`ErrorKind::Value`] without runs or estimators; errors of the simulator and of the filters.
pub(crate) fn study(setup: &Setup, progress: impl Fn(usize)) -> Result<Study> {
    if setup.runs == 0 {
        return Err(Error::new(ErrorKind::Value, "study", "no runs").at("runs").hint("ask for at least one"));
    }
    if setup.estimators.is_empty() {
        return Err(Error::new(ErrorKind::Value, "study", "no estimators").at("estimators").hint("name at least one"));
    }
    let mut sums = statistics::Sums::new();
    let mut example = None;
    for begin in (0..setup.runs).step_by(BATCH) {
        let batch: Vec<usize> = (begin..setup.runs.min(begin + BATCH)).collect();
        let results: Vec<Result<RunErrors>> =
            batch.par_iter().map(|index| run_errors(setup, *index, begin == 0 && *index == 0)).collect();
        for result in results {
            let mut run = result?;
            example = example.or_else(|| run.example.take());
            sums.add(&run);
        }
        progress(begin + batch.len());
    }
    Ok(sums.finish(setup, example))
}

#[cfg(test)]
mod tests;
