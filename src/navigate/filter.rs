//! Extended Kalman filter of the robot with the gyro's warm-up
//!
//! ```text
//!     states         x, y, θ, v, ω, e, s, ln T;    with slip also φ̇L, φ̇R
//!     dv/dt, dω/dt   the motion model's, under the commanded torques, or white accelerations where none are known
//!     de/dt = λ(T) (s - e)                         s = C1 + C2
//!     gyro           ω + e + white noise           N/√Ts, with lsb²/12 where the output lies on a lattice
//!     wheels         (v ∓ b ω)/r, with slip φ̇      + white noise σ
//!     speed          r (φ̇L + φ̇R)/2                 + white noise r σ/√2, where it is all that the wheels tell
//! ```
//!
//! Speeds that are differences of ticks are means over an interval: the speed in its middle, where [`super::run`] takes them
//! in. Their variance is that of [`crate::config::Encoder`], and T/12 of the wheel's random walk, the variance of a
//! Wiener process' mean over T about its middle. That neighbours are anticorrelated is left out: with K the gain of such
//! readings on the speed, their mean NIS is then 1 + K (1 - K)/(2 - K), between 1 and 4 - 2√2 = 1.17, and the heading is
//! known better than the filter claims.
//!
//! The rate random walk moves e and s alike (variance K² dt). The state is carried by the same step as the simulator's,
//! the covariance by its analytic derivative, in UD factors. Without slip speed, yaw rate and gyro error are linear but
//! for ln T; only x and y bend.

use super::gyro_error::{Decay, LN_TIME_CONSTANT_REACH, Prior};
use super::model::{BENDS, Expected, Input, MotionModel, NOISES, Transition, bits, state};
use super::reading::{Innovation, Sensor, WHEELS, wheel_variance};
use super::rolling_model::{ROLLING_STATES, RollingModel, motion_of};
use super::slip_model::{SLIP_STATES, SlipModel};
use super::smoother::Tape;
use super::ud::{Projection, Row, Structure, UdCovariance};
use super::{ErrorModel, Settings};
use crate::config::{Config, Encoder};
use crate::error::{Error, ErrorKind, Result};
use crate::math::phi::exponentials;
use crate::vehicle::Motion;
use nalgebra::{SMatrix, SVector};
use state::{GYRO_ERROR, HEADING, LN_TIME_CONSTANT, SPEED, WARM_ERROR, X, Y, YAW_RATE};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::marker::PhantomData;

/// Number of noises of a step with the columns for its curvature.
const ALL_NOISES: usize = NOISES + BENDS;

/// A zero noise in the configuration would mean infinite trust: standard deviations of a measurement are at least this
/// (rad/s, m or rad).
const MEASUREMENT_STD_FLOOR: f64 = 1e-9;

/// Speed (m/s) and yaw rate (rad/s) before the first reading are known to this standard deviation about zero.
const VELOCITY_STD: f64 = 1.0;

/// The start defines the origin; known to 1 µm and 1 µrad, so that the covariance is positive definite.
const ORIGIN_STD: f64 = 1e-6;

/// The filter without slip.
pub type RollingFilter = Filter<ROLLING_STATES, RollingModel>;
/// The filter with slip.
pub type SlipFilter = Filter<SLIP_STATES, SlipModel>;

/// The filter of a motion model. A step allocates nothing; readings are taken one by one, as they come, at any rate.
#[derive(Debug, Clone)]
pub struct Filter<const N: usize, M> {
    model: M,
    decay: Decay,
    mean: SVector<f64, N>,
    covariance: UdCovariance<N>,
    walk_rad_s_sqrt_s: f64,
    rows: [Row<N>; Sensor::ALL.len()],
    /// Variance of each sensor, in the order of [`Sensor::ALL`].
    noise_variances: [f64; Sensor::ALL.len()],
    encoder: Encoder,
    wheel_radius_m: f64,
    /// Growth rate of the variance of each wheel sensor's reading in the last step, in its unit squared a second.
    wheel_walks: [f64; WHEELS.len()],
    ln_time_constant_bounds: [f64; 2],
    gate_nis: f64,
    /// Record of the filter's pass, where the rows are to be smoothed.
    pub(super) tape: Option<Box<Tape<N>>>,
}

