//! The likelihood against dense covariances, sums over all histories, and its own simulated recordings.

mod gaussian;
mod jumps;
mod readings;

use super::*;
use crate::math::random::Stream;

/// ln Σ exp.
fn log_sum_exp(logs: &[f64]) -> f64 {
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + logs.iter().map(|l| (l - top).exp()).sum::<f64>().ln()
}

/// A model with two coefficients and two Markov states, in convenient units.
fn small(rows: usize) -> StateSpaceModel {
    let mut believed = StateSpaceModel::white(rows, 0.1, 0.7);
    let mut draw = Stream::new(11, 0);
    believed.coefficients.push(Coefficient { column: vec![1.0; rows], mean: 2.0, std: 1.5 });
    let column = (0..rows).map(|_| draw.normal()).collect();
    believed.coefficients.push(Coefficient { column, mean: -0.5, std: 0.4 });
    believed.markov.push(Markov { decay: 0.9, variance: 0.05, initial_variance: 0.3 });
    believed.markov.push(Markov { decay: 1.0, variance: 0.01, initial_variance: 0.0 });
    believed
}

/// Whether collapsing costs less than a nat, root mean square over recordings, however long they are: a Bayes factor is worth
/// talking about from about 3 nats on.
fn negligible(errors_nats: &[f64]) -> bool {
    (errors_nats.iter().map(|e| e * e).sum::<f64>() / errors_nats.len() as f64).sqrt() < 1.0
}
