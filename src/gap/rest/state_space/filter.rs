//! ln p(y) = Σ_k ln Σ_mode P(mode | past) p(y_k | mode, past)

use super::forecast::{Forecaster, Horizon};
use super::hypothesis::{Dynamics, Hypothesis, mix};
use super::pieces;
use super::pieces::Pieces;
use super::readout::{Readout, Told};
use super::{StateSpaceModel, Step};
use crate::error::{Error, ErrorKind, Result};
use rayon::prelude::*;
use std::ops::Range;

/// Rows from one removal of rounding errors in P to the next.
const CLEAN_EVERY: usize = 64;

/// Rows from one reduction of the number of pieces to the next.
const REDUCE_EVERY: usize = 16;

/// Share of a mode below which mixing changes less than collapsing does.
const NO_SHARE: f64 = 1e-14;

/// Output of the filter for a recording, one entry a row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// Log density of the reading given those before it; 0 where it is missing.
    pub log_density: Vec<f64>,
    /// Mean of the reading given those before it, rad/s.
    pub predicted_rad_s: Vec<f64>,
    /// Its standard deviation, rad/s (without outliers and rounding).
    pub predicted_std_rad_s: Vec<f64>,
    /// Reading minus prediction, rad/s; NaN where it is missing.
    pub innovation_rad_s: Vec<f64>,
    /// For each horizon asked for: predicted increments of the heading.
    pub forecasts: Vec<Vec<Forecast>>,
}

/// Integral of the rate over a horizon as predicted at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Forecast {
    /// First row of the horizon: the readings before it are known.
    pub row: usize,
    /// Predicted increment of the heading, rad.
    pub increment_rad: f64,
}

impl Run {
    /// Log likelihood of the recording.
    #[must_use]
    pub(crate) fn total(&self) -> f64 {
        self.log_density.iter().sum()
    }
}

impl StateSpaceModel {
    /// Log density of `reading_rad_s`, row by row. Missing readings are NaN.
    ///
    /// # Errors
    /// As `StateSpaceModel::check`; [`ErrorKind::Value`] if there are not as many readings as rows;
    /// [`ErrorKind::Numeric`] if the covariance breaks down.
    pub(crate) fn score(&self, reading_rad_s: &[f64]) -> Result<Run> {
        self.run(reading_rad_s, &[])
    }

    /// As [`StateSpaceModel::score`], with forecasts of the heading.
    ///
    /// # Errors
    /// As [`StateSpaceModel::score`].
    pub(crate) fn run(&self, reading_rad_s: &[f64], horizons: &[Horizon]) -> Result<Run> {
        self.check()?;
        if reading_rad_s.len() != self.rows {
            let found = format!("{} readings for {} rows", reading_rad_s.len(), self.rows);
            return Err(Error::new(ErrorKind::Value, "state-space model", found).hint("build it for this recording"));
        }
        Bank::new(self)?.run(reading_rad_s, horizons)
    }
}

/// One hypothesis for each mode (telegraph low and high, each before and after the step) of each piece of the prior.
struct Bank<'a> {
    believed: &'a StateSpaceModel,
    dynamics: Dynamics,
    readout: Readout,
    /// Number of modes; `modes` and `weights` hold them piece after piece.
    kinds: usize,
    pieces: Option<Pieces>,
    modes: Vec<Hypothesis>,
    weights: Vec<f64>,
    /// Level of each of the `kinds` modes, rad/s.
    levels_rad_s: Vec<f64>,
    /// Distance in `modes` between the states before and after the step.
    step_apart: usize,
}

impl<'a> Bank<'a> {
    fn new(believed: &'a StateSpaceModel) -> Result<Self> {
        let dynamics = Dynamics::new(believed);
        let prior = dynamics.prior(believed)?;
        let (mut weights, mut levels_rad_s) = (vec![1.0], vec![0.0]);
        if let Some(telegraph) = &believed.telegraph {
            let high = telegraph.high_probability();
            weights = vec![1.0 - high, high];
            levels_rad_s = telegraph.levels_rad_s.to_vec();
        }
        let step_apart = weights.len();
        if let Some(Step { size_rad_s, .. }) = &believed.step {
            weights.resize(2 * step_apart, 0.0);
            levels_rad_s = levels_rad_s.iter().copied().chain(levels_rad_s.iter().map(|l| l + size_rad_s)).collect();
        }
        let kinds = weights.len();
        let mut modes = vec![prior; kinds];
        let pieces = pieces::cut(believed);
        if let Some(pieces) = &pieces {
            let at = pieces.coefficient;
            let piece = |mean: &f64| {
                let mut piece = modes[0].clone();
                piece.mean[at] = *mean;
                piece.covariance[at * (dynamics.stride + 1)] = pieces.std * pieces.std;
                vec![piece; kinds]
            };
            let all: Vec<Hypothesis> = pieces.means.iter().flat_map(piece).collect();
            weights = pieces.weights.iter().flat_map(|p| weights.iter().map(move |w| p * w)).collect();
            modes = all;
        }
        let readout = Readout::new(believed);
        Ok(Self { believed, dynamics, readout, kinds, pieces, modes, weights, levels_rad_s, step_apart })
    }

