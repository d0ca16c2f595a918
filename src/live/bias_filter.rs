//! Kalman filter of the bias b = e + g, learnt only while the gyro is held at rest
//!
//! By elapsed time the state is (e, s, ln T, g): the warm-up error with its asymptote and time constant, as the navigation
//! filter has them, and a first-order Gauss-Markov process g where the configuration states one.
//!
//! ```text
//!     e' = s + (e - s) a,  a = exp(-λ dt)        ∂e'/∂(e, s, ln T) = (a, 1 - a, -(e - s) a dt ∂λ/∂ln T)
//!     g' = φ g,            φ = exp(-dt/τ)        h = (1, 0, 0, 1)
//! ```
//!
//! By temperature it is (b, s, q, g) of e(θ) = b + s (θ - θr) + q (θ - θr)², with h = (1, θ - θr, (θ - θr)², 1): what is learnt
//! at one temperature corrects the slope for the others.
//!
//! A rate random walk K moves e and s (or b) alike by K² dt; g gains σ² (1 - φ²). The bias is h·x with variance hᵀPh.
//! At rest a block's mean rate is y = h·x + n with the variance R of n: innovation ν = y - h·x, S = hᵀPh + R, NIS = ν²/S,
//! which is chi-squared with one degree of freedom. The covariance is updated in Joseph's form.

use crate::bias::{Restart, Thermal};
use crate::config::{Config, Gyro};
use crate::error::{Error, ErrorKind, Result};
use crate::navigate::{Decay, LN_TIME_CONSTANT_REACH, Prior};
use nalgebra::{Matrix4, Vector4};

/// A gyro whose fit by temperature states no covariance, and none between power-ons, is known to this, rad/s: 2e-4 °/h, as the
/// navigation filter's floor.
const STD_FLOOR_RAD_S: f64 = 1e-9;

/// How the bias goes on.
#[derive(Debug, Clone, Copy)]
enum Law {
    Elapsed { decay: Decay, ln_time_constant: f64 },
    Temperature(Thermal),
}

/// State of knowledge of the bias.
#[derive(Debug, Clone)]
pub(super) struct BiasFilter {
    law: Law,
    x: Vector4<f64>,
    p: Matrix4<f64>,
    /// K², rad²/s³.
    walk_rad2_s3: f64,
    /// σ², rad²/s², and τ, s.
    markov: Option<(f64, f64)>,
}

/// An innovation at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Innovation {
    pub nis: f64,
    pub innovation_rad_s: f64,
}

impl BiasFilter {
    /// Knowledge `since_power_on_s` after a power-on, cold or as `restart` says, with notes for the user.
    pub(super) fn new(
        config: &Config,
        by_temperature: bool,
        restart: Option<&Restart>,
        since_power_on_s: f64,
    ) -> Result<(Self, Vec<String>)> {
        let gyro = config.require_gyro()?;
        let walk = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
        let markov = gyro.noise.as_ref().and_then(|n| n.terms).and_then(|t| t.gauss_markov_rad_s);
        let markov = markov.map(|m| (m.estimate * m.estimate, m.correlation_time_s));
        let walk_rad2_s3 = walk * walk;
        let mut filter = match gyro.temperature.filter(|_| by_temperature) {
            Some(_) => Self::by_temperature(gyro, walk_rad2_s3 * since_power_on_s)?,
            None => {
                let decay = Decay::new(config)?;
                let prior = Prior::new(gyro, &decay, restart, since_power_on_s);
                let mut p = Matrix4::zeros();
                p.fixed_view_mut::<3, 3>(0, 0).copy_from(&prior.covariance);
                let [e, s, ln_time_constant] = prior.mean;
                let law = Law::Elapsed { decay, ln_time_constant };
                let x = Vector4::new(e, s, ln_time_constant, 0.0);
                (Self { law, x, p, walk_rad2_s3, markov }, prior.notes)
            }
        };
        (filter.0.walk_rad2_s3, filter.0.markov) = (walk_rad2_s3, markov);
        filter.0.p[(3, 3)] = markov.map_or(0.0, |(variance, _)| variance);
        Ok(filter)
    }

    fn by_temperature(gyro: &Gyro, walked_rad2_s2: f64) -> Result<(Self, Vec<String>)> {
        let table = gyro.temperature.ok_or_else(|| {
            Error::new(ErrorKind::Config, "configuration", "the table is missing").at("[gyro.temperature]")
        })?;
        let model = table.thermal();
        let turn_on = gyro.turn_on_bias_std_rad_s.unwrap_or(0.0);
        let mut p = Matrix4::zeros();
        if let Some(c) = table.covariance {
            let c = c.to_matrix();
            p.fixed_view_mut::<3, 3>(0, 0).copy_from(&nalgebra::Matrix3::from_fn(|i, j| c[i][j]));
        }
        let stated = p[(0, 0)] > 0.0 || turn_on > 0.0;
        let exact = "the configuration states no uncertainty of the gyro's error by temperature: taken as exact (add \
                     turn_on_bias_std_rad_s, or fit it anew)";
        let notes = if stated { Vec::new() } else { vec![exact.to_string()] };
        p[(0, 0)] += turn_on * turn_on + walked_rad2_s2 + STD_FLOOR_RAD_S * STD_FLOOR_RAD_S;
        let x = Vector4::new(model.bias_rad_s, model.sensitivity_rad_s_k, model.curvature_rad_s_k2, 0.0);
        Ok((Self { law: Law::Temperature(model), x, p, walk_rad2_s3: 0.0, markov: None }, notes))
    }