impl RollingFilter {
    /// A filter at x = y = θ = 0, `since_power_on_s` after the gyro's power-on, and notes on what was assumed.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if `[gyro]`, `[vehicle]`, `[encoder]` or the sample time is missing, or the covariance is
    /// none, or `[gyro.last_run]` is missing for a restart; [`ErrorKind::Value`] if the gate's level is no probability,
    /// or the off time no duration.
    pub fn new(config: &Config, settings: &Settings, since_power_on_s: f64) -> Result<(Self, Vec<String>)> {
        Self::with_model(RollingModel::new(config.require_vehicle()?), config, settings, since_power_on_s)
    }
}

impl SlipFilter {
    /// As [`RollingFilter::new`], with `[traction]`.
    ///
    /// # Errors
    /// As [`RollingFilter::new`], and [`ErrorKind::Config`] without `[traction]`.
    pub fn new(config: &Config, settings: &Settings, since_power_on_s: f64) -> Result<(Self, Vec<String>)> {
        let model = SlipModel::new(config.require_vehicle()?, config.require_traction()?);
        Self::with_model(model, config, settings, since_power_on_s)
    }
}

impl<const N: usize, M: MotionModel<N>> Filter<N, M> {
    /// A filter with this motion model.
    ///
    /// # Errors
    /// As [`RollingFilter::new`].
    pub fn with_model(
        model: M,
        config: &Config,
        settings: &Settings,
        since_power_on_s: f64,
    ) -> Result<(Self, Vec<String>)> {
        let gyro = config.require_gyro()?;
        if gyro.temperature.is_some() && settings.error_model == ErrorModel::WarmUp {
            let found = "a filter that is run step by step is not told the temperature";
            return Err(Error::new(ErrorKind::Config, "configuration", found).at("`[gyro.temperature]`").hint(
                "run it over a log with the temperature, or delete the table: the gyro then warms up by elapsed time",
            ));
        }
        let sample_time_s = sample_time(config)?;
        let decay = Decay::new(config)?;
        let restart = settings.off_time_s.map(|off_s| gyro.restart(off_s)).transpose()?;
        let prior = Prior::new(gyro, &decay, restart.as_ref(), since_power_on_s);

        let mut mean = SVector::<f64, N>::zeros();
        let mut p = SMatrix::<f64, N, N>::zeros();
        for i in [X, Y, HEADING] {
            p[(i, i)] = ORIGIN_STD * ORIGIN_STD;
        }
        for i in [SPEED, YAW_RATE] {
            p[(i, i)] = VELOCITY_STD * VELOCITY_STD;
        }
        let mut walk_rad_s_sqrt_s = 0.0;
        let mut notes = Vec::new();
        mean[LN_TIME_CONSTANT] = prior.mean[2];
        if settings.error_model == ErrorModel::WarmUp {
            mean.fixed_rows_mut::<3>(GYRO_ERROR).copy_from_slice(&prior.mean);
            p.fixed_view_mut::<3, 3>(GYRO_ERROR, GYRO_ERROR).copy_from(&prior.covariance);
            walk_rad_s_sqrt_s = gyro.noise.as_ref().and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
            notes = prior.notes;
        }
        model.start(&mut mean, &mut p);
        let covariance = UdCovariance::factor(&p).ok_or_else(|| {
            Error::new(ErrorKind::Config, "configuration", "is no covariance: a combination has a negative variance")
                .at("`gyro.covariance`")
                .hint("write the file anew with gyroid fit")
        })?;

        let lattice = gyro.noise.as_ref().and_then(|n| n.quantization_lsb_rad_s).unwrap_or(0.0);
        let white = gyro.angle_random_walk_rad_sqrt_s;
        let encoder = *config.require_encoder()?;
        let wheel_radius_m = config.require_vehicle()?.wheel_radius_m;
        let pose = config.pose.map_or([0.0; 2], |p| [p.position_std_m, p.heading_std_rad]);
        let variances = Sensor::ALL.map(|sensor| match sensor {
            Sensor::Gyro => white * white / sample_time_s + lattice * lattice / 12.0,
            Sensor::WheelLeft | Sensor::WheelRight | Sensor::Speed => {
                wheel_variance(&encoder, wheel_radius_m, sensor, sample_time_s)
            }
            Sensor::PoseX | Sensor::PoseY => pose[0] * pose[0],
            Sensor::PoseHeading => pose[1] * pose[1],
        });
        let filter = Self {
            rows: rows(&model, wheel_radius_m),
            model,
            decay,
            mean,
            covariance,
            walk_rad_s_sqrt_s,
            noise_variances: variances.map(|v| v.max(MEASUREMENT_STD_FLOOR * MEASUREMENT_STD_FLOOR)),
            encoder,
            wheel_radius_m,
            wheel_walks: [0.0; WHEELS.len()],
            ln_time_constant_bounds: [prior.mean[2] - LN_TIME_CONSTANT_REACH, prior.mean[2] + LN_TIME_CONSTANT_REACH],
            gate_nis: gate(settings.gate_probability)?,
            tape: None,
        };
        Ok((filter, notes))
    }

