//! row k: read the wheels, command torques, read gyro and pose; then move on by substeps of 1 ms at most, an eighth of that where wheels slip
//!
//! All noise comes from streams of the run that do not depend on what is in the robot: two worlds in the same run differ by
//! their effects alone. Pose noise is drawn along and across the robot, which is the same to any reader and keeps it so for
//! worlds whose headings drift apart.

use super::body::Motion;
use super::machine::{Course, Driver, Machine};
use super::world::World;
use crate::math::random::Stream;

/// One recording before there is anything in it: course, seeds, warm-up of its power-on.
pub(super) struct DriveRun {
    pub course: Course,
    /// Since power-on at the first row, s.
    pub since_power_on_s: f64,
    /// Seed of its noises.
    pub seed: u64,
    /// Warm-up and the rest that the gyro's own effects need.
    pub gyro: crate::bench::worlds::run::Run,
}

/// Signals of a run in one world: left and right wheel, SI.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    /// Commanded, left and right.
    pub torque_n_m: [Vec<f64>; 2],
    pub wheel_rad_s: [Vec<f64>; 2],
    /// Without bias and noise, with what depends on the motion.
    pub gyro_rad_s: Vec<f64>,
    /// Standard deviation of its noise over the nominal one.
    pub gyro_noise: Vec<f64>,
    /// x, y, heading; NaN between samples.
    pub pose: [Vec<f64>; 3],
    /// Speeds themselves.
    pub v_m_s: Vec<f64>,
    pub w_rad_s: Vec<f64>,
}

/// Streams of a run's seed.
const TORQUE: u64 = 1;
const WHEEL: u64 = 2;
const POSE: u64 = 3;
const JITTER: u64 = 4;
pub(super) const GYRO: u64 = 5;
const WHEEL_JITTER: u64 = 6;
const POSE_JITTER: u64 = 7;

/// Longest time for which torque noise is held, s.
const SUBSTEP_S: f64 = 0.001;
/// Steps in that time where wheels slip: their contact follows within some tenths of a millisecond.
const SLIPPING_STEPS: usize = 8;

/// The last seconds of what sensors may read late.
struct Ring {
    rows: Vec<[f64; 6]>,
    next: usize,
    h: f64,
}

impl Ring {
    fn new(h: f64) -> Self {
        Self { rows: vec![[0.0; 6]; 1024], next: 0, h }
    }

    fn push(&mut self, row: [f64; 6]) {
        self.rows[self.next] = row;
        self.next = (self.next + 1) % self.rows.len();
    }

    /// The row `delay_s` before the last one, interpolated linearly.
    fn at(&self, delay_s: f64) -> [f64; 6] {
        let n = self.rows.len();
        let back = (delay_s / self.h).clamp(0.0, (n - 2) as f64);
        let (whole, part) = (back as usize, back.fract());
        let (new, old) = (self.rows[(self.next + n - 1 - whole) % n], self.rows[(self.next + 2 * n - 2 - whole) % n]);
        std::array::from_fn(|i| new[i] * (1.0 - part) + old[i] * part)
    }
}

/// Both encoders and their low-pass states.
struct Wheels {
    held: [f64; 2],
}

impl Wheels {
    /// Readings of both encoders at `t`, rad/s; `draws` are of the noises, and of the delay's jitter between -1 and 1.
    fn read(&mut self, machine: &Machine, world: &World, ring: &Ring, t: f64, draws: [f64; 3]) -> [f64; 2] {
        let e = &world.encoders;
        let [.., jitter] = draws;
        let past = ring.at(e.delay_s * (1.0 + e.delay_jitter * jitter));
        let follow = if e.lag_s > 0.0 { -(-machine.step_s / e.lag_s).exp_m1() } else { 1.0 };
        std::array::from_fn(|i| {
            self.held[i] += follow * (past[1 + i] - self.held[i]);
            let mut speed = self.held[i];
            if let Some((wheel, bursts)) = &e.missed
                && *wheel == i
                && let Some([.., lost]) = bursts.iter().find(|[from, to, _]| (*from..*to).contains(&t))
            {
                speed *= 1.0 - lost;
            }
            let loud = (1.0 + e.noise_growth_s * speed.abs()) * e.loud.at(t);
            speed += machine.wheel_std_rad_s * loud * draws[i];
            match e.lsb_rad_s {
                0.0 => speed,
                lsb => lsb * ((speed / lsb - e.offset).round() + e.offset),
            }
        })
    }
}

