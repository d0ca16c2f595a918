//! Extended Kalman filter of the rolling robot with the gyro's warm-up
//!
//! ```text
//!     states         x, y, θ, v, ω, e, s, ln T
//!     dv/dt, dω/dt   rolling dynamics under the commanded torques, or white accelerations where none are known
//!     de/dt = λ(T) (s - e)                         s = C1 + C2
//!     gyro           ω + e + white noise           N/√Ts, with lsb²/12 where the output lies on a lattice
//!     wheels         (v ∓ b ω)/r + white noise
//! ```
//!
//! Noise: each wheel's torque has white noise of density q, held over a step (variance q²/dt, as simulated); unknown
//! accelerations are white with given densities; the rate random walk moves e and s alike (variance K² dt). The state
//! is carried by the same exact step as the simulator's, the covariance by its analytic derivative, in UD factors.
//! Speed, yaw rate and gyro error are linear but for ln T; only x and y bend.

use super::gyro_error::{Decay, LN_TIME_CONSTANT_REACH, Prior};
use super::ud::UdCovariance;
use super::{ErrorModel, Settings};
use crate::config::Config;
use crate::error::{Error, ErrorKind, Result};
use crate::vehicle::{Forcing, Motion, MotionJacobian, Rolling, advance_with_jacobian};
use nalgebra::{SMatrix, SVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Number of states.
pub const STATES: usize = 8;

/// Index of each state.
pub mod state {
    /// x, m
    pub const X: usize = 0;
    /// y, m
    pub const Y: usize = 1;
    /// θ, rad
    pub const HEADING: usize = 2;
    /// v, m/s
    pub const SPEED: usize = 3;
    /// ω, rad/s
    pub const YAW_RATE: usize = 4;
    /// e, rad/s
    pub const GYRO_ERROR: usize = 5;
    /// s = C1 + C2, rad/s
    pub const WARM_ERROR: usize = 6;
    /// ln(T / 1 s)
    pub const LN_TIME_CONSTANT: usize = 7;
}
use state::{GYRO_ERROR, HEADING, LN_TIME_CONSTANT, SPEED, WARM_ERROR, X, Y, YAW_RATE};

/// Noise sources of a prediction: two torques or accelerations, and the rate random walk.
const NOISES: usize = 3;

/// A zero noise in the configuration would mean infinite trust: standard deviations of a measurement are at least this
/// (rad/s, m or rad).
const MEASUREMENT_STD_FLOOR: f64 = 1e-9;

/// Speed (m/s) and yaw rate (rad/s) before the first reading are known to this standard deviation about zero.
const VELOCITY_STD: f64 = 1.0;

/// The start defines the origin; known to 1 µm and 1 µrad, so that the covariance is positive definite.
const ORIGIN_STD: f64 = 1e-6;

/// What drives the robot until the next row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// Commanded torques, left and right, N·m.
    Torques([f64; 2]),
    /// Unknown accelerations, white with these densities: (m/s²)²/Hz and (rad/s²)²/Hz, two-sided.
    Accelerations([f64; 2]),
}

/// A sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sensor {
    /// Yaw rate, rad/s.
    Gyro,
    /// Left encoder, rad/s.
    WheelLeft,
    /// Right encoder, rad/s.
    WheelRight,
    /// Reference position, m.
    PoseX,
    /// Reference position, m.
    PoseY,
    /// Reference heading, rad.
    PoseHeading,
}

impl Sensor {
    /// All sensors, in the order in which a row's readings are taken in.
    pub const ALL: [Self; 6] =
        [Self::Gyro, Self::WheelLeft, Self::WheelRight, Self::PoseX, Self::PoseY, Self::PoseHeading];
}

/// What a reading said against what was expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Reading minus expectation, in the sensor's unit.
    pub residual: f64,
    /// Its variance.
    pub variance: f64,
    /// Whether it passed the gate and was used.
    pub used: bool,
}

