//! A [dv/dt, dω/dt]' = [Tl/rl + Tr/rr + M d ω² + F, b (Tr/rr - Tl/rl) - M d v ω + N]',  Ti = gi ui - c wheel_i
//! A = [[M + Jw (1/rl² + 1/rr²), Jw b (1/rr² - 1/rl²)], [Jw b (1/rr² - 1/rl²), Jc + M d² + Jw b² (1/rl² + 1/rr²)]]
//! wheel_l = (v - b ω)/rl,  wheel_r = (v + b ω)/rr,  dx/dt = v cos θ - s sin θ,  dy/dt = v sin θ + s cos θ,  dθ/dt = ω
//!
//! The robot on two wheels as effects may change it: separate radii rl, rr and motor gains gl, gr, the centre of mass d
//! ahead of the axle, extra force F and moment N, sideways speed s, and sensors that change wheel speeds and yaw rate.
//! With rl = rr, gl = gr = 1, d = F = N = s = 0 it is the nominal robot ([`crate::vehicle::Rolling`]).

pub use super::instrument::Instrument;
pub use super::moving::Moving;
pub use super::past::Past;

use super::in_filter::InFilter;
use crate::config::Vehicle;

/// Time for which an uncertain force of a wheel ([`DriveEffect::force_std_n`]) lasts, s: several steps, not one.
pub(crate) const FORCE_LASTING_S: f64 = 0.05;

/// Standard gravity, m/s².
pub(crate) const GRAVITY_M_S2: f64 = 9.806_65;

/// Constants of the equations of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// M, kg
    pub mass_kg: f64,
    /// Jc about the vertical axis through the centre of mass, kg·m²
    pub yaw_inertia_kg_m2: f64,
    /// b, m
    pub half_track_m: f64,
    /// Left and right, m
    pub radius_m: [f64; 2],
    /// Jw, kg·m²
    pub wheel_inertia_kg_m2: f64,
    /// c, N·m·s
    pub viscous_friction_n_m_s: f64,
    /// Torque of each motor over its command, left and right
    pub torque_gain: [f64; 2],
    /// d, m
    pub com_offset_m: f64,
    /// Density of the white noise of each motor's torque, N·m·√s
    pub torque_noise_n_m_sqrt_s: f64,
    /// Known load, a point mass at the centre of mass, kg: of [`DriveModel::robot`] it is part of M, elsewhere it is not. It
    /// adds to M wherever that stands, so also to the weight on the wheels, and not to Jc.
    pub load_kg: f64,
}

impl From<&Vehicle> for Robot {
    fn from(vehicle: &Vehicle) -> Self {
        Self {
            mass_kg: vehicle.mass_kg,
            yaw_inertia_kg_m2: vehicle.yaw_inertia_kg_m2,
            half_track_m: vehicle.half_track_m,
            radius_m: [vehicle.wheel_radius_m; 2],
            wheel_inertia_kg_m2: vehicle.wheel_inertia_kg_m2,
            viscous_friction_n_m_s: vehicle.viscous_friction_n_m_s,
            torque_gain: [1.0; 2],
            com_offset_m: 0.0,
            torque_noise_n_m_sqrt_s: vehicle.torque_noise_n_m_sqrt_s,
            load_kg: vehicle.load_kg,
        }
    }
}

impl Robot {
    /// A small robot for tests, on wheels without inertia or friction.
    #[cfg(test)]
    pub(crate) fn small() -> Self {
        Self {
            mass_kg: 10.0,
            yaw_inertia_kg_m2: 0.3,
            half_track_m: 0.25,
            radius_m: [0.1; 2],
            wheel_inertia_kg_m2: 0.0,
            viscous_friction_n_m_s: 0.0,
            torque_gain: [1.0; 2],
            com_offset_m: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            load_kg: 0.0,
        }
    }

    /// The robot with its load as part of its mass.
    #[must_use]
    pub(crate) fn loaded(self) -> Self {
        Self { mass_kg: self.mass_kg + self.load_kg, ..self }
    }

