//! A drive prepared for the diagnosis: rows, channels, and the nominal parameters of the configuration.

pub(crate) mod covariates;
pub(crate) mod given;
mod moved;
pub(crate) mod multi_drive;
pub(crate) mod ready;
pub(crate) mod same_unit;
pub(crate) mod testable;
use self::given::Given;
use super::ekf::innovations::Noise;
use super::preprocess::pace::feedback_note;
use super::preprocess::start_heading;
use crate::bias::WarmUp;
use crate::config::{Config, Gyro, Kind, Steering};
use crate::error::{Error, ErrorKind, Result};
use crate::model::drive::Robot;
use crate::signal::{Log, increasing_times, names, since_power_on};
use crate::vehicle::{Odometry, Rolling, one_wheel, positions_only};

/// Assumed standard deviation of C2, rad/s, where the configuration states none: data sheets of cheap gyros say 0.1 to
/// 1 °/s.
const TURN_ON_STD_RAD_S: f64 = 5e-3;
/// Assumed relative standard deviation of C1 and T, where the configuration states none.
const WARM_UP_STD: f64 = 0.1;
/// Fewest rows that can be diagnosed.
pub(super) const FEWEST_ROWS: usize = 512;
/// Assumed noise of a pose that the configuration does not describe: position, m, and heading, rad.
const POSE_STD: [f64; 2] = [0.02, 0.02];