    /// Starts at this pose, known to these standard deviations (position m, heading rad), instead of the origin.
    /// To be called before the first prediction.
    #[must_use]
    pub fn starting_at(mut self, pose: [f64; 3], std: [f64; 2]) -> Self {
        let mut p = self.covariance.covariance();
        for (i, std) in [(X, std[0]), (Y, std[0]), (HEADING, std[1])] {
            self.mean[i] = pose[i];
            p[(i, i)] = (std * std).max(ORIGIN_STD * ORIGIN_STD);
        }
        // the pose is not yet correlated with anything, so that the matrix stays a covariance
        if let Some(covariance) = UdCovariance::factor(&p) {
            self.covariance = covariance;
        }
        self
    }

    /// Mean of the states, in the order of [`state`].
    #[must_use]
    pub fn mean(&self) -> &SVector<f64, N> {
        &self.mean
    }

    /// Covariance of the states.
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f64, N, N> {
        self.covariance.covariance()
    }

    /// Standard deviations of the states.
    #[must_use]
    pub fn std(&self) -> SVector<f64, N> {
        self.covariance.variances().map(f64::sqrt)
    }

    /// The covariance's factors.
    #[must_use]
    pub fn factors(&self) -> &UdCovariance<N> {
        &self.covariance
    }

    /// Where the robot is and how it moves.
    #[must_use]
    pub fn motion(&self) -> Motion {
        motion_of(&self.mean)
    }

    /// Carries the state `dt_s` > 0 on, `input` held.
    pub fn predict(&mut self, input: Input, dt_s: f64) {
        let next = self.transition(&self.mean, Some(&self.covariance), input, dt_s);
        match &next.bend {
            None => self.covariance.predict_sparse::<NOISES, Moves<M>>(&next.phi, &next.gamma, &next.variances),
            Some(bend) => {
                let mut columns = SMatrix::<f64, N, ALL_NOISES>::zeros();
                columns.fixed_columns_mut::<NOISES>(0).copy_from(&next.gamma);
                columns.fixed_columns_mut::<BENDS>(NOISES).copy_from(bend);
                let mut all = SVector::<f64, ALL_NOISES>::repeat(1.0);
                all.fixed_rows_mut::<NOISES>(0).copy_from(&next.variances);
                self.covariance.predict_sparse::<ALL_NOISES, Moves<M>>(&next.phi, &columns, &all);
            }
        }
        if self.encoder.tick_rad().is_some() {
            self.wheel_walks = self.wheel_walks_in(next.gamma, next.variances, dt_s);
        }
        self.mean = next.mean;
        if let Some(tape) = &mut self.tape {
            tape.step(&next.phi);
        }
        self.model.moved(input, dt_s);
    }