    /// Wheel speeds without slip, left and right, rad/s.
    #[must_use]
    #[inline]
    pub(crate) fn wheels_rad_s(&self, speed_m_s: f64, yaw_rate_rad_s: f64) -> [f64; 2] {
        let turn = self.half_track_m * yaw_rate_rad_s;
        [(speed_m_s - turn) / self.radius_m[0], (speed_m_s + turn) / self.radius_m[1]]
    }

    /// Speed (m/s) and yaw rate (rad/s) at which the wheels turn like this (left, right; rad/s) where they roll.
    #[must_use]
    #[inline]
    pub(crate) fn speed_and_yaw_rate(&self, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let [left, right]: [f64; 2] = std::array::from_fn(|i| self.radius_m[i] * wheels_rad_s[i]);
        [0.5 * (left + right), 0.5 * (right - left) / self.half_track_m]
    }

    /// Speed of the ground under each wheel, left and right, m/s.
    #[must_use]
    #[inline]
    pub(crate) fn ground_speeds_m_s(&self, speed_m_s: f64, yaw_rate_rad_s: f64) -> [f64; 2] {
        let turn = self.half_track_m * yaw_rate_rad_s;
        [speed_m_s - turn, speed_m_s + turn]
    }

    /// Load of one wheel: half the weight, N.
    #[must_use]
    pub(crate) fn wheel_load_n(&self) -> f64 {
        0.5 * self.mass_kg * GRAVITY_M_S2
    }

    /// Mass, kg, and yaw inertia about the middle of the axle, kg·m², that torques of the motors accelerate.
    #[must_use]
    pub(crate) fn accelerated(&self) -> [f64; 2] {
        with_spin([self.mass_kg, self.yaw_inertia_kg_m2], self.half_track_m, self.wheel_inertia_kg_m2, self.radius_m)
    }

    fn inverse_inertia(&self) -> [f64; 3] {
        let (b, jw) = (self.half_track_m, self.wheel_inertia_kg_m2);
        let [l, r] = self.radius_m.map(|r| jw / (r * r));
        let mass = self.mass_kg + l + r;
        let cross = b * (r - l);
        let inertia = self.yaw_inertia_kg_m2 + self.mass_kg * self.com_offset_m * self.com_offset_m + b * b * (l + r);
        let determinant = mass * inertia - cross * cross;
        [inertia / determinant, -cross / determinant, mass / determinant]
    }
}

/// Mass, kg, and yaw inertia, kg·m², with the spin of the wheels: M + ΣJw/r², I + b² ΣJw/r².
#[must_use]
pub(crate) fn with_spin(own: [f64; 2], half_track_m: f64, wheel_kg_m2: f64, radius_m: [f64; 2]) -> [f64; 2] {
    let spin: f64 = radius_m.iter().map(|r| wheel_kg_m2 / (r * r)).sum();
    [own[0] + spin, own[1] + half_track_m * half_track_m * spin]
}

/// Variables that the force of an effect depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForceFollows {
    /// x or y.
    pub position: bool,
    /// Heading.
    pub heading: bool,
    /// Speed or yaw rate.
    pub speeds: bool,
    /// Accelerations or forces of the wheels, of the last instant.
    pub accelerations: bool,
}

/// Functions of the motion that the force of an effect is made of.
pub(crate) type Shape = [f64; 12];

/// An effect at work in one drive. Its parameters are fixed when it is made.
pub trait DriveEffect: Send + Sync {
    /// Changes the robot's constants.
    fn robot(&self, robot: &mut Robot) {
        let _ = robot;
    }

