//! gain = Σ_rows [ln p(row | after) - ln p(row | before)], with the standard deviation that its blocks of time tell

use crate::gap::holdout::{block_rows, block_sums};
use crate::math::NORMAL_975;

/// Fewest scores that are taken for rows; shorter series hold one score a block already.
const FEWEST_ROWS: usize = 80;

/// A gain in log score with its standard deviation, nats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// The gain.
    pub nats: f64,
    /// Its standard deviation, from blocks of time long enough to be independent.
    pub std_nats: f64,
}

impl Gain {
    /// Gain of the log densities `after` over `before`, row by row.
    pub(super) fn of(before: &[f64], after: &[f64]) -> Self {
        let gained: Vec<f64> = before.iter().zip(after).map(|(b, a)| a - b).collect();
        let rows = if gained.len() < FEWEST_ROWS { 1 } else { block_rows(before, after) };
        let sums = block_sums(&gained, rows);
        let n = sums.len() as f64;
        let nats: f64 = sums.iter().sum();
        let squares: f64 = sums.iter().map(|s| (s - nats / n).powi(2)).sum();
        Self { nats, std_nats: (squares * n / (n - 1.0).max(1.0)).sqrt() }
    }

    /// The gain as ln evidence, nats. The log likelihood ratio of a true model has the variance 2 |gain|; where it
    /// scatters more, rows are not independent or the model is not all of it, and the gain is tempered by 2 |gain| over
    /// its variance (as Lyddon, Holmes & Walker 2019 calibrate a likelihood, Biometrika 106, 465).
    pub(super) fn evidence_nats(self) -> f64 {
        self.nats * (2.0 * self.nats.abs() / self.std_nats.powi(2).max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Ends of the 95 % interval.
    pub(super) fn ci95(self) -> [f64; 2] {
        [self.nats - NORMAL_975 * self.std_nats, self.nats + NORMAL_975 * self.std_nats]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_that_scatters_more_than_a_true_model_s_counts_for_less() {
        let of = |nats: f64, variance: f64| Gain { nats, std_nats: variance.sqrt() }.evidence_nats();
        assert_eq!([of(8.0, 16.0), of(-8.0, 4.0), of(-8.0, 64.0), of(0.0, 0.0)], [8.0, -8.0, -2.0, 0.0]);
    }
}
