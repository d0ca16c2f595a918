//! Drives: motion from a course or from recorded inputs, and what gyro, encoders and pose reference record of it.

use super::gyro::GyroSensor;
use super::{Course, Options, Purpose, SOURCE, refuse_effects, rows, sample_time, start};
use crate::bias::WarmUp;
use crate::config::{Config, Pose};
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::signal::{Log, TimeAxis, increasing_times, names, since_power_on};
use crate::vehicle::{Forcing, Motion, Rolling, advance};

/// Channels of [`Drive::truth`] beside x, y and heading.
pub mod truth_names {
    /// True forward speed, m/s.
    pub const SPEED: &str = "speed_m_s";
    /// True yaw rate, rad/s.
    pub const YAW_RATE: &str = "yaw_rate_rad_s";
    /// e(t) with its random walk, without white noise, rad/s.
    pub const GYRO_ERROR: &str = "gyro_error_rad_s";
}

/// A simulated drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// What was recorded: `time_since_power_on_s`, torques where there are any, gyro, wheels, pose.
    pub log: Log,
    /// What was true at each row: `x_m`, `y_m`, `heading_rad` and the channels of [`truth_names`].
    pub truth: Log,
    /// The gyro's warm-up in this run.
    pub warm_up: WarmUp,
}

/// A drive along `course` for `duration_s`, from rest at x = y = θ = 0.
///
/// Torques are the inverse dynamics of the course plus feedback of the true pose and velocity (Kanayama et al., "A
/// stable tracking control method for an autonomous mobile robot", ICRA 1990), so that torque noise does not lead
/// the robot astray. The torques are commanded per row and logged.
///
/// # Errors
/// [`ErrorKind::Config`] if a table or the sample time is missing, or the configuration holds effects;
/// [`ErrorKind::Value`] if the duration is no positive time.
pub fn drive(config: &Config, course: Course, duration_s: f64, options: &Options) -> Result<Drive> {
    refuse_effects(config)?;
    let step_s = sample_time(config)?;
    let len = rows(duration_s, step_s)?;
    let start_s = start(options)?;
    let time = TimeAxis::Uniform { start_s: 0.0, step_s, len };
    let robot = Rolling::new(config.require_vehicle()?);
    let mut noise = TorqueNoise::new(config, options)?;
    let mut recorder = Recorder::new(config, options, len)?;
    let profile = course.profile(time.at(len - 1) + step_s, options.seeds.motion);
    let tracker = Tracker::new(step_s);
    let mut torques = [Vec::with_capacity(len), Vec::with_capacity(len)];

    let (mut motion, mut reference) = (Motion::default(), Motion::default());
    for k in 0..len {
        let t = time.at(k);
        recorder.record(t, start_s + t, &motion, &robot);
        let [speed, yaw_rate] = profile.at(t + step_s);
        let planned = Forcing {
            acceleration_m_s2: (speed - reference.speed_m_s) / step_s,
            yaw_acceleration_rad_s2: (yaw_rate - reference.yaw_rate_rad_s) / step_s,
            ..Forcing::default()
        };
        let command = tracker.torques(&robot, &motion, &reference, &planned);
        torques[0].push(command[0]);
        torques[1].push(command[1]);
        motion = robot.step(&motion, noise.on(command, step_s), step_s);
        reference = advance(&reference, &planned, step_s);
    }
    recorder.finish(time, Some(torques))
}

