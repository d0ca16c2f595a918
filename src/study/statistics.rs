//! RMS = sqrt(mean over runs of the mean squares),  NEES = dᵀ P⁻¹ d, its mean over n runs χ²(3 n)/n where the filter is consistent
//!
//! The interval of an RMS is that of the logarithm of the mean square: with mean m and standard deviation s of the runs'
//! mean squares, RMS exp(± 1.96 s/(2 m √n)). NEES of one run are correlated in time, those of different runs are not:
//! the bounds hold at each time, and 95 % of the times should lie inside (Bar-Shalom, Li, Kirubarajan, *Estimation with
//! Applications to Tracking and Navigation*, Wiley 2001, section 5.4).

use super::one_run::{Example, RunErrors};
use super::setup::{Estimator, Setup};
use crate::math::NORMAL_975;
use crate::math::distributions::chi_squared_interval95;

/// Statistics of the runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Study {
    /// Number of runs.
    pub runs: usize,
    /// Times of the curves, s.
    pub times_s: Vec<f64>,
    /// Each estimator's results.
    pub estimators: Vec<EstimatorResult>,
    /// The first run.
    pub example: Option<Example>,
}

impl Study {
    /// The result of one estimator, if it was asked for.
    #[must_use]
    pub(crate) fn of(&self, estimator: Estimator) -> Option<&EstimatorResult> {
        self.estimators.iter().find(|e| e.estimator == estimator)
    }

    /// How `this` estimator fares against the `other`, if both were asked for.
    #[must_use]
    pub(crate) fn compare(&self, this: Estimator, other: Estimator) -> Option<Comparison> {
        Some(comparison(&self.of(this)?.run_rms, &self.of(other)?.run_rms))
    }
}

/// Errors of one estimator over the runs; arrays are x, y (m) and heading (rad).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EstimatorResult {
    /// The estimator.
    pub estimator: Estimator,
    /// Root mean square over runs and time.
    pub rms: [f64; 3],
    /// Its 95 % interval over runs.
    pub rms_ci95: [[f64; 2]; 3],
    /// Root mean square over runs at the times of the curves.
    pub rms_over_time: [Vec<f64>; 3],
    /// Root mean square over runs at the end.
    pub rms_end: [f64; 3],
    /// Each run's root mean square over time.
    pub run_rms: Vec<[f64; 3]>,
    /// Consistency, where the estimator has a covariance.
    pub nees: Option<Nees>,
    /// Mean NIS over runs, likewise; expected: 1.
    pub nis_mean: Option<f64>,
}

/// NEES of (x, y, θ) over the runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nees {
    /// Mean over runs at the times of the curves; expected: 3.
    pub over_time: Vec<f64>,
    /// Between these it lies at 95 % of the times if the filter is consistent.
    pub bounds95: [f64; 2],
    /// Part of the times at which it does.
    pub inside: f64,
    /// Part of the times at which it lies above: the filter is surer than it should be.
    pub above: f64,
    /// Mean over runs and time.
    pub mean: f64,
}

/// One estimator against another, by quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Comparison {
    /// The other's RMS over this one's.
    pub factor: [f64; 3],
    /// Its 95 % interval over runs (the runs are paired).
    pub factor_ci95: [[f64; 2]; 3],
    /// Part of the runs in which this one's RMS is smaller.
    pub won: [f64; 3],
}

/// Sums over runs, added in their order.
pub(super) struct Sums {
    times_s: Vec<f64>,
    estimators: Vec<EstimatorSums>,
}

struct EstimatorSums {
    estimator: Estimator,
    mean_squares: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
    nees: Option<Vec<f64>>,
    nis: Option<f64>,
}

impl Sums {
    pub(crate) fn new() -> Self {
        Self { times_s: Vec::new(), estimators: Vec::new() }
    }