impl Innovation {
    /// Normalised innovation squared: chi-squared with one degree of freedom if the model holds.
    #[must_use]
    pub fn nis(&self) -> f64 {
        self.residual * self.residual / self.variance
    }

    /// The residual in standard deviations.
    #[must_use]
    pub fn standardised(&self) -> f64 {
        self.residual / self.variance.sqrt()
    }
}

/// The filter. A step allocates nothing; readings are taken one by one, as they come, at any rate.
#[derive(Debug, Clone)]
pub struct RollingFilter {
    robot: Rolling,
    decay: Decay,
    mean: SVector<f64, STATES>,
    covariance: UdCovariance<STATES>,
    torque_noise_density: f64,
    walk_rad_s_sqrt_s: f64,
    /// Variance of each sensor, in the order of [`Sensor::ALL`].
    noise_variances: [f64; 6],
    ln_time_constant_bounds: [f64; 2],
    gate_nis: f64,
}

impl RollingFilter {
    /// A filter at x = y = θ = 0, `since_power_on_s` after the gyro's power-on, and notes on what was assumed.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if `[gyro]`, `[vehicle]`, `[encoder]` or the sample time is missing, or the covariance is
    /// none; [`ErrorKind::Value`] if the gate's level is no probability.
    pub fn new(config: &Config, settings: &Settings, since_power_on_s: f64) -> Result<(Self, Vec<String>)> {
        let gyro = config.require_gyro()?;
        let vehicle = config.require_vehicle()?;
        let sample_time_s = sample_time(config)?;
        let decay = Decay::new(config)?;
        let prior = Prior::new(gyro, &decay, since_power_on_s);

        let mut mean = SVector::<f64, STATES>::zeros();
        let mut p = SMatrix::<f64, STATES, STATES>::zeros();
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
            walk_rad_s_sqrt_s = gyro.noise.and_then(|n| n.rate_random_walk_rad_s_sqrt_s).unwrap_or(0.0);
            notes = prior.notes;
        }
        let covariance = UdCovariance::factor(&p).ok_or_else(|| {
            Error::new(ErrorKind::Config, "configuration", "is no covariance: a combination has a negative variance")
                .at("`gyro.covariance`")
                .mend("write the file anew with gyroid fit")
        })?;