    /// Extra force (N, forwards) and moment (N·m, to the left). The accelerations in `at` are those of the last instant.
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let _ = (robot, at);
        [0.0; 2]
    }

    /// Variables that [`Self::force`] depends on; by default any but the position.
    fn force_follows(&self) -> ForceFollows {
        ForceFollows { position: false, heading: true, speeds: true, accelerations: true }
    }

    /// Functions of the motion from which [`Self::force_of`] makes the force. They do not depend on the effect's
    /// parameters.
    fn shape(&self, robot: &Robot, at: &Moving) -> Shape {
        let _ = (robot, at);
        Shape::default()
    }

    /// [`Self::force`], to the last digit, where [`Self::shape`] is known.
    fn force_of(&self, shape: &Shape, robot: &Robot, at: &Moving) -> [f64; 2] {
        let _ = shape;
        self.force(robot, at)
    }

    /// Whether [`Self::force`] is the same on both robots, to the last digit, wherever they are.
    fn pushes_alike(&self, one: &Robot, other: &Robot) -> bool {
        one == other
    }

    /// Sideways speed, to the left, m/s.
    fn sideways_m_s(&self, at: &Moving) -> f64 {
        let _ = at;
        0.0
    }

    /// Wheel speeds under the effect, left and right, rad/s; without it they are `wheels_rad_s`.
    fn wheels_rad_s(&self, robot: &Robot, at: &Moving, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let _ = (robot, at);
        wheels_rad_s
    }

    /// Standard deviation of the wheel speeds that the effect leaves uncertain, left and right, rad/s. A filter adds it
    /// to the encoders' noise.
    fn wheel_std_rad_s(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let _ = (robot, at);
        [0.0; 2]
    }

    /// Variance of each wheel's reading by torque noise that the effect passes on, over the noise's density squared,
    /// (rad/s)²/(N²·m²·s).
    fn wheel_variance_by_torque_noise(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let _ = (robot, at);
        [0.0; 2]
    }

    /// Standard deviation of the force of each wheel that the effect leaves uncertain, left and right, N.
    fn force_std_n(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let _ = (robot, at);
        [0.0; 2]
    }

    /// Reading of the gyro under the effect, before the gyro's own error and noise, rad/s; without it `rate_rad_s`.
    fn gyro_rad_s(&self, at: &Moving, rate_rad_s: f64) -> f64 {
        let _ = at;
        rate_rad_s
    }

    /// Delay of an instrument's readings, s.
    fn delay_s(&self, instrument: Instrument) -> f64 {
        let _ = instrument;
        0.0
    }

    /// Standard deviation of an instrument's white noise over the nominal one.
    fn noise_over_nominal(&self, instrument: Instrument) -> f64 {
        let _ = instrument;
        1.0
    }

    /// Changes one row's readings, noise included, as the recorder does: lost ticks, quantization. Rows ascend.
    fn recorded(&mut self, reading: &mut Reading) {
        let _ = reading;
    }

    /// Form of the effect in a filter, where that is not the equations above as they stand.
    fn in_filter(&self) -> InFilter {
        InFilter::Equations
    }
}

/// One row of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// s since the log began
    pub t_s: f64,
    /// Sample time, s
    pub step_s: f64,
    /// Left and right, rad/s
    pub wheels_rad_s: [f64; 2],
    /// rad/s
    pub gyro_rad_s: f64,
}

/// The robot with a set of effects.
pub struct DriveModel {
    /// Its constants, effects included.
    pub robot: Robot,
    effects: Vec<Box<dyn DriveEffect>>,
    inverse: [f64; 3],
    wheel_delay_s: f64,
    /// Whether a force depends on the position.
    pub(crate) follows_position: bool,
}

impl DriveModel {
    /// `nominal` changed by `effects`, in their order, and with its load.
    #[must_use]
    pub(crate) fn new(nominal: Robot, effects: Vec<Box<dyn DriveEffect>>) -> Self {
        let mut robot = nominal;
        effects.iter().for_each(|e| e.robot(&mut robot));
        // a load is weighed: no effect makes more or less of it
        let robot = robot.loaded();
        let wheel_delay_s = effects.iter().map(|e| e.delay_s(Instrument::Wheels)).sum();
        let follows_position = effects.iter().any(|e| e.force_follows().position);
        Self { robot, effects, inverse: robot.inverse_inertia(), wheel_delay_s, follows_position }
    }

