//! x ← F (x + shift P h),  P ← F (P - shrink P h hᵀ P) Fᵀ + Q,  F = diag(1, φ_i, companion of the low-pass)
//!
//! State estimate of one mode: the update by a scalar reading and the step to the next row in one pass over P.

use super::{LowPass, StateSpaceModel};
use crate::error::Result;

/// Layout of the state vector, and its dynamics. Rows of P are padded to an even length; the padding stays zero.
#[derive(Debug, Clone)]
pub(super) struct Dynamics {
    /// Number of static coefficients; they come first.
    pub coefficients: usize,
    /// First state of the oscillators, two each; the Markov states lie before them.
    pub pairs: usize,
    /// First state of the low-pass.
    pub block: usize,
    /// Number of states.
    pub len: usize,
    /// Length of a row of P.
    pub stride: usize,
    /// Decay factor of each state (one for the low-pass's, which the companion matrix moves).
    decay: Vec<f64>,
    /// decay_i · decay_j, laid out as P.
    decay_product: Vec<f64>,
    /// Variance of the process noise of the independent states, rad²/s².
    noise: Vec<f64>,
    /// Cosine and sine of each oscillator's angle from row to row.
    turns: Vec<[f64; 2]>,
    low_pass: Option<LowPass>,
    /// Scratch space: one row of P.
    spare: Vec<f64>,
}

impl Dynamics {
    pub(super) fn new(believed: &StateSpaceModel) -> Self {
        let coefficients = believed.coefficients.len();
        let pairs = coefficients + believed.markov.len();
        let block = pairs + 2 * believed.oscillators.len();
        let len = block + believed.low_pass.as_ref().map_or(0, LowPass::order);
        let stride = len.next_multiple_of(2);
        let mut decay = vec![0.0; stride];
        decay[..len].fill(1.0);
        let mut noise = vec![0.0; stride];
        for (i, m) in believed.markov.iter().enumerate() {
            decay[coefficients + i] = m.decay;
            noise[coefficients + i] = m.variance;
        }
        for (i, o) in believed.oscillators.iter().enumerate() {
            decay[pairs + 2 * i..pairs + 2 * i + 2].fill(o.decay);
            // equal in both components: the rotation does not change it
            noise[pairs + 2 * i..pairs + 2 * i + 2].fill(o.drive_variance());
        }
        let turn = |angle: f64| [angle.cos(), angle.sin()];
        let turns = believed.oscillators.iter().map(|o| turn(o.angle_rad)).collect();
        let decay_product = (0..len * stride).map(|at| decay[at / stride] * decay[at % stride]).collect();
        let low_pass = believed.low_pass.clone();
        let spare = vec![0.0; stride];
        Self { coefficients, pairs, block, len, stride, decay, decay_product, noise, turns, low_pass, spare }
    }

    /// Observation vector h: ones for the Markov states and the first of each oscillator's, the moving average of the
    /// low-pass. The elements of the coefficients change with the row and are set there.
    pub(super) fn reading(&self) -> Vec<f64> {
        let mut h = vec![0.0; self.stride];
        h[self.coefficients..self.pairs].fill(1.0);
        h[self.pairs..self.block].iter_mut().step_by(2).for_each(|h| *h = 1.0);
        if let Some(low_pass) = &self.low_pass {
            for (h, b) in h[self.block..].iter_mut().zip(&low_pass.ma) {
                *h = *b;
            }
        }
        h
    }