        let lattice = gyro.noise.and_then(|n| n.quantization_lsb_rad_s).unwrap_or(0.0);
        let white = gyro.angle_random_walk_rad_sqrt_s;
        let wheel_std = config.require_encoder()?.speed_noise_std_rad_s;
        let pose = config.pose.map_or([0.0; 2], |p| [p.position_std_m, p.heading_std_rad]);
        let variances = [
            white * white / sample_time_s + lattice * lattice / 12.0,
            wheel_std * wheel_std,
            wheel_std * wheel_std,
            pose[0] * pose[0],
            pose[0] * pose[0],
            pose[1] * pose[1],
        ];
        let filter = Self {
            robot: Rolling::new(vehicle),
            decay,
            mean,
            covariance,
            torque_noise_density: vehicle.torque_noise_n_m_sqrt_s,
            walk_rad_s_sqrt_s,
            noise_variances: variances.map(|v| v.max(MEASUREMENT_STD_FLOOR * MEASUREMENT_STD_FLOOR)),
            ln_time_constant_bounds: [prior.mean[2] - LN_TIME_CONSTANT_REACH, prior.mean[2] + LN_TIME_CONSTANT_REACH],
            gate_nis: gate(settings.gate_probability)?,
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
    pub fn mean(&self) -> &SVector<f64, STATES> {
        &self.mean
    }

    /// Covariance of the states.
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f64, STATES, STATES> {
        self.covariance.covariance()
    }

    /// Standard deviations of the states.
    #[must_use]
    pub fn std(&self) -> SVector<f64, STATES> {
        self.covariance.variances().map(f64::sqrt)
    }

    /// The covariance's factors.
    #[must_use]
    pub fn factors(&self) -> &UdCovariance<STATES> {
        &self.covariance
    }

    /// Where the robot is and how it moves.
    #[must_use]
    pub fn motion(&self) -> Motion {
        motion_of(&self.mean)
    }

    /// Carries the state `dt_s` > 0 on, `input` held.
    pub fn predict(&mut self, input: Input, dt_s: f64) {
        let Transition { mean, phi, motion } = self.transition(&self.mean, input, dt_s);
        let (gamma, q) = self.process_noise(input, &motion, dt_s);
        self.covariance.predict(&phi, &gamma, &q);
        self.mean = mean;
    }

    /// Takes in a reading; `None` if it is missing (not a finite number).
    pub fn update(&mut self, sensor: Sensor, reading: f64) -> Option<Innovation> {
        if !reading.is_finite() {
            return None;
        }
        let (expected, h) = self.expectation(sensor);
        let r = self.noise_variances[sensor as usize];
        let mut residual = reading - expected;
        if sensor == Sensor::PoseHeading {
            residual = super::wrap_angle(residual);
        }
        let mut innovation = Innovation { residual, variance: self.covariance.innovation_variance(&h, r), used: true };
        if innovation.nis() > self.gate_nis {
            innovation.used = false;
            return Some(innovation);
        }
        let gain = self.covariance.update(&h, r);
        self.mean += gain * residual;
        let [low, high] = self.ln_time_constant_bounds;
        self.mean[LN_TIME_CONSTANT] = self.mean[LN_TIME_CONSTANT].clamp(low, high);
        Some(innovation)
    }

    /// The state `dt_s` after `mean`, and its derivative by `mean`.
    fn transition(&self, mean: &SVector<f64, STATES>, input: Input, dt_s: f64) -> Transition {
        let motion = motion_of(mean);
        let (after, j) = advance_with_jacobian(&motion, &self.forcing(input), dt_s);
        let (rate, rate_by_ln_t) = self.decay.rate(mean[LN_TIME_CONSTANT].exp());
        let left = (-rate * dt_s).exp();
        let gone = -(-rate * dt_s).exp_m1();
        let (e, s) = (mean[GYRO_ERROR], mean[WARM_ERROR]);

        let mut next = *mean;
        next[X] = after.x_m;
        next[Y] = after.y_m;
        next[HEADING] = after.heading_rad;
        next[SPEED] = after.speed_m_s;
        next[YAW_RATE] = after.yaw_rate_rad_s;
        next[GYRO_ERROR] = e + gone * (s - e);

        let mut phi = SMatrix::<f64, STATES, STATES>::identity();
        for i in [X, Y] {
            phi[(i, HEADING)] = j.position_by_heading[i];
            phi[(i, SPEED)] = j.position_by_speed[i];
            phi[(i, YAW_RATE)] = j.position_by_yaw_rate[i];
        }
        phi[(HEADING, YAW_RATE)] = j.heading_by_yaw_rate;
        phi[(SPEED, SPEED)] = j.speed_by_speed;
        phi[(YAW_RATE, YAW_RATE)] = j.yaw_rate_by_yaw_rate;
        phi[(GYRO_ERROR, GYRO_ERROR)] = left;
        phi[(GYRO_ERROR, WARM_ERROR)] = gone;
        phi[(GYRO_ERROR, LN_TIME_CONSTANT)] = (s - e) * dt_s * rate_by_ln_t * left;
        Transition { mean: next, phi, motion: j }
    }

    /// How the noise of a step enters the states, and its variances.
    fn process_noise(
        &self,
        input: Input,
        j: &MotionJacobian,
        dt_s: f64,
    ) -> (SMatrix<f64, STATES, NOISES>, SVector<f64, NOISES>) {
        let by_acceleration =
            [(X, j.position_by_acceleration[0]), (Y, j.position_by_acceleration[1]), (SPEED, j.speed_by_acceleration)];
        let by_yaw_acceleration = [
            (X, j.position_by_yaw_acceleration[0]),
            (Y, j.position_by_yaw_acceleration[1]),
            (HEADING, j.heading_by_yaw_acceleration),
            (YAW_RATE, j.yaw_rate_by_yaw_acceleration),
        ];
        // columns: (a, α) of each of two noises
        let (columns, densities) = match input {
            Input::Torques(_) => {
                let (a, alpha) = (self.robot.acceleration_by_torque(), self.robot.yaw_acceleration_by_torque());
                let density = self.torque_noise_density * self.torque_noise_density;
                ([[a, -alpha], [a, alpha]], [density; 2])
            }
            Input::Accelerations(densities) => ([[1.0, 0.0], [0.0, 1.0]], densities),
        };
        let mut gamma = SMatrix::<f64, STATES, NOISES>::zeros();
        for (k, [a, alpha]) in columns.into_iter().enumerate() {
            for (i, by) in by_acceleration {
                gamma[(i, k)] += by * a;
            }
            for (i, by) in by_yaw_acceleration {
                gamma[(i, k)] += by * alpha;
            }
        }
        gamma[(GYRO_ERROR, 2)] = 1.0;
        gamma[(WARM_ERROR, 2)] = 1.0;
        let walk = self.walk_rad_s_sqrt_s * self.walk_rad_s_sqrt_s * dt_s;
        (gamma, SVector::from([densities[0] / dt_s, densities[1] / dt_s, walk]))
    }

    fn forcing(&self, input: Input) -> Forcing {
        match input {
            Input::Torques(torques) => self.robot.forcing(torques),
            Input::Accelerations(_) => Forcing::default(),
        }
    }

    /// What `sensor` should read, and its derivative by the states.
    fn expectation(&self, sensor: Sensor) -> (f64, SVector<f64, STATES>) {
        let mut h = SVector::<f64, STATES>::zeros();
        match sensor {
            Sensor::Gyro => {
                h[YAW_RATE] = 1.0;
                h[GYRO_ERROR] = 1.0;
            }
            Sensor::WheelLeft | Sensor::WheelRight => {
                let [by_speed, by_yaw] = self.robot.wheel_by_motion()[usize::from(sensor == Sensor::WheelRight)];
                h[SPEED] = by_speed;
                h[YAW_RATE] = by_yaw;
            }
            Sensor::PoseX => h[X] = 1.0,
            Sensor::PoseY => h[Y] = 1.0,
            Sensor::PoseHeading => h[HEADING] = 1.0,
        }
        // every sensor is linear in the states
        (h.dot(&self.mean), h)
    }
}

/// A step's state, its derivative by the state before, and that of the motion, which also carries the noise.
struct Transition {
    mean: SVector<f64, STATES>,
    phi: SMatrix<f64, STATES, STATES>,
    motion: MotionJacobian,
}

fn motion_of(m: &SVector<f64, STATES>) -> Motion {
    Motion { x_m: m[X], y_m: m[Y], heading_rad: m[HEADING], speed_m_s: m[SPEED], yaw_rate_rad_s: m[YAW_RATE] }
}

/// Sample time of the gyro as the configuration states it, s: its white noise per sample depends on it.
fn sample_time(config: &Config) -> Result<f64> {
    let of_fit = || config.gyro.as_ref().and_then(|g| g.discrete).map(|d| d.sample_time_s);
    config.sample_time_s.or_else(of_fit).ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the key is missing")
            .at("`sample_time_s`")
            .mend("add it at the top of the file: white noise depends on it")
    })
}

/// The NIS beyond which a reading is left out.
fn gate(probability: Option<f64>) -> Result<f64> {
    let Some(p) = probability else { return Ok(f64::INFINITY) };
    if !(p > 0.0 && p < 1.0) {
        let found = format!("{p} is not a probability between 0 and 1");
        return Err(Error::new(ErrorKind::Value, "navigation", found)
            .at("gate")
            .mend("0.9999 leaves out one sound reading in ten thousand"));
    }
    let one = ChiSquared::new(1.0).map_err(|e| Error::new(ErrorKind::Numeric, "navigation", e))?;
    Ok(one.inverse_cdf(p))
}

#[cfg(test)]
mod tests;