    /// Growth rates of the variances of the wheel sensors' readings. Takes Γ by value and is not inlined: looked up by
    /// indices that the compiler does not know, it would have to lie in memory at every step, ticks or not.
    #[inline(never)]
    fn wheel_walks_in(
        &self,
        gamma: SMatrix<f64, N, NOISES>,
        variances: SVector<f64, NOISES>,
        dt_s: f64,
    ) -> [f64; WHEELS.len()] {
        WHEELS.map(|sensor| {
            let row = self.rows[sensor as usize].entries();
            let by_noise = |k: usize| row.iter().map(|(i, h)| h * gamma[(*i, k)]).sum::<f64>();
            (0..NOISES).map(|k| by_noise(k).powi(2) * variances[k]).sum::<f64>() / dt_s
        })
    }

    /// Takes in a wheel sensor's mean over `interval_s`, made of ticks, at the middle of that interval; `None` if it is
    /// missing.
    pub fn update_mean(&mut self, sensor: Sensor, mean: f64, interval_s: f64) -> Option<Innovation> {
        let walk = WHEELS.iter().position(|s| *s == sensor).map_or(0.0, |at| self.wheel_walks[at]);
        let variance = self.variance_over(sensor, interval_s) + walk * interval_s / 12.0;
        if mean.is_finite()
            && let Some(expected) = self.model.expected(sensor, mean, variance, &self.mean, &self.covariance)
        {
            return Some(self.take_expected(&expected));
        }
        let row = &self.rows[sensor as usize];
        let residual = row.entries().iter().fold(mean, |rest, (i, h)| rest - h * self.mean[*i]);
        let seen = self.covariance.project(row, variance);
        let row = self.tape.is_some().then_some(*row);
        mean.is_finite().then(|| self.take(&seen, residual, row))
    }

    /// Takes in that the robot stands: v = 0 and ω = 0 with these variances (m²/s², rad²/s²).
    pub fn update_still(&mut self, variances: [f64; 2]) {
        for (state, r) in [SPEED, YAW_RATE].into_iter().zip(variances) {
            let mut h = SVector::<f64, N>::zeros();
            h[state] = 1.0;
            let row = Row::new(&h);
            let seen = self.covariance.project(&row, r);
            self.take(&seen, -self.mean[state], Some(row));
        }
    }

    /// Takes in a reading; `None` if it is missing (not a finite number).
    pub fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation> {
        if !reading.is_finite() {
            return None;
        }
        let r = self.noise_variances[sensor as usize];
        if let Some(expected) = self.model.expected(sensor, reading, r, &self.mean, &self.covariance) {
            return Some(self.take_expected(&expected));
        }
        let row = &self.rows[sensor as usize];
        let mut residual = row.entries().iter().fold(reading, |rest, (i, h)| rest - h * self.mean[*i]);
        if sensor == Sensor::PoseHeading {
            residual = super::wrap_angle(residual);
        }
        let seen = self.covariance.project(row, r);
        let row = self.tape.is_some().then_some(*row);
        Some(self.take(&seen, residual, row))
    }

    fn take_expected(&mut self, expected: &Expected<N>) -> Innovation {
        let row = Row::new(&expected.by_state);
        let seen = self.covariance.project(&row, expected.variance);
        self.take(&seen, expected.residual, Some(row))
    }

    /// Takes in a residual, unless the gate rejects it; `row` is its measurement row, for the tape.
    #[inline(always)]
    fn take(&mut self, seen: &Projection<N>, residual: f64, row: Option<Row<N>>) -> Innovation {
        let mut innovation = Innovation { residual, variance: seen.variance, used: true };
        if residual * residual > self.gate_nis * seen.variance {
            innovation.used = false;
            return innovation;
        }
        let gain = self.covariance.take_in(seen);
        self.mean += gain * residual;
        if let (Some(tape), Some(row)) = (&mut self.tape, row) {
            tape.reading(row.dense(), gain, residual, seen.variance);
        }
        let [low, high] = self.ln_time_constant_bounds;
        self.mean[LN_TIME_CONSTANT] = self.mean[LN_TIME_CONSTANT].clamp(low, high);
        innovation
    }