    /// Applies the transitions of the modes into `row`.
    fn change_modes(&mut self, row: usize) {
        if let Some(telegraph) = self.believed.telegraph.as_ref().filter(|_| row > 0) {
            self.change(1, telegraph.leave(self.believed.step_s));
        }
        if let Some(step) = &self.believed.step {
            let was = if row == 0 { 1.0 } else { step.before(row - 1) };
            if was > 0.0 && row >= step.at.start {
                self.change(self.step_apart, [1.0 - step.before(row) / was, 0.0]);
            }
        }
    }

    /// Transitions of a two-state chain whose states are `apart` in the list, with the probabilities `leave` of leaving
    /// each.
    fn change(&mut self, apart: usize, leave: [f64; 2]) {
        for at in (0..self.modes.len()).filter(|at| (at / apart).is_multiple_of(2)) {
            self.change_pair((at, at + apart), leave);
        }
    }

    fn change_pair(&mut self, (a, b): (usize, usize), leave: [f64; 2]) {
        let (wa, wb) = (self.weights[a], self.weights[b]);
        let (stay, come) = (wa * (1.0 - leave[0]), wb * leave[1]);
        let (go, rest) = (wa * leave[0], wb * (1.0 - leave[1]));
        (self.weights[a], self.weights[b]) = (stay + come, go + rest);
        // the state of a mode without weight is arbitrary
        let first = if stay + come > 0.0 { stay / (stay + come) } else { 1.0 };
        let second = if go + rest > 0.0 { go / (go + rest) } else { 0.0 };
        if 1.0 - first < NO_SHARE && second < NO_SHARE {
            return;
        }
        let (low, high) = self.modes.split_at_mut(b);
        mix(&mut low[a], &mut high[0], self.dynamics.stride, first, second);
    }

    fn run(mut self, reading_rad_s: &[f64], horizons: &[Horizon]) -> Result<Run> {
        let believed = self.believed;
        let rows = believed.rows;
        let mut run = Run {
            log_density: Vec::with_capacity(rows),
            predicted_rad_s: Vec::with_capacity(rows),
            predicted_std_rad_s: Vec::with_capacity(rows),
            innovation_rad_s: Vec::with_capacity(rows),
            forecasts: vec![Vec::new(); horizons.len()],
        };
        let forecaster = (!horizons.is_empty()).then(|| Forecaster::new(believed, &self.dynamics, horizons));
        let mut h = self.dynamics.reading();
        let mut told = vec![Told { log_density: 0.0, shift: 0.0, shrink: 0.0 }; self.modes.len()];
        let mut mean = vec![0.0; self.dynamics.stride];
        for (row, y) in reading_rad_s.iter().enumerate() {
            self.change_modes(row);
            if let Some(forecaster) = &forecaster {
                for (at, horizon) in horizons.iter().enumerate() {
                    if row >= horizon.first
                        && (row - horizon.first) % horizon.every.max(1) == 0
                        && row + horizon.rows <= rows
                    {
                        self.mean(&mut mean);
                        let increment_rad = forecaster.increment_rad(at, row, &mean, &self.kind_weights());
                        run.forecasts[at].push(Forecast { row, increment_rad });
                    }
                }
            }
            for (h, c) in h.iter_mut().zip(&believed.coefficients) {
                *h = c.column[row];
            }
            self.read(row, *y, &h, &mut told, &mut run)?;
            let next = if row + 1 < rows { believed.white_std_at(row + 1).powi(2) } else { 0.0 };
            for (mode, told) in self.modes.iter_mut().zip(&told) {
                mode.update_and_advance(&mut self.dynamics, told.shift, told.shrink, next);
                if row % CLEAN_EVERY == CLEAN_EVERY - 1 {
                    mode.clean(self.dynamics.len, self.dynamics.stride);
                }
            }
            if row % REDUCE_EVERY == REDUCE_EVERY - 1
                && let Some(pieces) = self.pieces.as_ref().filter(|_| self.modes.len() > self.kinds)
            {
                pieces.reduce(&mut self.modes, &mut self.weights, self.kinds, self.dynamics.stride);
            }
        }
        Ok(run)
    }

