//! Drives: motion from a course or from recorded inputs, and what gyro, encoders and pose reference record of it.

use super::gyro::GyroSensor;
use super::plant::Plant;
use super::{Course, Options, Purpose, SOURCE, effects, rest, rows, sample_time, start};
use crate::bias::WarmUp;
use crate::config::{Config, Pose};
use crate::error::{Error, ErrorKind, Result};
use crate::math::random::Stream;
use crate::model::drive::{Instrument, Reading};
use crate::model::{EffectSource, Scene};
use crate::progress;
use crate::signal::{Log, TimeAxis, increasing_times, names, since_power_on};
use crate::vehicle::{Forcing, Motion, Odometry, Rolling, advance};

/// Channels of [`Drive::truth`] beside x, y and heading.
pub mod truth_names {
    /// True forward speed, m/s.
    pub const SPEED: &str = "speed_m_s";
    /// True yaw rate, rad/s.
    pub const YAW_RATE: &str = "yaw_rate_rad_s";
    /// e(t) with its random walk, without white noise, rad/s.
    pub const GYRO_ERROR: &str = "gyro_error_rad_s";
    /// Slip of the left wheel, where wheels slip.
    pub const SLIP_LEFT: &str = "slip_left";
    /// Slip of the right wheel.
    pub const SLIP_RIGHT: &str = "slip_right";
}

/// A simulated drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Recorded channels: `time_since_power_on_s`, torques where there are any, gyro, wheels, their ticks where they
    /// are counted, pose.
    pub log: Log,
    /// True values at each row: `x_m`, `y_m`, `heading_rad` and the channels of [`truth_names`].
    pub truth: Log,
    /// The gyro's warm-up in this run, as it is after a cold power-on.
    pub warm_up: WarmUp,
}

/// A drive along `course` for `duration_s`, from rest at x = y = θ = 0.
///
/// Torques are the inverse dynamics of the course plus feedback of the true pose and of the wheels' speeds as they are
/// recorded (Kanayama et al., "A stable tracking control method for an autonomous mobile robot", ICRA 1990), so that torque
/// noise does not lead the robot astray. Fed back from the true velocity, they would tell a filter more of the motion than all
/// sensors do. The torques are commanded per row and logged.
///
/// # Errors
/// [`ErrorKind::Config`] if a table or the sample time is missing, or the configuration holds effects ([`drive_with`]
/// simulates them); [`ErrorKind::Value`] if the duration is no positive time.
pub fn drive(config: &Config, course: Course, duration_s: f64, options: &Options) -> Result<Drive> {
    driven(config, course, duration_s, options, None)
}

/// As [`drive`], with the effects of the configuration, which `effects` makes.
///
/// The planned torques are those of the nominal robot; the feedback makes up for the difference.
/// Wheel slip by an effect moves the readings of the wheels, and its force is that of the wheel that rolls.
///
/// # Errors
/// As [`drive`]; [`ErrorKind::Config`] if `effects` does not know one or its parameters, if one needs a temperature or a
/// supply, or if one changes the robot beside `[traction]`; [`ErrorKind::Value`] if the robot runs away: no finite motion.
pub fn drive_with(
    config: &Config,
    course: Course,
    duration_s: f64,
    options: &Options,
    effects: &dyn EffectSource,
) -> Result<Drive> {
    driven(config, course, duration_s, options, Some(effects))
}

fn driven(
    config: &Config,
    course: Course,
    duration_s: f64,
    options: &Options,
    source: Option<&dyn EffectSource>,
) -> Result<Drive> {
    let step_s = sample_time(config)?;
    let len = rows(duration_s, step_s)?;
    let start_s = start(options)?;
    let time = TimeAxis::Uniform { start_s: 0.0, step_s, len };
    let scene = || rest::bare(config, time.clone().shifted(start_s), step_s, options);
    let (mut plant, mut recorder) = robot(config, options, source, len, scene)?;
    let mut noise = TorqueNoise::new(config, options)?;
    let profile = course.profile(time.at(len - 1) + step_s, options.seeds.motion);
    let tracker = Tracker::new(step_s);
    let mut torques = [Vec::with_capacity(len), Vec::with_capacity(len)];

    let mut reference = Motion::default();
    for k in 0..len {
        progress::tell(k, len);
        let t = time.at(k);
        let wheels_rad_s = recorder.record(t, start_s + t, &mut plant);
        let planned = Forcing::between(reference.velocity(), profile.at(t + step_s), step_s);
        let command = tracker.torques(plant.rolling(), &plant.indicated(wheels_rad_s), &reference, &planned);
        torques[0].push(command[0]);
        torques[1].push(command[1]);
        plant.drive(noise.on(command, step_s), step_s);
        reference = advance(&reference, &planned, step_s);
    }
    recorder.finish(time, Some(torques))
}