    /// Variance of a reading of `sensor`, in the square of its unit.
    #[must_use]
    pub(crate) fn noise_variance(&self, sensor: Sensor) -> f64 {
        self.noise_variances[sensor as usize]
    }

    /// Sets it, from the next reading on.
    pub(super) fn set_noise_variance(&mut self, sensor: Sensor, variance: f64) {
        self.noise_variances[sensor as usize] = variance.max(MEASUREMENT_STD_FLOOR * MEASUREMENT_STD_FLOOR);
    }

    /// Variance of a reading of `sensor` that is a mean over `interval_s`, in the square of its unit: only of ticks does
    /// it depend on the interval.
    #[must_use]
    pub(crate) fn variance_over(&self, sensor: Sensor, interval_s: f64) -> f64 {
        if !WHEELS.contains(&sensor) {
            return self.noise_variance(sensor);
        }
        let variance = wheel_variance(&self.encoder, self.wheel_radius_m, sensor, interval_s);
        variance.max(MEASUREMENT_STD_FLOOR * MEASUREMENT_STD_FLOOR)
    }

    /// The motion model.
    #[must_use]
    pub fn model(&self) -> &M {
        &self.model
    }

    /// Slip of the left and the right wheel, each with its standard deviation; `None` without a slip model.
    #[must_use]
    pub fn slips(&self) -> Option<[[f64; 2]; 2]> {
        let slips = self.model.slips(&self.mean)?;
        Some(slips.map(|(slip, row)| [slip, self.covariance.innovation_variance(&row, 0.0).sqrt()]))
    }

    /// The state `dt_s` after `mean`, the motion being disturbed by this much.
    pub(super) fn carried(
        &self,
        mean: &SVector<f64, N>,
        input: Input,
        disturbances: [f64; 2],
        dt_s: f64,
    ) -> SVector<f64, N> {
        let mut after = self.model.disturbed(mean, input, disturbances, dt_s);
        let (rate, _) = self.decay.rate(mean[LN_TIME_CONSTANT].exp());
        after[GYRO_ERROR] -= (-rate * dt_s).exp_m1() * (mean[WARM_ERROR] - mean[GYRO_ERROR]);
        after
    }

    /// How the rate random walk moves the states.
    pub(super) fn walk_direction(&self) -> SVector<f64, N> {
        let mut direction = SVector::zeros();
        (direction[GYRO_ERROR], direction[WARM_ERROR]) = (1.0, 1.0);
        direction
    }

    /// Its variance over `dt_s`.
    pub(super) fn walk_variance(&self, dt_s: f64) -> f64 {
        self.walk_rad_s_sqrt_s * self.walk_rad_s_sqrt_s * dt_s
    }

    /// Replaces mean and covariance.
    pub(super) fn set(&mut self, mean: SVector<f64, N>, covariance: UdCovariance<N>) {
        (self.mean, self.covariance) = (mean, covariance);
    }