/// The drive that the recorded inputs of `inputs` lead to, on its time axis, from rest at x = y = θ = 0.
///
/// Inputs are the torques; where the log has none, the robot moves as the recorded wheel speeds say (their noise then
/// moves it), linear between the rows. A missing value (NaN) holds the last one; before the first one, zero.
/// Time since power-on is the log's own, else counts from `options.since_power_on_s` at the first row.
///
/// # Errors
/// [`ErrorKind::Column`] if there are neither torques nor wheel speeds; [`ErrorKind::Time`] if time does not run
/// forward; [`ErrorKind::Config`] as [`drive`].
pub fn replay(config: &Config, inputs: &Log, options: &Options) -> Result<Drive> {
    refuse_effects(config)?;
    if inputs.len() < 2 {
        let found = format!("{} rows, and a drive needs two", inputs.len());
        return Err(Error::new(ErrorKind::TooShort, &inputs.source, found));
    }
    let since_power_on = since_power_on(inputs, start(options)?)?;
    let times = increasing_times(inputs)?;
    let robot = Rolling::new(config.require_vehicle()?);
    let mut recorder = Recorder::new(config, options, inputs.len())?;
    let torques = pair(inputs, names::TORQUE_LEFT, names::TORQUE_RIGHT);
    let mut motion = Motion::default();
    if let Some([left, right]) = &torques {
        let mut noise = TorqueNoise::new(config, options)?;
        for (k, (&t, &since)) in times.iter().zip(&since_power_on).enumerate() {
            recorder.record(t, since, &motion, &robot);
            if let Some(next) = times.get(k + 1) {
                motion = robot.step(&motion, noise.on([left[k], right[k]], next - t), next - t);
            }
        }
    } else {
        let [left, right] = pair(inputs, names::WHEEL_LEFT, names::WHEEL_RIGHT).ok_or_else(|| {
            let found = "neither torques nor wheel speeds to replay";
            Error::new(ErrorKind::Column, &inputs.source, found).mend("call the columns that hold them by these names")
        })?;
        let velocity = |k: usize| robot.speed_and_yaw_rate([left[k], right[k]]);
        [motion.speed_m_s, motion.yaw_rate_rad_s] = velocity(0);
        for (k, (&t, &since)) in times.iter().zip(&since_power_on).enumerate() {
            recorder.record(t, since, &motion, &robot);
            if let Some(next) = times.get(k + 1) {
                let [speed, yaw_rate] = velocity(k + 1);
                let forcing = Forcing {
                    acceleration_m_s2: (speed - motion.speed_m_s) / (next - t),
                    yaw_acceleration_rad_s2: (yaw_rate - motion.yaw_rate_rad_s) / (next - t),
                    ..Forcing::default()
                };
                motion = advance(&motion, &forcing, next - t);
            }
        }
    }
    recorder.finish(inputs.time.clone(), torques)
}

/// Both channels with gaps held, if both are there.
fn pair(log: &Log, left: &str, right: &str) -> Option<[Vec<f64>; 2]> {
    let held = |values: &[f64]| {
        let hold = |last: &mut f64, &v: &f64| {
            *last = if v.is_finite() { v } else { *last };
            Some(*last)
        };
        values.iter().scan(0.0, hold).collect()
    };
    Some([held(log.get(left)?), held(log.get(right)?)])
}

/// White torque noise of each wheel, held over a step: standard deviation q/√dt.
struct TorqueNoise {
    density_n_m_sqrt_s: f64,
    streams: [Stream; 2],
}

impl TorqueNoise {
    fn new(config: &Config, options: &Options) -> Result<Self> {
        let seed = options.seeds.motion;
        Ok(Self {
            density_n_m_sqrt_s: config.require_vehicle()?.torque_noise_n_m_sqrt_s,
            streams: [Purpose::TorqueLeft.stream(seed), Purpose::TorqueRight.stream(seed)],
        })
    }

    fn on(&mut self, torques_n_m: [f64; 2], dt_s: f64) -> [f64; 2] {
        let std = self.density_n_m_sqrt_s / dt_s.sqrt();
        std::array::from_fn(|i| torques_n_m[i] + std * self.streams[i].normal())
    }
}

/// Feedback gains; slower where the sample time would make them unstable.
struct Tracker {
    velocity_per_s: f64,
    pose_per_s: f64,
    heading_per_s: f64,
    lateral_per_m2: f64,
}

impl Tracker {
    fn new(step_s: f64) -> Self {
        // gain times sample time: at most 0.5 in the inner loop, a quarter of that in the outer one
        let inner = 5f64.min(0.5 / step_s);
        Self { velocity_per_s: inner, pose_per_s: inner / 5.0, heading_per_s: inner / 2.5, lateral_per_m2: inner / 2.5 }
    }

    fn torques(&self, robot: &Rolling, motion: &Motion, reference: &Motion, planned: &Forcing) -> [f64; 2] {
        let (sin, cos) = motion.heading_rad.sin_cos();
        let (dx, dy) = (reference.x_m - motion.x_m, reference.y_m - motion.y_m);
        let (ahead, aside) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let turn = reference.heading_rad - motion.heading_rad;
        let speed = reference.speed_m_s * turn.cos() + self.pose_per_s * ahead;
        let yaw_rate = reference.yaw_rate_rad_s
            + self.heading_per_s * turn.sin()
            + self.lateral_per_m2 * reference.speed_m_s * aside;
        robot.torques_for(
            motion,
            planned.acceleration_m_s2 + self.velocity_per_s * (speed - motion.speed_m_s),
            planned.yaw_acceleration_rad_s2 + self.velocity_per_s * (yaw_rate - motion.yaw_rate_rad_s),
        )
    }
}