/// The drive that the recorded inputs of `inputs` lead to, on its time axis, from rest at x = y = θ = 0.
///
/// Inputs are the torques; where the log has none, the robot moves as the recorded wheel speeds, ticks or odometry say
/// (their noise then moves it), linear between the rows. A missing value (NaN) holds the last one; before the first one, zero.
/// Time since power-on is the log's own, else counts from `options.since_power_on_s` at the first row.
///
/// # Errors
/// [`ErrorKind::Column`] if there are neither torques nor wheel speeds; [`ErrorKind::Time`] if time does not run
/// forward; [`ErrorKind::Config`] as [`drive`].
pub fn replay(config: &Config, inputs: &Log, options: &Options) -> Result<Drive> {
    replayed(config, inputs, options, None)
}

/// As [`replay`], with the effects of the configuration, which `effects` makes; temperature and supply are the log's own.
///
/// Where the log has no torques, the wheels turn as recorded, and the motion follows with the changed radii and track.
/// Effects of forces then change nothing, and neither does slip, which follows them: no force is known.
///
/// # Errors
/// As [`replay`] and [`drive_with`].
pub fn replay_with(config: &Config, inputs: &Log, options: &Options, effects: &dyn EffectSource) -> Result<Drive> {
    replayed(config, inputs, options, Some(effects))
}

fn replayed(config: &Config, inputs: &Log, options: &Options, source: Option<&dyn EffectSource>) -> Result<Drive> {
    if inputs.len() < 2 {
        let found = format!("{} rows, and a drive needs two", inputs.len());
        return Err(Error::new(ErrorKind::TooShort, &inputs.source, found));
    }
    let since_power_on = since_power_on(inputs, start(options)?)?;
    let times = increasing_times(inputs)?;
    let scene = || rest::scene_of_drive(config, inputs, since_power_on[0], options);
    let (mut plant, mut recorder) = robot(config, options, source, inputs.len(), scene)?;
    let torques = pair(inputs, names::TORQUE_LEFT, names::TORQUE_RIGHT);
    if let Some([left, right]) = &torques {
        let mut noise = TorqueNoise::new(config, options)?;
        for (k, (&t, &since)) in times.iter().zip(&since_power_on).enumerate() {
            progress::tell(k, times.len());
            recorder.record(t, since, &mut plant);
            if let Some(next) = times.get(k + 1) {
                plant.drive(noise.on([left[k], right[k]], next - t), next - t);
            }
        }
    } else {
        let robot = *plant.rolling();
        let tick_rad = config.require_encoder()?.tick_rad();
        let odometry = Odometry::of(inputs, &robot, tick_rad);
        let Some(wheels) = odometry.as_ref().and_then(Odometry::wheels) else {
            let found = "neither torques nor wheel speeds to replay";
            return Err(Error::new(ErrorKind::Column, &inputs.source, found)
                .hint(format!("name the columns that hold them: --map {}=COLUMN[:UNIT]", names::WHEEL_LEFT)));
        };
        let [left, right] = wheels.map(held);
        let velocity = |plant: &Plant, k: usize| plant.speed_and_yaw_rate([left[k], right[k]]);
        let [speed_m_s, yaw_rate_rad_s] = velocity(&plant, 0);
        plant.put(Motion { speed_m_s, yaw_rate_rad_s, ..Motion::default() });
        for (k, (&t, &since)) in times.iter().zip(&since_power_on).enumerate() {
            progress::tell(k, times.len());
            recorder.record(t, since, &mut plant);
            if let Some(next) = times.get(k + 1) {
                let forcing = Forcing::between(plant.motion().velocity(), velocity(&plant, k + 1), next - t);
                plant.roll(&forcing, next - t);
            }
        }
    }
    recorder.finish(inputs.time.clone(), torques)
}