/// A prepared drive, or several of one robot.
#[derive(Debug, Clone)]
pub struct Record {
    /// Times of the rows, s, ascending within a drive; each drive has its own clock.
    pub times_s: Vec<f64>,
    /// Times of the rows since power-on, s.
    pub since_power_on_s: Vec<f64>,
    /// Rows at which a drive begins, ascending; the first is zero.
    pub starts: Vec<usize>,
    /// Name of each drive in messages.
    pub sources: Vec<String>,
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
pub struct Belief {
    /// The robot.
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
}

impl Record {
    /// Speed (m/s) and yaw rate (rad/s) of row `k` from its wheel speeds; NaN where it has none.
    #[must_use]
    pub(crate) fn rolling(&self, k: usize) -> [f64; 2] {
        self.belief.robot.speed_and_yaw_rate([0, 1].map(|i| self.wheels_rad_s[i][k]))
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times_s.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times_s.is_empty()
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

    /// With the noise of wheels and gyro of `noise` if no torques were logged: motion and noise are then estimated
    /// together.
    #[must_use]
    pub fn as_loud_as(mut self, noise: &Noise) -> Self {
        if self.torques_n_m.is_none() {
            let [wheel, _, gyro, ..] = noise.reading.map(f64::sqrt);
            (self.belief.wheel_std_rad_s, self.belief.gyro_std_rad_s) = (wheel, gyro);
        }
        self
    }

    /// Torques of row `k`, N·m, missing ones held; zero where they were not logged.
    #[must_use]
    #[inline]
    pub(crate) fn torques(&self, k: usize) -> [f64; 2] {
        self.torques_n_m.as_ref().map_or([0.0; 2], |[l, r]| [l[k], r[k]])
    }

    /// Prepares the log of one drive.
    ///
    /// # Errors
    /// [`ErrorKind::Config`] if the configuration is not of a drive, or lacks a table; [`ErrorKind::Column`] without
    /// wheel speeds; [`ErrorKind::TooShort`] below 512 rows; [`ErrorKind::Time`] if time does not run forward.
    pub fn new(config: &Config, log: &Log, since_power_on_s: f64) -> Result<Self> {
        if config.kind != Kind::Driving {
            return Err(Error::new(ErrorKind::Config, "configuration", "kind is \"stationary\"")
                .at("`kind`")
                .hint("give the configuration of the robot, kind = \"driving\""));
        }
        if log.len() < FEWEST_ROWS {
            return Err(Error::new(ErrorKind::TooShort, &log.source, format!("{} rows", log.len()))
                .hint(format!("a drive needs at least {FEWEST_ROWS} rows to be judged")));
        }
        let mut notes = Vec::new();
        let column = |name: &str| log.get(name).map(<[f64]>::to_vec);
        let gyro_rad_s = column(names::GYRO_Z).filter(|g| g.iter().any(|v| v.is_finite()));
        let belief = belief(config, gyro_rad_s.is_some(), &mut notes)?;
        let both = |left: &str, right: &str| Some([column(left)?, column(right)?]);
        let tick_rad = config.encoder.and_then(|e| e.tick_rad());
        let odometry = Odometry::of(log, &Rolling::new(config.require_vehicle()?), tick_rad);
        let wheels_rad_s = odometry.as_ref().and_then(Odometry::wheels).map(|both| both.map(<[f64]>::to_vec));
        let wheels_rad_s = wheels_rad_s.ok_or_else(|| no_wheels(log, odometry.is_some()))?;
        if odometry.as_ref().is_some_and(Odometry::is_converted) {
            notes.push(
                "The wheels are what the odometry's speed and yaw rate stand for, with the nominal radius and track."
                    .into(),
            );
        }
        let mut torques_n_m = both(names::TORQUE_LEFT, names::TORQUE_RIGHT);
        torques_n_m.iter_mut().flatten().for_each(|u| hold(u));
        let pose = column(names::X).zip(column(names::Y)).map(|(x, y)| {
            let nowhere = vec![f64::NAN; x.len()];
            [x, y, column(names::HEADING).unwrap_or(nowhere)]
        });
        let pose = pose.filter(|[x, y, _]| x.iter().zip(y).any(|(x, y)| x.is_finite() && y.is_finite()));
        for (there, what, lost) in [
            (torques_n_m.is_some(), "torques", "forces, masses and motors cannot be judged"),
            (gyro_rad_s.is_some(), "gyro", "nothing of the gyro can be judged"),
            (
                pose.is_some(),
                "pose",
                "what only moves the robot over ground (sideways skid) cannot be judged, and a common error of wheel radii, \
                 track width and gyro gain shows less",
            ),
        ] {
            if !there {
                notes.push(format!("No {what} in the log: {lost}."));
            }
        }
        let times_s = increasing_times(log)?;
        let mut pose = pose;
        let lasting_s = config.pose.and_then(|p| p.correlation_time_s).unwrap_or(0.0);
        if let Some(pose) = pose.as_mut().filter(|_| lasting_s > 0.0) {
            thin(pose, &times_s, lasting_s);
            notes.push(format!(
                "Of the pose one reading in {lasting_s} s is used: closer ones are not independent, says [pose] correlation_time_s."
            ));
        }
        let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let mut record = Self {
            since_power_on_s: since_power_on(log, since_power_on_s)?,
            starts: vec![0],
            sources: vec![log.source.clone()],
            step_s: steps[steps.len() / 2],
            times_s,
            torques_n_m,
            gyro_rad_s,
            wheels_rad_s,
            pose,
            temperature_c: column(names::TEMPERATURE).filter(|t| t.iter().any(|v| v.is_finite())),
            belief,
            wheels_were_set: false,
            given: Given::default(),
            notes,
        };
        record.notes.extend(feedback_note(&record));
        record.with_start_heading().with_given(config)
    }

    /// Adds an initial heading where the reference has positions alone, estimated from these; without the reference
    /// where they do not tell it.
    fn with_start_heading(self) -> Self {
        let Some([_, _, heading]) = &self.pose else { return self };
        if heading.iter().any(|h| h.is_finite()) {
            return self;
        }
        if let Some((mut told, std_rad)) = start_heading::told(&self) {
            told.belief.heading_std_rad = std_rad;
            told.notes = self.notes;
            told.notes.push(
                "The reference tells positions and no heading: the heading at the start is estimated from them, and is no \
                 finding."
                    .into(),
            );
            return told;
        }
        let mut notes = self.notes.clone();
        notes.push("The robot hardly moves in its positions: without a heading they are no reference.".into());
        Self { pose: None, notes, ..self }
    }
}

fn no_wheels(log: &Log, one_speed: bool) -> Error {
    let refused = |found: &str, hint: String| Error::new(ErrorKind::Column, &log.source, found).hint(hint);
    if one_speed {
        return refused(
            "one speed for the whole robot, and not how fast each side drives",
            format!(
                "log both wheels; or, if the log's one yaw rate may stand for the wheels' difference, name it: --map {}=COLUMN",
                names::ODO_YAW_RATE
            ),
        );
    }
    if let Some((found, hint)) = one_wheel(log).or_else(|| positions_only(log)) {
        return refused(&found, hint);
    }
    refused(
        "no wheel speeds, neither of both wheels nor of an odometry that stands for them",
        format!("name the columns that hold them: --map {}=COLUMN[:UNIT]", names::WHEEL_LEFT),
    )
}

fn belief(config: &Config, has_gyro: bool, notes: &mut Vec<String>) -> Result<Belief> {
    let (vehicle, encoder) = (config.require_vehicle()?, config.require_encoder()?);
    let step_s = config.sample_time_s.ok_or_else(|| {
        Error::new(ErrorKind::Config, "configuration", "the key is missing")
            .at("`sample_time_s`")
            .hint("add it at the top of the file: white noise depends on it")
    })?;
    let mut assumed = |value: Option<f64>, default: f64, key: &str| {
        value.unwrap_or_else(|| {
            notes.push(format!("The configuration does not state {key}: {default} is assumed."));
            default
        })
    };
    // a robot without a gyro needs no table for it
    let gyro = match &config.gyro {
        None if !has_gyro => None,
        _ => Some(config.require_gyro()?),
    };
    let (mut turn_on, mut relative) = (0.0, 0.0);
    if let Some(gyro) = gyro {
        turn_on = assumed(gyro.turn_on_bias_std_rad_s, TURN_ON_STD_RAD_S, "turn_on_bias_std_rad_s");
        relative = assumed(gyro.warm_up_relative_std, WARM_UP_STD, "warm_up_relative_std");
    }
    Ok(Belief {
        robot: Robot::from(vehicle),
        steering: vehicle.steering,
        torque_noise_n_m_sqrt_s: vehicle.torque_noise_n_m_sqrt_s,
        gyro_std_rad_s: gyro.map_or(1.0, |g| g.angle_random_walk_rad_sqrt_s / step_s.sqrt()),
        wheel_std_rad_s: encoder.speed_variance_rad2_s2(step_s).sqrt(),
        position_std_m: config.pose.map_or(POSE_STD[0], |p| p.position_std_m),
        heading_std_rad: config.pose.map_or(POSE_STD[1], |p| p.heading_std_rad),
        lever_arm_std_m: config.pose.and_then(|p| p.lever_arm_std_m).unwrap_or(0.0),
        heading_offset_std_rad: config.pose.and_then(|p| p.heading_offset_std_rad).unwrap_or(0.0),
        pose_delay_std_s: config.pose.and_then(|p| p.delay_std_s).unwrap_or(0.0),
        warm_up: gyro.map_or(WarmUp { c1_rad_s: 0.0, c2_rad_s: 0.0, time_constant_s: 1.0 }, Gyro::warm_up),
        turn_on_bias_std_rad_s: turn_on,
        warm_up_relative_std: relative,
    })
}

/// Keeps one reading of the pose in `lasting_s`.
fn thin(pose: &mut [Vec<f64>; 3], times_s: &[f64], lasting_s: f64) {
    let mut last_s = f64::NEG_INFINITY;
    for (k, t_s) in times_s.iter().enumerate() {
        let there = pose[..2].iter().all(|p| p[k].is_finite());
        if there && t_s - last_s >= lasting_s {
            last_s = *t_s;
        } else {
            pose.iter_mut().for_each(|p| p[k] = f64::NAN);
        }
    }
}

/// Replaces missing values by the last one before; by zero at the start.
fn hold(values: &mut [f64]) {
    let mut last = 0.0;
    for v in values {
        if v.is_finite() {
            last = *v;
        } else {
            *v = last;
        }
    }
}