/// Reads the sensors row by row and keeps the truth.
struct Recorder {
    gyro: GyroSensor,
    encoder_std_rad_s: f64,
    encoders: [Stream; 2],
    pose: Option<PoseSensor>,
    recorded: Vec<(&'static str, Vec<f64>)>,
    truth: Vec<(&'static str, Vec<f64>)>,
}

struct PoseSensor {
    table: Pose,
    streams: [Stream; 3],
    next_sample: f64,
    first_s: Option<f64>,
}

impl Recorder {
    fn new(config: &Config, options: &Options, len: usize) -> Result<Self> {
        let seed = options.seeds.sensors;
        let columns = |names: &[&'static str]| names.iter().map(|n| (*n, Vec::with_capacity(len))).collect();
        let mut recorded = vec![names::SINCE_POWER_ON, names::GYRO_Z, names::WHEEL_LEFT, names::WHEEL_RIGHT];
        if config.pose.is_some() {
            recorded.extend([names::X, names::Y, names::HEADING]);
        }
        Ok(Self {
            gyro: GyroSensor::new(config.require_gyro()?, sample_time(config)?, options)?,
            encoder_std_rad_s: config.require_encoder()?.speed_noise_std_rad_s,
            encoders: [Purpose::EncoderLeft.stream(seed), Purpose::EncoderRight.stream(seed)],
            pose: config.pose.map(|table| PoseSensor {
                table,
                streams: [Purpose::PoseX, Purpose::PoseY, Purpose::PoseHeading].map(|p| p.stream(seed)),
                next_sample: 0.0,
                first_s: None,
            }),
            recorded: columns(&recorded),
            truth: columns(&[
                names::X,
                names::Y,
                names::HEADING,
                truth_names::SPEED,
                truth_names::YAW_RATE,
                truth_names::GYRO_ERROR,
            ]),
        })
    }

    fn record(&mut self, t_s: f64, since_power_on_s: f64, motion: &Motion, robot: &Rolling) {
        let gyro = self.gyro.read(motion.yaw_rate_rad_s, since_power_on_s);
        let [left, right] = robot.wheel_speeds(motion);
        let mut row = vec![
            since_power_on_s,
            gyro.reading_rad_s,
            left + self.encoder_std_rad_s * self.encoders[0].normal(),
            right + self.encoder_std_rad_s * self.encoders[1].normal(),
        ];
        if let Some(pose) = &mut self.pose {
            row.extend(pose.read(t_s, motion));
        }
        for (column, value) in self.recorded.iter_mut().zip(row) {
            column.1.push(value);
        }
        let Motion { x_m, y_m, heading_rad, speed_m_s, yaw_rate_rad_s } = *motion;
        let row = [x_m, y_m, heading_rad, speed_m_s, yaw_rate_rad_s, gyro.error_rad_s];
        for (column, value) in self.truth.iter_mut().zip(row) {
            column.1.push(value);
        }
    }

    fn finish(self, time: TimeAxis, torques: Option<[Vec<f64>; 2]>) -> Result<Drive> {
        let mut log = Log::new(SOURCE, time.clone());
        let mut recorded = self.recorded.into_iter();
        if let Some((name, values)) = recorded.next() {
            log.push(name, values)?;
        }
        if let Some([left, right]) = torques {
            log.push(names::TORQUE_LEFT, left)?;
            log.push(names::TORQUE_RIGHT, right)?;
        }
        for (name, values) in recorded {
            log.push(name, values)?;
        }
        let mut truth = Log::new(SOURCE, time);
        for (name, values) in self.truth {
            truth.push(name, values)?;
        }
        Ok(Drive { log, truth, warm_up: self.gyro.model() })
    }
}

impl PoseSensor {
    /// x, y and heading at the first row at or after each sample's time, NaN at the others.
    fn read(&mut self, t_s: f64, motion: &Motion) -> [f64; 3] {
        let first_s = *self.first_s.get_or_insert(t_s);
        // a row that rounding puts just before its sample's time belongs to it
        let due = (t_s - first_s) * self.table.rate_hz + 1e-6;
        if due < self.next_sample {
            return [f64::NAN; 3];
        }
        self.next_sample = due.floor() + 1.0;
        let std = [self.table.position_std_m, self.table.position_std_m, self.table.heading_std_rad];
        let pose = [motion.x_m, motion.y_m, motion.heading_rad];
        std::array::from_fn(|i| pose[i] + std[i] * self.streams[i].normal())
    }
}