/// Robot and sensors, with the effects that `source` makes in `scene`.
fn robot(
    config: &Config,
    options: &Options,
    source: Option<&dyn EffectSource>,
    len: usize,
    scene: impl FnOnce() -> Result<Scene>,
) -> Result<(Plant, Recorder)> {
    let (mut plant, mut recorder) = (Plant::new(config)?, Recorder::new(config, options, len)?);
    if !config.effects.is_empty() {
        let scene = scene()?;
        let made = effects::of_drive(config, &scene, options, source)?;
        plant = plant.changed_by(made.robot, config)?;
        recorder.gyro = recorder.gyro.changed_by(made.gyro, scene);
        recorder.louder(|instrument| plant.noise_over_nominal(instrument));
    }
    Ok((plant, recorder))
}

/// Both channels with gaps held, if both are there.
fn pair(log: &Log, left: &str, right: &str) -> Option<[Vec<f64>; 2]> {
    Some([held(log.get(left)?), held(log.get(right)?)])
}

fn held(values: &[f64]) -> Vec<f64> {
    let hold = |last: &mut f64, &v: &f64| {
        *last = if v.is_finite() { v } else { *last };
        Some(*last)
    };
    values.iter().scan(0.0, hold).collect()
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
    step_s: f64,
    first_s: Option<f64>,
    last_s: Option<f64>,
    gyro: GyroSensor,
    encoder_std_rad_s: f64,
    encoders: [Stream; 2],
    counters: Option<Counters>,
    pose: Option<PoseSensor>,
    recorded: Vec<(&'static str, Vec<f64>)>,
    truth: Vec<(&'static str, Vec<f64>)>,
}

/// Encoders that count whole ticks; where the wheel stands between two ticks at first is drawn at random.
struct Counters {
    tick_rad: f64,
    phases: [f64; 2],
    last: Option<(f64, [f64; 2])>,
    lost_rad: [f64; 2],
}

impl Counters {
    fn new(tick_rad: f64, seed: u64) -> Self {
        let phases = [Purpose::TickLeft, Purpose::TickRight].map(|p| p.stream(seed).uniform());
        Self { tick_rad, phases, last: None, lost_rad: [0.0; 2] }
    }

    /// Speeds since the last row (rad/s, NaN in the first) and counts, of wheels at these angles.
    fn read(&mut self, t_s: f64, angles_rad: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let counts: [f64; 2] = std::array::from_fn(|i| (angles_rad[i] / self.tick_rad + self.phases[i]).floor());
        let before = self.last.replace((t_s, counts));
        let speeds = before.map_or([f64::NAN; 2], |(t0, last)| {
            std::array::from_fn(|i| (counts[i] - last[i]) * self.tick_rad / (t_s - t0))
        });
        (speeds, counts)
    }

    /// The counts where the recorder lost this much of the speeds over the step, rad/s.
    fn without(&mut self, counts: [f64; 2], lost_rad_s: [f64; 2], step_s: f64) -> [f64; 2] {
        std::array::from_fn(|i| {
            if lost_rad_s[i].is_finite() {
                self.lost_rad[i] += lost_rad_s[i] * step_s;
            }
            counts[i] - (self.lost_rad[i] / self.tick_rad).round()
        })
    }
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
        let counters = config.require_encoder()?.tick_rad().map(|tick_rad| Counters::new(tick_rad, seed));
        if counters.is_some() {
            recorded.extend([names::WHEEL_LEFT_TICKS, names::WHEEL_RIGHT_TICKS]);
        }
        if config.pose.is_some() {
            recorded.extend([names::X, names::Y, names::HEADING]);
        }
        let mut truth = vec![
            names::X,
            names::Y,
            names::HEADING,
            truth_names::SPEED,
            truth_names::YAW_RATE,
            truth_names::GYRO_ERROR,
        ];
        if config.traction.is_some() {
            truth.extend([truth_names::SLIP_LEFT, truth_names::SLIP_RIGHT]);
        }
        let step_s = sample_time(config)?;
        Ok(Self {
            step_s,
            first_s: None,
            last_s: None,
            gyro: GyroSensor::new(config.require_gyro()?, step_s, options)?,
            encoder_std_rad_s: config.require_encoder()?.speed_noise_std_rad_s,
            encoders: [Purpose::EncoderLeft.stream(seed), Purpose::EncoderRight.stream(seed)],
            counters,
            pose: config.pose.map(|table| PoseSensor {
                table,
                streams: [Purpose::PoseX, Purpose::PoseY, Purpose::PoseHeading].map(|p| p.stream(seed)),
                next_sample: 0.0,
                first_s: None,
            }),
            recorded: columns(&recorded),
            truth: columns(&truth),
        })
    }

    /// White noise of each instrument times `over_nominal`.
    fn louder(&mut self, over_nominal: impl Fn(Instrument) -> f64) {
        self.gyro.louder(over_nominal(Instrument::Gyro));
        self.encoder_std_rad_s *= over_nominal(Instrument::Wheels);
        if let Some(PoseSensor { table, .. }) = &mut self.pose {
            table.position_std_m *= over_nominal(Instrument::Pose);
            table.heading_std_rad *= over_nominal(Instrument::Pose);
        }
    }

    /// One row at `t_s` of the log's own clock; the speeds of the wheels that it records, rad/s.
    fn record(&mut self, t_s: f64, since_power_on_s: f64, plant: &mut Plant) -> [f64; 2] {
        let begun_s = *self.first_s.get_or_insert(t_s);
        plant.clock(t_s - begun_s, since_power_on_s);
        let motion = *plant.motion();
        let gyro = self.gyro.read(plant.gyro_rad_s(), since_power_on_s);
        let (speeds, counts) = match &mut self.counters {
            Some(counters) => {
                let (speeds, counts) = counters.read(t_s, plant.wheel_angles_rad());
                (speeds, Some(counts))
            }
            None => (plant.wheels_rad_s(), None),
        };
        let wheels_rad_s = std::array::from_fn(|i| speeds[i] + self.encoder_std_rad_s * self.encoders[i].normal());
        let step_s = self.last_s.replace(t_s).map_or(self.step_s, |last| t_s - last);
        let mut reading = Reading { t_s: t_s - begun_s, step_s, wheels_rad_s, gyro_rad_s: gyro.reading_rad_s };
        plant.record(&mut reading);
        let counts = self.counters.as_mut().zip(counts).map(|(counters, counts)| {
            counters.without(counts, std::array::from_fn(|i| wheels_rad_s[i] - reading.wheels_rad_s[i]), step_s)
        });
        let mut columns = self.recorded.iter_mut();
        let mut put = |value| columns.next().into_iter().for_each(|column| column.1.push(value));
        put(since_power_on_s);
        put(reading.gyro_rad_s);
        reading.wheels_rad_s.into_iter().for_each(&mut put);
        counts.into_iter().flatten().for_each(&mut put);
        if let Some(pose) = &mut self.pose {
            pose.read(t_s, &plant.tracked()).into_iter().for_each(&mut put);
        }
        let Motion { x_m, y_m, heading_rad, speed_m_s, yaw_rate_rad_s } = motion;
        let row = [x_m, y_m, heading_rad, speed_m_s, yaw_rate_rad_s, gyro.error_rad_s];
        let slips = plant.slips().into_iter().flatten();
        for (column, value) in self.truth.iter_mut().zip(row.into_iter().chain(slips)) {
            column.1.push(value);
        }
        reading.wheels_rad_s
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
        // what is not finite once, stays so
        if self.truth.iter().any(|(_, values)| values.last().is_some_and(|v| !v.is_finite())) {
            let row = self.truth.iter().filter_map(|(_, values)| values.iter().position(|v| !v.is_finite())).min();
            let found = format!("the robot runs away from t = {:.3} s on", time.at(row.unwrap_or(0)));
            return Err(Error::new(ErrorKind::Value, "configuration", found)
                .at("`[[effect]]`")
                .hint("give parameters under which its speeds stay finite"));
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