    /// State estimate before the first row.
    pub(super) fn prior(&self, believed: &StateSpaceModel) -> Result<Hypothesis> {
        let mut mean = vec![0.0; self.stride];
        let mut covariance = vec![0.0; self.len * self.stride];
        for (j, c) in believed.coefficients.iter().enumerate() {
            mean[j] = c.mean;
            covariance[j * (self.stride + 1)] = c.std * c.std;
        }
        for (i, m) in believed.markov.iter().enumerate() {
            covariance[(self.coefficients + i) * (self.stride + 1)] = m.initial_variance;
        }
        for (i, o) in believed.oscillators.iter().enumerate() {
            for at in [self.pairs + 2 * i, self.pairs + 2 * i + 1] {
                covariance[at * (self.stride + 1)] = o.variance;
            }
        }
        if let Some(low_pass) = &self.low_pass {
            let order = low_pass.order();
            let variance = if believed.rows > 0 { believed.white_std_at(0).powi(2) } else { 0.0 };
            for (at, r) in low_pass.stationary_covariance()?.iter().enumerate() {
                covariance[(self.block + at / order) * self.stride + self.block + at % order] = variance * r;
            }
        }
        Ok(Hypothesis { mean, covariance, gain: vec![0.0; self.stride] })
    }

    /// Moves a mean to the next row.
    #[inline]
    pub(super) fn advance_mean(&self, mean: &mut [f64]) {
        for (m, f) in mean.iter_mut().zip(&self.decay) {
            *m *= f;
        }
        self.turn(mean);
        if let Some(low_pass) = &self.low_pass {
            low_pass.advance(&mut mean[self.block..self.len]);
        }
    }

    /// Rotates each oscillator's pair of a vector of states.
    #[inline]
    fn turn(&self, x: &mut [f64]) {
        for (pair, [cos, sin]) in x[self.pairs..self.block].chunks_exact_mut(2).zip(&self.turns) {
            (pair[0], pair[1]) = (cos * pair[0] - sin * pair[1], sin * pair[0] + cos * pair[1]);
        }
    }

    /// Rotates the oscillators on both sides of P.
    fn turn_block(&self, p: &mut [f64]) {
        for row in p.chunks_exact_mut(self.stride) {
            self.turn(row);
        }
        let pairs = p[self.pairs * self.stride..self.block * self.stride].chunks_exact_mut(2 * self.stride);
        for (rows, [cos, sin]) in pairs.zip(&self.turns) {
            let (first, second) = rows.split_at_mut(self.stride);
            for (a, b) in first.iter_mut().zip(second) {
                (*a, *b) = (cos * *a - sin * *b, sin * *a + cos * *b);
            }
        }
    }

    /// Applies the companion matrix of the low-pass on both sides of P.
    fn advance_block(&mut self, p: &mut [f64], white_variance: f64) {
        let Some(low_pass) = &self.low_pass else { return };
        let (from, to, stride) = (self.block, self.len, self.stride);
        for row in p.chunks_exact_mut(stride) {
            low_pass.advance(&mut row[from..to]);
        }
        self.spare.fill(0.0);
        for (i, a) in low_pass.ar.iter().enumerate() {
            let row = &p[(from + i) * stride..(from + i + 1) * stride];
            self.spare.iter_mut().zip(row).for_each(|(s, v)| *s += a * v);
        }
        p.copy_within(from * stride..(to - 1) * stride, (from + 1) * stride);
        p[from * stride..(from + 1) * stride].copy_from_slice(&self.spare);
        p[from * stride + from] += white_variance;
    }
}

/// Mean and covariance of the state in one mode, before the row's reading.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    pub mean: Vec<f64>,
    /// `len` rows of length `stride`.
    pub covariance: Vec<f64>,
    /// P h of the current row.
    gain: Vec<f64>,
}

impl Hypothesis {
    /// Mean and variance of hᵀx; keeps P h for the update.
    #[inline]
    pub(super) fn predict_reading(&mut self, stride: usize, h: &[f64]) -> (f64, f64) {
        self.gain.fill(0.0);
        let gain = &mut self.gain[..stride];
        if stride > 0 {
            // P is symmetric: its rows added up are P h, and that order vectorises
            for (row, h) in self.covariance.chunks_exact(stride).zip(h) {
                for (g, p) in gain.iter_mut().zip(row) {
                    *g += h * p;
                }
            }
        }
        let mean = h.iter().zip(&self.mean).map(|(h, m)| h * m).sum();
        let variance = h.iter().zip(gain.iter()).map(|(h, g)| h * g).sum();
        (mean, variance)
    }