    /// Goes on by `dt_s` ≥ 0.
    pub(super) fn predict(&mut self, dt_s: f64) {
        let mut f = Matrix4::identity();
        let (moved, markov) = self.moved(dt_s);
        if let Law::Elapsed { decay, .. } = &self.law {
            let (rate, by_ln_t) = decay.rate(self.x[2].exp());
            let a = (-rate * dt_s).exp();
            f[(0, 0)] = a;
            f[(0, 1)] = 1.0 - a;
            f[(0, 2)] = -(self.x[0] - self.x[1]) * a * dt_s * by_ln_t;
        }
        f[(3, 3)] = markov;
        self.p = f * self.p * f.transpose();
        let walked = self.walk_rad2_s3 * dt_s;
        self.p[(0, 0)] += walked;
        if matches!(self.law, Law::Elapsed { .. }) {
            self.p[(0, 1)] += walked;
            self.p[(1, 0)] += walked;
            self.p[(1, 1)] += walked;
        }
        if let Some((variance, _)) = self.markov {
            self.p[(3, 3)] += variance * (1.0 - markov * markov);
        }
        (self.x[0], self.x[3]) = (moved, self.x[3] * markov);
    }

    /// The first state, rad/s, and the factor of the fourth, `dt_s` later.
    fn moved(&self, dt_s: f64) -> (f64, f64) {
        let markov = self.markov.map_or(1.0, |(_, tau)| (-dt_s / tau).exp());
        let first = match &self.law {
            Law::Elapsed { decay, .. } => {
                let a = (-decay.rate(self.x[2].exp()).0 * dt_s).exp();
                self.x[1] + (self.x[0] - self.x[1]) * a
            }
            Law::Temperature(_) => self.x[0],
        };
        (first, markov)
    }

    /// The bias `dt_s` later, at `temperature_c` where the error is by temperature, rad/s.
    pub(super) fn bias_rad_s(&self, dt_s: f64, temperature_c: Option<f64>) -> f64 {
        let (first, markov) = self.moved(dt_s);
        let h = self.gradient(temperature_c);
        first + h[1] * self.x[1] + h[2] * self.x[2] + markov * self.x[3]
    }

    /// Variance of the bias now, rad²/s².
    pub(super) fn variance_rad2_s2(&self, temperature_c: Option<f64>) -> f64 {
        let h = self.gradient(temperature_c);
        (h.transpose() * self.p * h)[0].max(0.0)
    }

    fn gradient(&self, temperature_c: Option<f64>) -> Vector4<f64> {
        match &self.law {
            Law::Elapsed { .. } => Vector4::new(1.0, 0.0, 0.0, 1.0),
            Law::Temperature(model) => {
                let [b, s, q] = model.gradient(temperature_c.unwrap_or(model.reference_c));
                Vector4::new(b, s, q, 1.0)
            }
        }
    }

    /// The innovation of a mean rate at rest, and what it is judged by; nothing is learnt.
    pub(super) fn innovation(&self, mean_rad_s: f64, variance_rad2_s2: f64, temperature_c: Option<f64>) -> Innovation {
        let innovation_rad_s = mean_rad_s - self.bias_rad_s(0.0, temperature_c);
        let s = self.variance_rad2_s2(temperature_c) + variance_rad2_s2;
        Innovation { nis: innovation_rad_s * innovation_rad_s / s, innovation_rad_s }
    }

    /// Learns a mean rate at rest, rad/s, with its variance > 0, rad²/s².
    pub(super) fn learn(
        &mut self,
        mean_rad_s: f64,
        variance_rad2_s2: f64,
        temperature_c: Option<f64>,
    ) -> Option<Innovation> {
        let found = self.innovation(mean_rad_s, variance_rad2_s2, temperature_c);
        if !found.nis.is_finite() {
            return None;
        }
        let h = self.gradient(temperature_c);
        let ph = self.p * h;
        let gain = ph / (h.dot(&ph) + variance_rad2_s2);
        let keep = Matrix4::identity() - gain * h.transpose();
        self.p = keep * self.p * keep.transpose() + gain * gain.transpose() * variance_rad2_s2;
        self.p = 0.5 * (self.p + self.p.transpose());
        self.x += gain * found.innovation_rad_s;
        if let Law::Elapsed { ln_time_constant, .. } = self.law {
            let (low, high) = (ln_time_constant - LN_TIME_CONSTANT_REACH, ln_time_constant + LN_TIME_CONSTANT_REACH);
            self.x[2] = self.x[2].clamp(low, high);
        }
        Some(found)
    }

    /// The state and the covariance's rows, for a file.
    pub(super) fn saved(&self) -> ([f64; 4], [[f64; 4]; 4]) {
        (self.x.into(), std::array::from_fn(|i| std::array::from_fn(|j| self.p[(i, j)])))
    }

    /// Takes up what a file holds; refused where it is no state of knowledge.
    pub(super) fn restore(&mut self, x: [f64; 4], p: [[f64; 4]; 4]) -> bool {
        let covariance = Matrix4::from_fn(|i, j| p[i][j]);
        let sound = x.iter().chain(p.iter().flatten()).all(|v| v.is_finite())
            && covariance.diagonal().iter().all(|v| *v >= 0.0)
            && (covariance - covariance.transpose()).amax() <= 1e-9 * covariance.amax();
        if sound {
            (self.x, self.p) = (x.into(), covariance);
        }
        sound
    }
}