    pub(crate) fn add(&mut self, run: &RunErrors) {
        if self.estimators.is_empty() {
            self.times_s.clone_from(&run.times_s);
            self.estimators = run
                .estimators
                .iter()
                .map(|e| EstimatorSums {
                    estimator: e.estimator,
                    mean_squares: Vec::new(),
                    squares: vec![[0.0; 3]; run.times_s.len()],
                    nees: e.nees.as_ref().map(|_| vec![0.0; run.times_s.len()]),
                    nis: e.nis.map(|_| 0.0),
                })
                .collect();
        }
        for (sums, e) in self.estimators.iter_mut().zip(&run.estimators) {
            sums.mean_squares.push(e.mean_squares);
            for (sum, error) in sums.squares.iter_mut().zip(&e.errors) {
                (0..3).for_each(|i| sum[i] += error[i] * error[i]);
            }
            for (sum, nees) in sums.nees.iter_mut().flatten().zip(e.nees.iter().flatten()) {
                *sum += nees;
            }
            sums.nis = sums.nis.zip(e.nis).map(|(sum, nis)| sum + nis);
        }
    }

    pub(crate) fn finish(self, setup: &Setup, example: Option<Example>) -> Study {
        Study {
            runs: setup.runs,
            estimators: self.estimators.iter().map(EstimatorSums::finish).collect(),
            times_s: self.times_s,
            example,
        }
    }
}

impl EstimatorSums {
    fn finish(&self) -> EstimatorResult {
        let n = self.mean_squares.len() as f64;
        let column = |i: usize| self.mean_squares.iter().map(move |m| m[i]);
        let rms: [f64; 3] = std::array::from_fn(|i| (column(i).sum::<f64>() / n).sqrt());
        let rms_over_time: [Vec<f64>; 3] =
            std::array::from_fn(|i| self.squares.iter().map(|s| (s[i] / n).sqrt()).collect());
        EstimatorResult {
            estimator: self.estimator,
            rms,
            rms_ci95: std::array::from_fn(|i| {
                let spread = spread_of_log_mean(column(i));
                [-0.5, 0.5].map(|half| rms[i] * (half * NORMAL_975 * spread).exp())
            }),
            rms_end: std::array::from_fn(|i| rms_over_time[i].last().copied().unwrap_or_default()),
            rms_over_time,
            run_rms: self.mean_squares.iter().map(|m| m.map(f64::sqrt)).collect(),
            nees: self.nees.as_ref().map(|sums| nees(sums, n)),
            nis_mean: self.nis.map(|sum| sum / n),
        }
    }
}

/// Standard deviation of the logarithm of the mean of `values`, by the delta method.
pub(super) fn spread_of_log_mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let variance = values.map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    variance.sqrt() / (mean * n.sqrt())
}

/// NEES summed over `n` runs.
fn nees(sums: &[f64], n: f64) -> Nees {
    let over_time: Vec<f64> = sums.iter().map(|s| s / n).collect();
    let bounds95 = chi_squared_interval95(3.0 * n).map(|x| x / n);
    let part = |holds: &dyn Fn(f64) -> bool| {
        over_time.iter().filter(|v| holds(**v)).count() as f64 / over_time.len().max(1) as f64
    };
    Nees {
        inside: part(&|v| v >= bounds95[0] && v <= bounds95[1]),
        above: part(&|v| v > bounds95[1]),
        mean: over_time.iter().sum::<f64>() / over_time.len().max(1) as f64,
        bounds95,
        over_time,
    }
}

/// `this` against `other`: root mean squares of the same runs.
fn comparison(this: &[[f64; 3]], other: &[[f64; 3]]) -> Comparison {
    let n = this.len() as f64;
    let mean = |runs: &[[f64; 3]], i: usize| runs.iter().map(|m| m[i] * m[i]).sum::<f64>() / n;
    let factor: [f64; 3] = std::array::from_fn(|i| (mean(other, i) / mean(this, i)).sqrt());
    let factor_ci95 = std::array::from_fn(|i| {
        // delta method on ln mean(other) - ln mean(this), runs paired
        let (a, b) = (mean(this, i), mean(other, i));
        let squares: f64 = this.iter().zip(other).map(|(t, o)| (o[i] * o[i] / b - t[i] * t[i] / a).powi(2)).sum();
        let spread = (squares / (n - 1.0) / n).sqrt();
        [-0.5, 0.5].map(|half| factor[i] * (half * NORMAL_975 * spread).exp())
    });
    let won = std::array::from_fn(|i| this.iter().zip(other).filter(|(t, o)| t[i] < o[i]).count() as f64 / n);
    Comparison { factor, factor_ci95, won }
}