    /// ∂[dv/dt, dω/dt]/∂[uL, uR], rows then columns.
    #[must_use]
    pub(crate) fn by_torque(&self) -> [[f64; 2]; 2] {
        let [l, r] = [0, 1].map(|i| self.robot.torque_gain[i] / self.robot.radius_m[i]);
        let b = self.robot.half_track_m;
        let [p, q, s] = self.inverse;
        [[p * l - q * b * l, p * r + q * b * r], [q * l - s * b * l, q * r + s * b * r]]
    }

    /// Puts accelerations and wheel forces under `torques_n_m` (left, right; commanded) into `at`.
    #[inline]
    pub(crate) fn accelerate(&self, at: &mut Moving, torques_n_m: [f64; 2]) {
        self.accelerate_with(at, torques_n_m, |_, _| None);
    }

    /// The same, where `known` gives force (N) and moment (N·m) of some effects by their index, as [`Self::forces`] has
    /// them.
    #[inline]
    pub(crate) fn accelerate_with(
        &self,
        at: &mut Moving,
        torques_n_m: [f64; 2],
        mut known: impl FnMut(usize, &dyn DriveEffect) -> Option<[f64; 2]>,
    ) {
        let robot = &self.robot;
        let (v, w) = (at.speed_m_s, at.yaw_rate_rad_s);
        let wheels = robot.wheels_rad_s(v, w);
        let rim: [f64; 2] = std::array::from_fn(|i| {
            (robot.torque_gain[i] * torques_n_m[i] - robot.viscous_friction_n_m_s * wheels[i]) / robot.radius_m[i]
        });
        let com = robot.mass_kg * robot.com_offset_m;
        let mut force = rim[0] + rim[1] + com * w * w;
        let mut moment = robot.half_track_m * (rim[1] - rim[0]) - com * v * w;
        for (place, effect) in self.effects.iter().enumerate() {
            let [f, n] = known(place, effect.as_ref()).unwrap_or_else(|| effect.force(robot, at));
            force += f;
            moment += n;
        }
        let [p, q, s] = self.inverse;
        at.acceleration_m_s2 = p * force + q * moment;
        at.yaw_acceleration_rad_s2 = q * force + s * moment;
        let spin = robot.wheels_rad_s(at.acceleration_m_s2, at.yaw_acceleration_rad_s2);
        at.wheel_force_n = std::array::from_fn(|i| rim[i] - robot.wheel_inertia_kg_m2 * spin[i] / robot.radius_m[i]);
    }

    /// Extra force (N, forwards) and moment (N·m, to the left) of each effect, under the accelerations in `at`.
    pub(crate) fn forces(&self, at: &Moving, out: &mut Vec<[f64; 2]>) {
        out.clear();
        out.extend(self.effects.iter().map(|e| e.force(&self.robot, at)));
    }

    /// Recomputes those of [`Self::forces`] that depend on accelerations, for those now in `at`.
    pub(crate) fn renew_forces(&self, at: &Moving, forces: &mut [[f64; 2]]) {
        for (effect, force) in self.effects.iter().zip(forces).filter(|(e, _)| e.force_follows().accelerations) {
            *force = effect.force(&self.robot, at);
        }
    }

    /// Whether the effect of index `place` exerts the same force on `other` as on this robot.
    #[must_use]
    pub(crate) fn pushes_alike(&self, place: usize, other: &Robot) -> bool {
        self.effects[place].pushes_alike(&self.robot, other)
    }

    /// d[x, y, θ, v, ω]/dt where the accelerations are those in `at`.
    #[must_use]
    #[inline]
    pub(crate) fn rates(&self, at: &Moving) -> [f64; 5] {
        let sideways = self.sideways_m_s(at);
        let (sin, cos) = at.heading_rad.sin_cos();
        [
            at.speed_m_s * cos - sideways * sin,
            at.speed_m_s * sin + sideways * cos,
            at.yaw_rate_rad_s,
            at.acceleration_m_s2,
            at.yaw_acceleration_rad_s2,
        ]
    }