    /// The state `dt_s` after `mean`, its derivative by `mean`, and the noise that enters.
    #[inline(always)]
    fn transition(
        &self,
        mean: &SVector<f64, N>,
        covariance: Option<&UdCovariance<N>>,
        input: Input,
        dt_s: f64,
    ) -> Transition<N> {
        let mut out = Transition::rest(mean);
        self.model.carry(mean, covariance, input, dt_s, &mut out);
        let (rate, rate_by_ln_t) = self.decay.rate(mean[LN_TIME_CONSTANT].exp());
        let [[left, mean_left, _]] = exponentials([rate * dt_s]);
        let gone = rate * dt_s * mean_left;
        let (e, s) = (mean[GYRO_ERROR], mean[WARM_ERROR]);
        out.mean[GYRO_ERROR] = e + gone * (s - e);
        out.phi[(GYRO_ERROR, GYRO_ERROR)] = left;
        out.phi[(GYRO_ERROR, WARM_ERROR)] = gone;
        out.phi[(GYRO_ERROR, LN_TIME_CONSTANT)] = (s - e) * dt_s * rate_by_ln_t * left;
        out.gamma[(GYRO_ERROR, 2)] = 1.0;
        out.gamma[(WARM_ERROR, 2)] = 1.0;
        out.variances[2] = self.walk_variance(dt_s);
        out
    }
}

/// Measurement row of each sensor by the states, in the order of [`Sensor::ALL`]: every one is linear in them.
fn rows<const N: usize, M: MotionModel<N>>(model: &M, wheel_radius_m: f64) -> [Row<N>; Sensor::ALL.len()] {
    Sensor::ALL.map(|sensor| {
        let mut h = SVector::<f64, N>::zeros();
        match sensor {
            Sensor::Gyro => (h[YAW_RATE], h[GYRO_ERROR]) = (1.0, 1.0),
            Sensor::WheelLeft => h = model.wheel_row(0),
            Sensor::WheelRight => h = model.wheel_row(1),
            Sensor::Speed => h = (model.wheel_row(0) + model.wheel_row(1)) * (0.5 * wheel_radius_m),
            Sensor::PoseX => h[X] = 1.0,
            Sensor::PoseY => h[Y] = 1.0,
            Sensor::PoseHeading => h[HEADING] = 1.0,
        }
        Row::new(&h)
    })
}

/// Where a step's matrices can differ from zero: the motion model's, and the gyro's error.
struct Moves<M>(PhantomData<M>);

impl<const N: usize, const Q: usize, M: MotionModel<N>> Structure<N, Q> for Moves<M> {
    const PHI: [u32; N] = {
        let mut rows = M::DEPENDS;
        rows[GYRO_ERROR] = bits(&[GYRO_ERROR, WARM_ERROR, LN_TIME_CONSTANT]);
        (rows[WARM_ERROR], rows[LN_TIME_CONSTANT]) = (bits(&[WARM_ERROR]), bits(&[LN_TIME_CONSTANT]));
        rows
    };
    const GAMMA: [u32; N] = {
        let mut rows = M::DISTURBED;
        let mut i = 0;
        while i < N {
            // what bends in a step is what disturbances move
            if rows[i] != 0 {
                rows[i] |= ((1 << Q) - 1) & !((1 << NOISES) - 1);
            }
            i += 1;
        }
        (rows[GYRO_ERROR], rows[WARM_ERROR]) = (bits(&[2]), bits(&[2]));
        rows
    };
}

/// Sample time of the gyro as the configuration states it, s: its white noise per sample depends on it.
fn sample_time(config: &Config) -> Result<f64> {
    let of_fit = || config.gyro.as_ref().and_then(|g| g.discrete).map(|d| d.sample_time_s);
    config.sample_time_s.or_else(of_fit).ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the key is missing")
            .at("`sample_time_s`")
            .hint("add it at the top of the file: white noise depends on it")
    })
}

/// The NIS beyond which a reading is left out.
fn gate(probability: Option<f64>) -> Result<f64> {
    let Some(p) = probability else { return Ok(f64::INFINITY) };
    if !(p > 0.0 && p < 1.0) {
        let found = format!("{p} is not a probability between 0 and 1");
        return Err(Error::new(ErrorKind::Value, "navigation", found)
            .at("gate")
            .hint("0.9999 leaves out one sound reading in ten thousand"));
    }
    let one = ChiSquared::new(1.0).map_err(|e| Error::new(ErrorKind::Numeric, "navigation", e))?;
    Ok(one.inverse_cdf(p))
}

#[cfg(test)]
mod tests;