    /// Updates by a reading (both factors zero where there is none) and moves to the next row.
    #[inline]
    pub(super) fn update_and_advance(
        &mut self,
        dynamics: &mut Dynamics,
        shift: f64,
        shrink: f64,
        next_white_variance: f64,
    ) {
        let stride = dynamics.stride;
        if stride == 0 {
            return;
        }
        for (m, g) in self.mean.iter_mut().zip(&self.gain) {
            *m += shift * g;
        }
        dynamics.advance_mean(&mut self.mean);
        let rows = self.covariance.chunks_exact_mut(stride).zip(dynamics.decay_product.chunks_exact(stride));
        for (i, (row, decay)) in rows.enumerate() {
            let k = shrink * self.gain[i];
            for ((p, g), f) in row.iter_mut().zip(&self.gain).zip(decay) {
                *p = f * (*p - k * g);
            }
            row[i] += dynamics.noise[i];
        }
        if !dynamics.turns.is_empty() {
            dynamics.turn_block(&mut self.covariance);
        }
        if dynamics.low_pass.is_some() {
            dynamics.advance_block(&mut self.covariance, next_white_variance);
        }
    }

    /// Becomes the Gaussian with the mean and covariance of the mixture of itself, weight `share`, and `other`, the
    /// rest.
    pub(super) fn join(&mut self, other: &Self, stride: usize, share: f64) {
        if stride == 0 {
            return;
        }
        let spread = share * (1.0 - share);
        for ((d, x), y) in self.gain.iter_mut().zip(&self.mean).zip(&other.mean) {
            *d = x - y;
        }
        let rows = self.covariance.chunks_exact_mut(stride).zip(other.covariance.chunks_exact(stride));
        for (i, (row, theirs)) in rows.enumerate() {
            let di = self.gain[i];
            for ((p, q), d) in row.iter_mut().zip(theirs).zip(&self.gain) {
                *p = q + share * (*p - q) + spread * di * d;
            }
        }
        for (x, y) in self.mean.iter_mut().zip(&other.mean) {
            *x = y + share * (*x - y);
        }
    }

    /// Removes rounding errors: P becomes symmetric again, its variances not negative.
    pub(super) fn clean(&mut self, len: usize, stride: usize) {
        for i in 0..len {
            for j in 0..i {
                let mean = 0.5 * (self.covariance[i * stride + j] + self.covariance[j * stride + i]);
                self.covariance[i * stride + j] = mean;
                self.covariance[j * stride + i] = mean;
            }
            let variance = &mut self.covariance[i * (stride + 1)];
            *variance = variance.max(0.0);
        }
    }
}

/// Replaces two estimates by Gaussians with the means and covariances of two mixtures of them: `a` keeps the share
/// `first` of itself, `b` takes the share `second` of `a`.
pub(super) fn mix(a: &mut Hypothesis, b: &mut Hypothesis, stride: usize, first: f64, second: f64) {
    if stride == 0 {
        return;
    }
    // the difference of the means is stored in `gain`, which is free between readings
    for ((d, x), y) in a.gain.iter_mut().zip(&a.mean).zip(&b.mean) {
        *d = x - y;
    }
    let (spread_a, spread_b) = (first * (1.0 - first), second * (1.0 - second));
    for ((x, y), d) in a.mean.iter_mut().zip(b.mean.iter_mut()).zip(&a.gain) {
        (*x, *y) = (*y + first * d, *y + second * d);
    }
    let rows = a.covariance.chunks_exact_mut(stride).zip(b.covariance.chunks_exact_mut(stride));
    for (i, (row_a, row_b)) in rows.enumerate() {
        let di = a.gain[i];
        for ((p, q), d) in row_a.iter_mut().zip(row_b.iter_mut()).zip(&a.gain) {
            let (old, spread) = (*p - *q, di * d);
            (*p, *q) = (*q + first * old + spread_a * spread, *q + second * old + spread_b * spread);
        }
    }
}