/// The gyro's motion-dependent part.
#[derive(Default)]
struct Rectifier {
    bias: f64,
}

impl Rectifier {
    fn read(&mut self, dt: f64, world: &World, ring: &Ring, motion: &Motion, jitter: f64) -> f64 {
        let g = &world.gyro;
        let w = ring.at(g.delay_s * (1.0 + g.delay_jitter * jitter))[0];
        let square = motion.v * motion.v * (1.0 + g.rectification_bend * (motion.v.abs() - 0.5));
        let follow = if g.rectification_lag_s > 0.0 { -(-dt / g.rectification_lag_s).exp_m1() } else { 1.0 };
        self.bias += follow * (g.rectification_rad_s_per_m2_s2 * square - self.bias);
        let [error, times, phase] = g.heading_error;
        let gain = 1.0 + g.scale + 0.5 * g.asymmetry * (w / g.asymmetry_width_rad_s).tanh();
        gain * w
            + self.bias
            + g.g_sensitivity_s_m * motion.acceleration
            + error * ((times * motion.heading + phase).sin() - phase.sin())
    }
}

/// The controller and its states.
struct Control<'a> {
    driver: &'a Driver,
    filtered: [f64; 2],
    sum: [f64; 2],
}

impl Control<'_> {
    fn torque(&mut self, wanted: [f64; 2], measured: [f64; 2], dt: f64) -> [f64; 2] {
        let d = self.driver;
        let follow = if d.filter_s > 0.0 { -(-dt / d.filter_s).exp_m1() } else { 1.0 };
        std::array::from_fn(|i| {
            self.filtered[i] += follow * (measured[i] - self.filtered[i]);
            let error = wanted[i] - self.filtered[i];
            let free = d.proportional_n_m_s * error + self.sum[i];
            let out = free.clamp(-d.limit_n_m, d.limit_n_m);
            // the sum waits while the torque is at its limit
            if out == free {
                self.sum[i] += d.integral_n_m * error * dt;
            }
            out
        })
    }
}

/// Torque at the wheel from the commanded one.
fn motor(world: &World, command: f64, i: usize, elapsed: f64) -> f64 {
    let m = &world.motors;
    let mut u = command * m.gain[i] * (1.0 - m.sag * elapsed.powf(m.sag_bend));
    if m.dead_band_n_m > 0.0 {
        u = (u.abs() - m.dead_band_n_m).max(0.0).copysign(u);
    }
    u.clamp(-m.limit_n_m, m.limit_n_m)
}

