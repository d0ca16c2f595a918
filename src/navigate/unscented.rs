//! x̄ = (h² - L)/h² f(m) + Σ (f(m + h s) + f(m - h s))/(2 h²),  P = Σ (f⁺ - f⁻)²/(4 h²) + (h² - 1)/(4 h⁴) Σ (f⁺ + f⁻ - 2 f)²
//!
//! The filter on sigma points: a check of the extended filter's linearisation. L directions s are the columns of U √D of
//! the states and the standard deviations of the motion's two disturbances; h = √3, as for normal deviates. The weights
//! are those of second-order divided differences (Nørgaard, Poulsen, Ravn, "New developments in state estimation for
//! nonlinear systems", Automatica 36 (2000) 1627): unlike those of the unscented transform of Julier and Uhlmann for
//! L > 3, none of them is negative in the covariance. Measurements are linear, their update is the extended filter's.

use super::filter::Filter;
use super::model::{Input, MotionModel};
use super::ud::UdCovariance;
use super::{Innovation, Sensor};
use nalgebra::{SMatrix, SVector};

/// h².
const SPREAD: f64 = 3.0;

/// A filter whose prediction runs on sigma points instead of derivatives.
#[derive(Debug, Clone)]
pub(crate) struct UnscentedFilter<const N: usize, M> {
    filter: Filter<N, M>,
}

impl<const N: usize, M: MotionModel<N>> From<Filter<N, M>> for UnscentedFilter<N, M> {
    fn from(filter: Filter<N, M>) -> Self {
        Self { filter }
    }
}

impl<const N: usize, M: MotionModel<N>> UnscentedFilter<N, M> {
    /// The state of knowledge, as an extended filter.
    #[must_use]
    pub(crate) fn state(&self) -> &Filter<N, M> {
        &self.filter
    }

    /// Takes in a reading; `None` if it is missing (not a finite number).
    pub(crate) fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation> {
        self.filter.update(sensor, reading)
    }

    /// Carries the state `dt_s` > 0 on, `input` held.
    pub(crate) fn predict(&mut self, input: Input, dt_s: f64) {
        let mean = *self.filter.mean();
        let at = |x: &SVector<f64, N>, disturbances: [f64; 2]| self.filter.carried(x, input, disturbances, dt_s);
        let centre = at(&mean, [0.0; 2]);
        let mut sum = SVector::<f64, N>::zeros();
        let mut covariance = SMatrix::<f64, N, N>::zeros();
        let mut add = |up: SVector<f64, N>, down: SVector<f64, N>| {
            // relative to the centre: what is large and common does not eat the digits
            let (up, down) = (up - centre, down - centre);
            let (odd, even) = (up - down, up + down);
            sum += even;
            covariance += odd * odd.transpose() * (0.25 / SPREAD);
            covariance += even * even.transpose() * (0.25 * (SPREAD - 1.0) / (SPREAD * SPREAD));
        };
        let (u, d) = (self.filter.factors().unit_upper(), self.filter.factors().diagonal());
        for (k, variance) in d.iter().enumerate().filter(|(_, v)| **v > 0.0) {
            let s = u.column(k) * (SPREAD * variance).sqrt();
            add(at(&(mean + s), [0.0; 2]), at(&(mean - s), [0.0; 2]));
        }
        for (k, variance) in self.filter.model().variances(input, dt_s).into_iter().enumerate() {
            let mut s = [0.0; 2];
            s[k] = (SPREAD * variance).sqrt();
            add(at(&mean, s), at(&mean, s.map(|v| -v)));
        }
        // the centre's weight (h² - L)/h² is what the others leave of one: deviations from the centre need no more
        let mean = centre + sum * (0.5 / SPREAD);
        let walk = self.filter.walk_direction() * self.filter.walk_variance(dt_s).sqrt();
        covariance += walk * walk.transpose();
        if let Some(factors) = UdCovariance::factor(&(0.5 * (covariance + covariance.transpose()))) {
            self.filter.set(mean, factors);
        }
    }
}