    /// Sideways speed, m/s.
    #[must_use]
    #[inline]
    pub(crate) fn sideways_m_s(&self, at: &Moving) -> f64 {
        self.effects.iter().map(|e| e.sideways_m_s(at)).sum()
    }

    /// The robot of which late wheels tell: slip is as late as the rest of their readings.
    fn read_by_wheels<'a>(&self, at: &Moving<'a>) -> Moving<'a> {
        if self.wheel_delay_s == 0.0 { *at } else { at.ago(self.wheel_delay_s) }
    }

    /// Readings of the wheels without noise, left and right, rad/s.
    #[must_use]
    #[inline]
    pub(crate) fn wheels_rad_s(&self, at: &Moving) -> [f64; 2] {
        let at = &self.read_by_wheels(at);
        let rolling = self.robot.wheels_rad_s(at.speed_m_s, at.yaw_rate_rad_s);
        self.effects.iter().fold(rolling, |wheels, e| e.wheels_rad_s(&self.robot, at, wheels))
    }

    /// Covariance of dv/dt and dω/dt by uncertain wheel forces: [v v, v ω, ω ω], SI.
    #[must_use]
    pub(crate) fn force_covariance(&self, at: &Moving) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for effect in &self.effects {
            let [l, r] = effect.force_std_n(&self.robot, at);
            if l == 0.0 && r == 0.0 {
                continue;
            }
            let ([p, q, s], b) = (self.inverse, self.robot.half_track_m);
            for (std, side) in [(l, -b), (r, b)] {
                let (v, w) = (std * (p + q * side), std * (q + s * side));
                sum[0] += v * v;
                sum[1] += v * w;
                sum[2] += w * w;
            }
        }
        sum
    }

    /// Variance that the effects add to each wheel's reading, rad²/s².
    #[must_use]
    #[inline]
    pub(crate) fn wheel_variance_rad2_s2(&self, at: &Moving) -> [f64; 2] {
        let at = &self.read_by_wheels(at);
        self.effects.iter().fold([0.0; 2], |sum, e| {
            let std = e.wheel_std_rad_s(&self.robot, at);
            [sum[0] + std[0] * std[0], sum[1] + std[1] * std[1]]
        })
    }

    /// Variance of each wheel's reading by torque noise, over the noise's density squared, (rad/s)²/(N²·m²·s).
    #[must_use]
    pub(crate) fn wheel_variance_by_torque_noise(&self, at: &Moving) -> [f64; 2] {
        let at = &self.read_by_wheels(at);
        self.effects.iter().fold([0.0; 2], |sum, e| {
            let own = e.wheel_variance_by_torque_noise(&self.robot, at);
            [sum[0] + own[0], sum[1] + own[1]]
        })
    }

    /// Reading of the gyro without its own error and noise, rad/s.
    #[must_use]
    #[inline]
    pub(crate) fn gyro_rad_s(&self, at: &Moving) -> f64 {
        self.effects.iter().fold(at.yaw_rate_rad_s, |rate, e| e.gyro_rad_s(at, rate))
    }

    /// Delay of an instrument's readings, s.
    #[must_use]
    #[inline]
    pub(crate) fn delay_s(&self, instrument: Instrument) -> f64 {
        self.effects.iter().map(|e| e.delay_s(instrument)).sum()
    }

    /// Standard deviation of an instrument's white noise over the nominal one.
    #[must_use]
    pub(crate) fn noise_over_nominal(&self, instrument: Instrument) -> f64 {
        self.effects.iter().map(|e| e.noise_over_nominal(instrument)).product()
    }

    /// Changes a row's readings as the recorder does.
    pub(crate) fn record(&mut self, reading: &mut Reading) {
        self.effects.iter_mut().for_each(|e| e.recorded(reading));
    }
}