/// Drives `world` through `run`; `noise` scales every noise but the gyro's, which is added later.
pub(super) fn drive(machine: &Machine, run: &DriveRun, world: &World, noise: f64) -> Trace {
    let (len, dt, vehicle) = (run.course.len(), machine.step_s, &machine.vehicle);
    let substeps = (dt / SUBSTEP_S - 1e-9).ceil().max(1.0) as usize;
    let h = dt / substeps as f64;
    let parts = if world.wheels.grip.is_some() { SLIPPING_STEPS } else { 1 };
    let [mut torques, mut wheel_noise, mut pose_noise, mut jitter, mut wheel_jitter, mut pose_jitter] =
        [TORQUE, WHEEL, POSE, JITTER, WHEEL_JITTER, POSE_JITTER].map(|k| Stream::new(run.seed, k));
    let torque_std = noise * vehicle.torque_noise_n_m_sqrt_s / h.sqrt();
    let room = || Vec::with_capacity(len);
    let mut out = Trace {
        torque_n_m: [room(), room()],
        wheel_rad_s: [room(), room()],
        gyro_rad_s: room(),
        gyro_noise: room(),
        pose: [room(), room(), room()],
        v_m_s: room(),
        w_rad_s: room(),
    };
    let mut motion = Motion::default();
    let (mut ring, mut wheels, mut rectifier) = (Ring::new(h), Wheels { held: [0.0; 2] }, Rectifier::default());
    let mut control = Control { driver: &machine.driver, filtered: [0.0; 2], sum: [0.0; 2] };
    let mut at_motor = [0.0; 2];
    let follow = if world.motors.lag_s > 0.0 { -(-h / world.motors.lag_s).exp_m1() } else { 1.0 };
    for k in 0..len {
        let t = k as f64 * dt;
        let draws = [noise * wheel_noise.normal(), noise * wheel_noise.normal(), 2.0 * wheel_jitter.uniform() - 1.0];
        let measured = wheels.read(machine, world, &ring, t, draws);
        let (b, r) = (vehicle.half_track_m, vehicle.wheel_radius_m);
        let (v, w) = (run.course.speed_m_s[k], run.course.yaw_rate_rad_s[k]);
        let command = control.torque([(v - b * w) / r, (v + b * w) / r], measured, dt);
        out.gyro_rad_s.push(rectifier.read(dt, world, &ring, &motion, 2.0 * jitter.uniform() - 1.0));
        out.gyro_noise.push((1.0 + world.gyro.noise_growth_s_m * motion.v.abs()) * world.gyro.loud.at(t));
        let pose = (k % machine.pose_rows == 0).then(|| {
            let draws = [pose_noise.normal(), pose_noise.normal(), pose_noise.normal(), pose_noise.uniform()];
            let late = 1.0 + world.pose.delay_jitter * (2.0 * pose_jitter.uniform() - 1.0);
            read_pose(
                machine,
                world,
                ring.at(world.pose.delay_s * late + world.pose.drift * t),
                draws,
                noise * world.pose.loud.at(t),
            )
        });
        for i in 0..3 {
            out.pose[i].push(pose.map_or(f64::NAN, |p| p[i]));
        }
        for i in 0..2 {
            out.torque_n_m[i].push(command[i]);
            out.wheel_rad_s[i].push(measured[i]);
        }
        out.v_m_s.push(motion.v);
        out.w_rad_s.push(motion.w);
        for j in 0..substeps {
            let elapsed = k as f64 / len as f64;
            let torque = std::array::from_fn(|i| {
                at_motor[i] += follow * (motor(world, command[i], i, elapsed) - at_motor[i]);
                at_motor[i] + torque_std * torques.normal()
            });
            for part in 0..parts {
                let at_s = t + (j as f64 + part as f64 / parts as f64) * h;
                motion.step(vehicle, world, torque, at_s, h / parts as f64);
            }
            ring.push([motion.w, motion.wheels[0], motion.wheels[1], motion.x, motion.y, motion.heading]);
        }
    }
    out
}

/// Reading of the pose reference, x, y (m) and heading (rad), for the row `past` of the robot.
fn read_pose(machine: &Machine, world: &World, past: [f64; 6], draws: [f64; 4], noise: f64) -> [f64; 3] {
    let p = &world.pose;
    let [.., x, y, heading] = past;
    let (sin, cos) = heading.sin_cos();
    let wild = if draws[3] < p.outliers { p.outlier_size } else { 0.0 };
    let [along, across, turn, _] = draws;
    let (n, std) = ([along, across], noise * machine.pose.position_std_m);
    // an outlier is off in the direction of its noise
    let size = n[0].hypot(n[1]).max(1e-9);
    let [e0, e1] = n.map(|v| v * std + wild * machine.pose.position_std_m * v / size);
    let [ahead, left] = p.lever_m;
    [
        p.scale * (x + ahead * (cos - 1.0) - left * sin) + e0 * cos - e1 * sin,
        p.scale * (y + ahead * sin + left * (cos - 1.0)) + e0 * sin + e1 * cos,
        heading + noise * machine.pose.heading_std_rad * turn,
    ]
}
