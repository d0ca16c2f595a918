//! A drive prepared for the diagnosis: rows, channels, and the nominal parameters of the configuration.

pub(crate) mod covariates;
pub(crate) mod given;
mod moved;
pub(crate) mod multi_drive;
mod prepare;
pub(crate) mod ready;
pub(crate) mod reckoning;
pub(crate) mod same_unit;
pub(crate) mod testable;
use self::given::Given;
use crate::bias::WarmUp;
use crate::config::Steering;
use crate::gap::rest::nongaussian::quantization::Grain;
use crate::model::drive::{DriveEffect, DriveModel, Robot};

/// Fewest rows that can be diagnosed.
pub(super) const FEWEST_ROWS: usize = 512;
/// A prepared drive, or several of one robot.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    /// Times of the rows, s, ascending within a drive; each drive has its own clock.
    pub times_s: Vec<f64>,
    /// Times of the rows since power-on, s.
    pub since_power_on_s: Vec<f64>,
    /// Rows at which a drive begins, ascending; the first is zero.
    pub starts: Vec<usize>,
    /// Name of each drive in messages.
    pub sources: Vec<String>,
    /// Known load in each drive, kg ([`Robot::load_kg`]).
    pub loads_kg: Vec<f64>,
    /// Median time between rows, s.
    pub step_s: f64,
    /// Torques, left and right, N·m; none where they were not logged.
    pub torques_n_m: Option<[Vec<f64>; 2]>,
    /// Readings of the gyro, rad/s; NaN where a row has none; none without a gyro.
    pub gyro_rad_s: Option<Vec<f64>>,
    /// Wheel speeds, left and right, rad/s; NaN where a row has none.
    pub wheels_rad_s: [Vec<f64>; 2],
    /// x, y in m, heading in rad; NaN between samples; none without a pose.
    pub pose: Option<[Vec<f64>; 3]>,
    /// Temperature of the gyro, °C; none where it was not logged.
    pub temperature_c: Option<Vec<f64>>,
    /// Nominal parameters and noise.
    pub belief: Belief,
    /// Whether the clock of the wheels was set: a remaining lag is then an error of that.
    pub wheels_were_set: bool,
    /// Effects that the nominal simulator holds.
    pub given: Given,
    /// Assumptions, and what cannot be told, in sentences.
    pub notes: Vec<String>,
}

/// Nominal parameters and noise that the configuration states for a drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Belief {
    /// The robot, without a load.
    pub robot: Robot,
    /// Steering, where it is stated.
    pub steering: Option<Steering>,
    /// Torque noise of each wheel, N·m·√s.
    pub torque_noise_n_m_sqrt_s: f64,
    /// White noise of a gyro sample, standard deviation, rad/s.
    pub gyro_std_rad_s: f64,
    /// White noise of a wheel speed, standard deviation, rad/s.
    pub wheel_std_rad_s: f64,
    /// White noise of a position, standard deviation, m.
    pub position_std_m: f64,
    /// White noise of a heading, standard deviation, rad.
    pub heading_std_rad: f64,
    /// Standard deviation of the tracked point's offset from the middle of the axle, ahead and to the left, m.
    pub lever_arm_std_m: f64,
    /// Standard deviation of the tracked heading's offset from the robot's, rad.
    pub heading_offset_std_rad: f64,
    /// Standard deviation of the pose's delay, s.
    pub pose_delay_std_s: f64,
    /// Nominal warm-up.
    pub warm_up: WarmUp,
    /// Standard deviation of C2 over power-ons, rad/s.
    pub turn_on_bias_std_rad_s: f64,
    /// Relative standard deviation of C1 and T over power-ons.
    pub warm_up_relative_std: f64,
    /// Diffusion of v (m²/s³) and ω (rad²/s³) by an input that nothing is known of, with which the motion before a row
    /// tells nothing of it; zero where it does.
    pub unknown_input: [f64; 2],
}

impl Record {
    /// Speed (m/s) and yaw rate (rad/s) of row `k` from its wheel speeds; NaN where it has none.
    #[must_use]
    pub(crate) fn rolling(&self, k: usize) -> [f64; 2] {
        self.belief.robot.speed_and_yaw_rate([0, 1].map(|i| self.wheels_rad_s[i][k]))
    }

    /// Number of rows.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.times_s.len()
    }

    /// Length of all drives together, s.
    #[must_use]
    pub(crate) fn span_s(&self) -> f64 {
        self.spans_s().iter().sum()
    }

    /// Whether only gyro and wheels were logged: no reading then tells a length, nor which yaw rate is right.
    #[must_use]
    pub(crate) fn is_blind(&self) -> bool {
        self.torques_n_m.is_none() && self.pose.is_none()
    }

    /// Quantization step of the wheels' readings, rad/s; none where they lie on no lattice, or on one finer than their noise.
    #[must_use]
    pub(crate) fn wheel_lsb_rad_s(&self) -> Option<f64> {
        let white = self.belief.wheel_std_rad_s;
        self.wheels_rad_s.iter().filter_map(|w| Grain::of(w, white).lsb_rad_s).reduce(f64::min)
    }

    /// Torques of row `k`, N·m, missing ones held; zero where they were not logged.
    #[must_use]
    #[inline]
    pub(crate) fn torques(&self, k: usize) -> [f64; 2] {
        self.torques_n_m.as_ref().map_or([0.0; 2], |[l, r]| [l[k], r[k]])
    }

    /// Known load in the drive that holds row `k`, kg.
    #[must_use]
    pub(crate) fn load_kg(&self, k: usize) -> f64 {
        let drive = self.starts.partition_point(|start| *start <= k).saturating_sub(1);
        self.loads_kg.get(drive).copied().unwrap_or(0.0)
    }

    /// Known load, the mean over the rows, kg.
    #[must_use]
    pub(crate) fn mean_load_kg(&self) -> f64 {
        let of_all = self.drives().zip(&self.loads_kg).map(|(rows, load_kg)| rows.len() as f64 * load_kg).sum::<f64>();
        of_all / self.len().max(1) as f64
    }

    /// The robot of the configuration with a known load as part of its mass.
    #[must_use]
    pub(crate) fn robot(&self, load_kg: f64) -> Robot {
        Robot { load_kg, ..self.belief.robot }.loaded()
    }

    /// The model of the robot with a known load, the given effects, and `effects` after them.
    #[must_use]
    pub(crate) fn model(&self, load_kg: f64, effects: Vec<Box<dyn DriveEffect>>) -> DriveModel {
        DriveModel::new(Robot { load_kg, ..self.belief.robot }, self.given.effects().chain(effects).collect())
    }
}
