//! The state at each row, given all readings of the log: the fixed-interval smoother in the form of Bryson and Frazier
//!
//! ```text
//!     backwards from λ = 0, Λ = 0 after the last row
//!     at a reading     λ := λ - h (kᵀ λ + ν/S)      Λ := (I - k hᵀ)ᵀ Λ (I - k hᵀ) + h hᵀ/S
//!     at a step        λ := Φᵀ λ                    Λ := Φᵀ Λ Φ
//!     at a row         x - P λ                      P - P Λ P
//! ```
//!
//! with the filter's x, P, Φ, gain k, innovation ν and its variance S (Bierman, *Factorization Methods for Discrete Sequential
//! Estimation*, Academic Press 1977, chapter X). No matrix is inverted.
//!
//! The filter's estimate at a row is based on the readings up to that row. A later reading improves the estimate of the
//! gyro's error, which turns the whole path since the start: the next row's estimate lies on another path, and the
//! sequence of estimates jumps. Given all readings, the rows lie on one path.

use nalgebra::{SMatrix, SVector};

/// Bytes that a tape may take: about 700 000 rows of eight states.
const MOST_BYTES: usize = 1 << 30;

/// Record of the filter's pass, in order.
#[derive(Debug, Clone, Default)]
pub(super) struct Tape<const N: usize> {
    order: Vec<Event>,
    transitions: Vec<SMatrix<f64, N, N>>,
    readings: Vec<Taken<N>>,
    rows: Vec<(SVector<f64, N>, SMatrix<f64, N, N>)>,
}

#[derive(Debug, Clone, Copy)]
enum Event {
    Step,
    Reading,
    Row,
}

#[derive(Debug, Clone, Copy)]
struct Taken<const N: usize> {
    by_state: SVector<f64, N>,
    gain: SVector<f64, N>,
    residual: f64,
    variance: f64,
}

/// A row's state given all readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Smoothed<const N: usize> {
    pub row: usize,
    pub mean: SVector<f64, N>,
    pub covariance: SMatrix<f64, N, N>,
}

impl<const N: usize> Tape<N> {
    /// An empty tape; `None` for a log of so many rows that it would not be held.
    pub(crate) fn for_rows(rows: usize) -> Option<Self> {
        // a step, a row, and three readings
        let bytes = (2 * N * N + N + 3 * (2 * N + 2)) * size_of::<f64>();
        (rows.saturating_mul(bytes) <= MOST_BYTES).then(|| Self {
            order: Vec::new(),
            transitions: Vec::new(),
            readings: Vec::new(),
            rows: Vec::with_capacity(rows),
        })
    }

    pub(crate) fn step(&mut self, phi: &SMatrix<f64, N, N>) {
        self.order.push(Event::Step);
        self.transitions.push(*phi);
    }

    pub(crate) fn reading(&mut self, by_state: SVector<f64, N>, gain: SVector<f64, N>, residual: f64, variance: f64) {
        self.order.push(Event::Reading);
        self.readings.push(Taken { by_state, gain, residual, variance });
    }

    pub(crate) fn row(&mut self, mean: &SVector<f64, N>, covariance: SMatrix<f64, N, N>) {
        self.order.push(Event::Row);
        self.rows.push((*mean, covariance));
    }

    /// The rows from the last to the first.
    pub(crate) fn backwards(mut self, mut each: impl FnMut(&Smoothed<N>)) {
        let mut adjoint = SVector::<f64, N>::zeros();
        let mut information = SMatrix::<f64, N, N>::zeros();
        for event in self.order.iter().rev() {
            match event {
                Event::Step => {
                    let Some(phi) = self.transitions.pop() else { return };
                    adjoint = phi.tr_mul(&adjoint);
                    information = phi.tr_mul(&(information * phi));
                }
                Event::Reading => {
                    let Some(Taken { by_state: h, gain, residual, variance }) = self.readings.pop() else { return };
                    adjoint -= h * (gain.dot(&adjoint) + residual / variance);
                    let seen = information * gain;
                    let own = gain.dot(&seen) + 1.0 / variance;
                    information += h * (own * h - seen).transpose() - seen * h.transpose();
                }
                Event::Row => {
                    let Some((mean, covariance)) = self.rows.pop() else { return };
                    each(&Smoothed {
                        row: self.rows.len(),
                        mean: mean - covariance * adjoint,
                        covariance: covariance - covariance * information * covariance,
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;
    use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

    /// Position and velocity under white acceleration, the position read at some steps: the smoother against least squares over
    /// all states at once.
    #[test]
    fn it_is_the_least_squares_solution_over_the_whole_log() {
        let (n, dt, q, r) = (25usize, 0.4, 0.3, 0.05);
        let phi = Matrix2::new(1.0, dt, 0.0, 1.0);
        // acceleration is drawn anew each step, and a little white noise on both keeps Q regular
        let noise = Matrix2::new(dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt) * q;
        let (mut draw, start) = (Stream::new(4, 0), Matrix2::new(0.5, 0.1, 0.1, 0.8));
        let readings: Vec<Option<f64>> = (0..n).map(|k| (k % 3 != 1).then(|| draw.normal() + 0.3 * k as f64)).collect();

        let mut tape = Tape::<2>::for_rows(n).unwrap();
        let (mut x, mut p, h) = (Vector2::zeros(), start, Vector2::new(1.0, 0.0));
        for (k, reading) in readings.iter().enumerate() {
            if k > 0 {
                x = phi * x;
                p = phi * p * phi.transpose() + noise;
                tape.step(&phi);
            }
            if let Some(z) = reading {
                let variance = p[(0, 0)] + r;
                let (gain, residual) = (p * h / variance, z - x[0]);
                x += gain * residual;
                p -= gain * gain.transpose() * variance;
                tape.reading(h, gain, residual, variance);
            }
            tape.row(&x, p);
        }

        let mut information = DMatrix::<f64>::zeros(2 * n, 2 * n);
        let mut right = DVector::<f64>::zeros(2 * n);
        let prior = start.try_inverse().unwrap();
        let weight = noise.try_inverse().unwrap();
        let mut add = |row: usize, column: usize, m: Matrix2<f64>| {
            let mut part = information.fixed_view_mut::<2, 2>(2 * row, 2 * column);
            part += m;
        };
        add(0, 0, prior);
        for k in 1..n {
            add(k, k, weight);
            add(k - 1, k - 1, phi.transpose() * weight * phi);
            add(k, k - 1, -weight * phi);
            add(k - 1, k, -phi.transpose() * weight);
        }
        for (k, z) in readings.iter().enumerate().filter_map(|(k, z)| Some((k, (*z)?))) {
            information[(2 * k, 2 * k)] += 1.0 / r;
            right[2 * k] += z / r;
        }
        let covariance = information.try_inverse().unwrap();
        let mean = &covariance * right;
        let mut rows = 0;
        tape.backwards(|s| {
            rows += 1;
            for i in 0..2 {
                assert!((s.mean[i] - mean[2 * s.row + i]).abs() < 1e-9, "row {}", s.row);
                for j in 0..2 {
                    let exact = covariance[(2 * s.row + i, 2 * s.row + j)];
                    assert!((s.covariance[(i, j)] - exact).abs() < 1e-9, "row {}", s.row);
                }
            }
        });
        assert_eq!(rows, n);
    }

    #[test]
    fn a_log_that_would_not_be_held_has_no_tape() {
        assert!(Tape::<8>::for_rows(100_000).is_some() && Tape::<8>::for_rows(10_000_000).is_none());
    }
}