    /// Probability of each mode, summed over the pieces.
    fn kind_weights(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.kinds];
        for piece in self.weights.chunks(self.kinds) {
            sums.iter_mut().zip(piece).for_each(|(s, w)| *s += w);
        }
        sums
    }

    /// Mean of the state over the modes.
    fn mean(&self, mean: &mut [f64]) {
        mean.fill(0.0);
        for (mode, weight) in self.modes.iter().zip(&self.weights) {
            mean.iter_mut().zip(&mode.mean).for_each(|(m, x)| *m += weight * x);
        }
    }

    /// Predicts the reading of `row`, scores it, and updates the weights of the modes.
    #[inline]
    fn read(&mut self, row: usize, y: f64, h: &[f64], told: &mut [Told], run: &mut Run) -> Result<()> {
        let fixed = self.believed.fixed_at(row);
        let white = if self.believed.low_pass.is_some() { 0.0 } else { self.believed.white_std_at(row).powi(2) };
        let (mut first, mut second, mut largest) = (0.0, 0.0, f64::NEG_INFINITY);
        for (at, mode) in self.modes.iter_mut().enumerate() {
            let (mean, variance) = mode.predict_reading(self.dynamics.stride, h);
            let (mean, variance) = (fixed + self.levels_rad_s[at % self.kinds] + mean, variance + white);
            if !(variance > 0.0 && variance.is_finite()) {
                let found = format!("the predicted variance is {variance}");
                return Err(Error::new(ErrorKind::Numeric, "state-space model", found).at(format!("row {row}")));
            }
            let weight = self.weights[at];
            first += weight * mean;
            // about the fixed part, to keep digits beside a large bias
            second += weight * (variance + (mean - fixed).powi(2));
            told[at] = if y.is_finite() {
                self.readout.read(y - mean, variance)
            } else {
                Told { log_density: 0.0, shift: 0.0, shrink: 0.0 }
            };
            if weight > 0.0 {
                largest = largest.max(told[at].log_density);
            }
        }
        let mut log_density = told[0].log_density;
        if self.modes.len() > 1 {
            let mut sum = 0.0;
            for (weight, told) in self.weights.iter_mut().zip(told.iter()) {
                // a mode without weight may have a large density: its weight stays zero
                *weight = if *weight > 0.0 { *weight * (told.log_density - largest).exp() } else { 0.0 };
                sum += *weight;
            }
            log_density = largest + sum.ln();
            self.weights.iter_mut().for_each(|w| *w /= sum);
        }
        if !log_density.is_finite() {
            let found = format!("the log density of {y} rad/s is {log_density}");
            return Err(Error::new(ErrorKind::Numeric, "state-space model", found)
                .at(format!("row {row}"))
                .hint("let the model hold outliers, or remove the reading"));
        }
        run.log_density.push(log_density);
        run.predicted_rad_s.push(first);
        run.predicted_std_rad_s.push((second - (first - fixed).powi(2)).max(0.0).sqrt());
        run.innovation_rad_s.push(y - first);
        Ok(())
    }
}

/// Log density of each block of `reading_rad_s` given all the other rows, before and after it: the log likelihood of
/// all rows minus that without the block. For recordings without a hold-out recording. The blocks should be long
/// against the correlation of the model, or neighbouring rows predict the block.
///
/// # Errors
/// As [`StateSpaceModel::score`]; [`ErrorKind::Value`] if a block goes beyond the rows.
pub(crate) fn blocked_log_score(
    believed: &StateSpaceModel,
    reading_rad_s: &[f64],
    blocks: &[Range<usize>],
) -> Result<Vec<f64>> {
    let all = believed.score(reading_rad_s)?.total();
    let without = |block: &Range<usize>| {
        let mut rest = reading_rad_s.to_vec();
        let Some(rows) = rest.get_mut(block.clone()) else {
            let found = format!("rows {} to {} of {}", block.start, block.end, reading_rad_s.len());
            return Err(Error::new(ErrorKind::Value, "blocks", found).hint("name rows of the recording"));
        };
        rows.fill(f64::NAN);
        Ok(all - believed.score(&rest)?.total())
    };
    blocks.par_iter().map(without).collect()
}
