//! d[x, y, θ, v, ω]/dt of a robot with effects ([`DriveModel`]); h(x) of each sensor and ∂h/∂x of the same equations
//!
//! The step is Runge's and Kutta's of order 4 in parts of at most 2 ms, as dry friction near standstill asks for. Φ, Γ and
//! ∂h/∂x are central differences over one standard deviation either side of θ, v and ω and of the disturbances: the slope of
//! the chord, which at a kink (dry friction at v = 0, a gyro's gain that differs from left to right) is the line that fits
//! best over what the filter does not know, and elsewhere is the derivative.
//!
//! Noise that is correlated in time has states of its own behind the eight:
//!
//! ```text
//!     dn/dt = -n/τ + white noise, variance σ²     an exponentially correlated part of the gyro's error
//!     d(c, s)/dt = ω (-s, c), c + 0 s is read     a sinusoid of unknown phase, variance A²/2 each
//! ```
//!
//! A sensor that switches between two ways of reading ([`Switch`]) is a Markov chain whose probability p is carried beside
//! the state. A reading y, expected h₀ = g₀ h + o₀ or h₁ = g₁ h + o₁ under variances S₀ and S₁, first makes p of
//! p N(y; h₁, S₁)/(p N(y; h₁, S₁) + (1 - p) N(y; h₀, S₀)), and is then taken in with the moments of the mixture: expected
//! (1 - p) h₀ + p h₁, noise r + (1 - p) r₀ + p r₁ + p (1 - p) (h₁ - h₀)². Where p is near zero or one, which is nearly always,
//! that is exact; in between it is the generalised pseudo-Bayes estimate of order one (Ackerson and Fu, "On state estimation in
//! switching environments", IEEE Trans. Automatic Control 15 (1970) 10).

use super::model::{BENDS, Expected, Input, MotionModel, Transition, bits, state};
use super::reading::Sensor;
use super::rolling_model::{ROLLING_STATES, motion_of};
use super::ud::UdCovariance;
use crate::model::drive::{DriveModel, FORCE_LASTING_S, Moving};
use crate::model::{Switch, Way};
use nalgebra::{SMatrix, SVector};
use state::{GYRO_ERROR, HEADING, SPEED, X, Y, YAW_RATE};
use std::sync::Arc;

/// States with those of correlated noise. Models with as many also carry how forces follow the position.
pub(super) const COLOURED_STATES: usize = 12;
/// Those of correlated noise.
pub(super) const COLOURS: usize = COLOURED_STATES - ROLLING_STATES;

/// Longest part of a step, s.
const LONGEST_S: f64 = 2e-3;
/// A bound on the parts of a step: motion through a gap of minutes means little, and must not cost much.
const PARTS_LIMIT: f64 = 1e4;

/// States that the motion mostly depends on, and states that a step changes: forces that follow the position depend on all.
const CAUSES: [usize; 3] = [HEADING, SPEED, YAW_RATE];
const MOVED: [usize; 5] = [X, Y, HEADING, SPEED, YAW_RATE];
/// Reach of the differences: rad, m/s, rad/s, and of a disturbance in its unit. Below the least, rounding shows; beyond the
/// most, the first reading is yet to come.
const LEAST: f64 = 1e-6;
const MOST: f64 = 0.3;

/// Noise that is correlated in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Colour {
    /// Standard deviation and correlation time, s.
    Decaying { std: f64, time_s: f64 },
    /// Amplitude and angular frequency, rad/s.
    Ringing { amplitude: f64, omega: f64 },
}

impl Colour {
    /// How many states it takes.
    pub(crate) fn states(&self) -> usize {
        match self {
            Self::Decaying { .. } => 1,
            Self::Ringing { .. } => 2,
        }
    }
}

/// Which sensor switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Switched {
    Gyro,
    Wheel(usize),
}

impl Switched {
    fn is_read_by(self, sensor: Sensor) -> bool {
        match self {
            Self::Gyro => sensor == Sensor::Gyro,
            Self::Wheel(0) => matches!(sensor, Sensor::WheelLeft | Sensor::Speed),
            Self::Wheel(_) => matches!(sensor, Sensor::WheelRight | Sensor::Speed),
        }
    }
}

/// A switch, with its probability and times.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Watched {
    of: Switched,
    switch: Switch,
    probability: f64,
    /// When it was last asked, s since power-on.
    asked_s: Option<f64>,
    /// Since when the second way is the more probable, s since power-on.
    turned_s: Option<f64>,
}

/// The robot with effects, rolling, as a filter's motion model.
#[derive(Clone)]
pub(super) struct ChangedModel<const N: usize> {
    robot: Arc<DriveModel>,
    torque_noise_density: f64,
    /// Radius that an odometry's speed was made with, m.
    wheel_radius_m: f64,
    /// Variance that a lattice adds to a wheel's reading, rad²/s².
    lattice_variance: f64,
    t_s: f64,
    since_power_on_s: f64,
    /// Input of the last step; `None` before the first.
    input: Option<Input>,
    watched: Vec<Watched>,
    colours: Vec<Colour>,
}

/// Parts of a changed model.
pub(super) struct Changes {
    pub robot: DriveModel,
    pub torque_noise_density: f64,
    pub wheel_radius_m: f64,
    pub lattice_rad_s: f64,
    pub switches: Vec<(Switched, Switch)>,
    pub colours: Vec<Colour>,
}

impl<const N: usize> ChangedModel<N> {
    /// The robot at the beginning of a log, `since_power_on_s` after the gyro's power-on.
    pub(crate) fn new(changes: Changes, since_power_on_s: f64) -> Self {
        let watch = |(of, switch): (Switched, Switch)| Watched {
            of,
            switch,
            probability: switch.start,
            asked_s: None,
            turned_s: None,
        };
        Self {
            robot: Arc::new(changes.robot),
            torque_noise_density: changes.torque_noise_density,
            wheel_radius_m: changes.wheel_radius_m,
            lattice_variance: changes.lattice_rad_s * changes.lattice_rad_s / 12.0,
            t_s: 0.0,
            since_power_on_s,
            input: None,
            watched: changes.switches.into_iter().map(watch).collect(),
            colours: changes.colours,
        }
    }

    /// The robot in this state, without accelerations and forces.
    fn at(&self, motion: &[f64; 5]) -> Moving<'static> {
        Moving {
            t_s: self.t_s,
            since_power_on_s: self.since_power_on_s,
            x_m: motion[0],
            y_m: motion[1],
            heading_rad: motion[2],
            speed_m_s: motion[3],
            yaw_rate_rad_s: motion[4],
            acceleration_m_s2: 0.0,
            yaw_acceleration_rad_s2: 0.0,
            wheel_force_n: [0.0; 2],
            past: None,
        }
    }

    /// The robot in this state, under the last input.
    fn pushed(&self, motion: &[f64; 5]) -> Moving<'static> {
        let mut at = self.at(motion);
        if let Some(Input::Torques(torques)) = self.input {
            self.robot.accelerate(&mut at, torques);
        }
        at
    }

    /// d[x, y, θ, v, ω]/dt.
    fn rates(&self, motion: &[f64; 5], after_s: f64, input: Input, disturbances: [f64; 2]) -> [f64; 5] {
        let mut at = self.at(motion);
        at.t_s += after_s;
        at.since_power_on_s += after_s;
        match input {
            Input::Torques([left, right]) => {
                self.robot.accelerate(&mut at, [left + disturbances[0], right + disturbances[1]]);
            }
            Input::Accelerations(_) => {
                [at.acceleration_m_s2, at.yaw_acceleration_rad_s2] = disturbances;
            }
        }
        self.robot.rates(&at)
    }

    /// The motion `dt_s` later.
    fn flow(&self, start: [f64; 5], input: Input, disturbances: [f64; 2], dt_s: f64) -> [f64; 5] {
        let parts = (dt_s / LONGEST_S).ceil().clamp(1.0, PARTS_LIMIT);
        let h = dt_s / parts;
        let mut motion = start;
        for part in 0..parts as usize {
            let from_s = part as f64 * h;
            let at = |k: &[f64; 5], by: f64| std::array::from_fn(|i| motion[i] + by * k[i]);
            let rates = |m: &[f64; 5], after_s| self.rates(m, after_s, input, disturbances);
            let k1 = rates(&motion, from_s);
            let k2 = rates(&at(&k1, 0.5 * h), from_s + 0.5 * h);
            let k3 = rates(&at(&k2, 0.5 * h), from_s + 0.5 * h);
            let k4 = rates(&at(&k3, h), from_s + h);
            motion = std::array::from_fn(|i| motion[i] + h * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        }
        motion
    }

    /// Reading of `sensor` (gyro, wheels or speed) without noise, in its unit; `gains` are factors on the wheels'
    /// readings.
    fn reads(&self, sensor: Sensor, at: &Moving, gains: [f64; 2]) -> f64 {
        if sensor == Sensor::Gyro {
            return self.robot.gyro_rad_s(at);
        }
        let wheels = self.robot.wheels_rad_s(at);
        match sensor {
            Sensor::WheelLeft => gains[0] * wheels[0],
            Sensor::WheelRight => gains[1] * wheels[1],
            _ => 0.5 * self.wheel_radius_m * (gains[0] * wheels[0] + gains[1] * wheels[1]),
        }
    }

    /// The reading without switches, and its derivative by the states.
    fn plain(
        &self,
        sensor: Sensor,
        gains: [f64; 2],
        mean: &SVector<f64, N>,
        reach: [f64; 3],
    ) -> (f64, SVector<f64, N>, Moving<'static>) {
        let motion = motion_array(mean);
        let here = self.pushed(&motion);
        let mut value = self.reads(sensor, &here, gains);
        let mut by_state = SVector::zeros();
        for (i, h) in CAUSES.into_iter().zip(reach) {
            let at = |sign: f64| {
                let mut moved = motion;
                moved[i] += sign * h;
                self.reads(sensor, &self.pushed(&moved), gains)
            };
            by_state[i] = (at(1.0) - at(-1.0)) / (2.0 * h);
        }
        if sensor == Sensor::Gyro {
            by_state[GYRO_ERROR] = 1.0;
            value += mean[GYRO_ERROR];
            let mut first = ROLLING_STATES;
            for colour in &self.colours {
                by_state[first] = 1.0;
                value += mean[first];
                first += colour.states();
            }
        }
        (value, by_state, here)
    }

    /// Variance that the effects add to a reading of `sensor`.
    fn added(&self, sensor: Sensor, at: &Moving) -> f64 {
        let [left, right] = self.robot.wheel_variance_rad2_s2(at).map(|v| v + self.lattice_variance);
        match sensor {
            Sensor::WheelLeft => left,
            Sensor::WheelRight => right,
            Sensor::Speed => 0.25 * self.wheel_radius_m * self.wheel_radius_m * (left + right),
            _ => 0.0,
        }
    }

    /// Variances of the disturbances: torque noise, and uncertain forces as torques.
    fn disturbing(&self, motion: &[f64; 5], input: Input, dt_s: f64) -> [f64; 2] {
        let torques = match input {
            Input::Accelerations(densities) => return densities.map(|d| d / dt_s),
            Input::Torques(torques) => torques,
        };
        let noise = self.torque_noise_density * self.torque_noise_density / dt_s;
        let mut at = self.at(motion);
        self.robot.accelerate(&mut at, torques);
        let [vv, vw, ww] = self.robot.force_covariance(&at);
        if vv == 0.0 && ww == 0.0 {
            return [noise; 2];
        }
        // forces at the rims act as torques do: B C Bᵀ of torques is the covariance of accelerations
        let [[a, b], [c, d]] = self.robot.by_torque();
        let determinant = a * d - b * c;
        let square = |p: f64, q: f64| (p * p * vv + 2.0 * p * q * vw + q * q * ww) / (determinant * determinant);
        [square(d, -b), square(-c, a)].map(|v| noise + v * FORCE_LASTING_S / dt_s)
    }
}

fn motion_array<const N: usize>(mean: &SVector<f64, N>) -> [f64; 5] {
    let m = motion_of(mean);
    [m.x_m, m.y_m, m.heading_rad, m.speed_m_s, m.yaw_rate_rad_s]
}

fn reach<const N: usize>(covariance: Option<&UdCovariance<N>>, cause: usize) -> f64 {
    covariance.map_or(LEAST, |p| p.element(cause, cause).sqrt().clamp(LEAST, MOST))
}

/// ln N(y; mean, variance) without the constant.
fn ln_normal(residual: f64, variance: f64) -> f64 {
    -0.5 * (residual * residual / variance + variance.ln())
}

impl<const N: usize> MotionModel<N> for ChangedModel<N> {
    const DEPENDS: [u32; N] = {
        let mut rows = [0; N];
        // the position is among the causes where there is room for it
        let causing = if N > ROLLING_STATES { bits(&MOVED) } else { bits(&CAUSES) };
        let mut i = 0;
        while i < MOVED.len() {
            rows[MOVED[i]] = causing;
            i += 1;
        }
        (rows[X], rows[Y]) = (causing | bits(&[X]), causing | bits(&[Y]));
        let mut i = ROLLING_STATES;
        while i < N {
            // a sinusoid's pair of states turns into each other
            rows[i] = ((1 << N) - 1) & !((1 << ROLLING_STATES) - 1);
            i += 1;
        }
        rows
    };

    const DISTURBED: [u32; N] = {
        let mut rows = [0; N];
        let mut i = 0;
        while i < N {
            if i <= YAW_RATE || i >= ROLLING_STATES {
                rows[i] = bits(&[0, 1]);
            }
            i += 1;
        }
        rows
    };

    fn start(&self, _mean: &mut SVector<f64, N>, covariance: &mut SMatrix<f64, N, N>) {
        let mut first = ROLLING_STATES;
        for colour in &self.colours {
            for i in first..first + colour.states() {
                covariance[(i, i)] = match colour {
                    Colour::Decaying { std, .. } => std * std,
                    Colour::Ringing { amplitude, .. } => 0.5 * amplitude * amplitude,
                };
            }
            first += colour.states();
        }
    }

    fn carry(
        &self,
        mean: &SVector<f64, N>,
        covariance: Option<&UdCovariance<N>>,
        input: Input,
        dt_s: f64,
        out: &mut Transition<N>,
    ) {
        let motion = motion_array(mean);
        let after = self.flow(motion, input, [0.0; 2], dt_s);
        for (i, value) in MOVED.into_iter().zip(after) {
            out.mean[i] = value;
        }
        let causes = if N > ROLLING_STATES && self.robot.follows_position { &MOVED[..] } else { &CAUSES[..] };
        for &k in causes {
            let h = reach(covariance, k);
            let at = |sign: f64| {
                let mut moved = motion;
                moved[k] += sign * h;
                self.flow(moved, input, [0.0; 2], dt_s)
            };
            let (up, down) = (at(1.0), at(-1.0));
            for i in MOVED {
                out.phi[(i, k)] = (up[i] - down[i]) / (2.0 * h);
            }
        }
        let variances = self.disturbing(&motion, input, dt_s);
        for (k, variance) in variances.into_iter().enumerate() {
            let h = variance.sqrt().max(LEAST);
            let at = |sign: f64| {
                let mut size = [0.0; 2];
                size[k] = sign * h;
                self.flow(motion, input, size, dt_s)
            };
            let (up, down) = (at(1.0), at(-1.0));
            for i in MOVED {
                out.gamma[(i, k)] = (up[i] - down[i]) / (2.0 * h);
            }
            out.variances[k] = variance;
        }
        let mut first = ROLLING_STATES;
        let mut driven = SMatrix::<f64, N, BENDS>::zeros();
        for (k, colour) in self.colours.iter().enumerate() {
            match *colour {
                Colour::Decaying { std, time_s } => {
                    let left = (-dt_s / time_s).exp();
                    out.mean[first] = left * mean[first];
                    out.phi[(first, first)] = left;
                    driven[(first, k)] = std * (-(-2.0 * dt_s / time_s).exp_m1()).sqrt();
                }
                Colour::Ringing { omega, .. } => {
                    let (sin, cos) = (omega * dt_s).sin_cos();
                    let (c, s) = (mean[first], mean[first + 1]);
                    (out.mean[first], out.mean[first + 1]) = (cos * c - sin * s, sin * c + cos * s);
                    out.phi.fixed_view_mut::<2, 2>(first, first).copy_from_slice(&[cos, sin, -sin, cos]);
                }
            }
            first += colour.states();
        }
        if !self.colours.is_empty() {
            out.bend = Some(driven);
        }
    }

    fn disturbed(&self, mean: &SVector<f64, N>, input: Input, disturbances: [f64; 2], dt_s: f64) -> SVector<f64, N> {
        let mut after = *mean;
        let motion = self.flow(motion_array(mean), input, disturbances, dt_s);
        for (i, value) in MOVED.into_iter().zip(motion) {
            after[i] = value;
        }
        after
    }

    fn torque_noise_density(&self) -> f64 {
        self.torque_noise_density
    }

    fn wheel_row(&self, side: usize) -> SVector<f64, N> {
        let turn = self.robot.robot.half_track_m * if side == 0 { -1.0 } else { 1.0 };
        let mut h = SVector::zeros();
        (h[SPEED], h[YAW_RATE]) = (1.0, turn);
        h / self.robot.robot.radius_m[side]
    }

    fn expected(
        &mut self,
        sensor: Sensor,
        reading: f64,
        variance: f64,
        mean: &SVector<f64, N>,
        covariance: &UdCovariance<N>,
    ) -> Option<Expected<N>> {
        if matches!(sensor, Sensor::PoseX | Sensor::PoseY | Sensor::PoseHeading) {
            return None;
        }
        let reach = CAUSES.map(|cause| reach(Some(covariance), cause));
        let (plain, mut by_state, here) = self.plain(sensor, [1.0; 2], mean, reach);
        let mut value = plain;
        let mut variance = variance + self.added(sensor, &here);
        for w in 0..self.watched.len() {
            let Watched { of, switch, .. } = self.watched[w];
            if !of.is_read_by(sensor) {
                continue;
            }
            // what is expected of the reading in either way, apart from offset and noise
            let in_way = |way: Way| match (of, sensor) {
                (Switched::Wheel(side), Sensor::Speed) => {
                    let mut gains = [1.0; 2];
                    gains[side] = way.gain;
                    let (read, by, _) = self.plain(sensor, gains, mean, reach);
                    (value + read - plain, by)
                }
                _ => (way.gain * value, by_state * way.gain),
            };
            let [(first, by_first), (second, by_second)] = switch.ways.map(in_way);
            let expected = [first + switch.ways[0].offset, second + switch.ways[1].offset];
            let noise = switch.ways.map(|way| variance + way.variance);
            let watched = &mut self.watched[w];
            let since_s = watched.asked_s.replace(self.since_power_on_s).map_or(0.0, |s| self.since_power_on_s - s);
            let prior = switch.after(watched.probability, since_s.max(0.0));
            let ln = |k: usize, by: &SVector<f64, N>| {
                ln_normal(reading - expected[k], covariance.innovation_variance(by, noise[k]))
            };
            let odds = prior / (1.0 - prior) * (ln(1, &by_second) - ln(0, &by_first)).clamp(-700.0, 700.0).exp();
            let p = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
            watched.probability = p;
            watched.turned_s = (p > 0.5).then(|| watched.turned_s.unwrap_or(self.since_power_on_s));
            let apart = expected[1] - expected[0];
            value = expected[0] + p * apart;
            variance = (1.0 - p) * noise[0] + p * noise[1] + p * (1.0 - p) * apart * apart;
            by_state = by_first * (1.0 - p) + by_second * p;
        }
        Some(Expected { residual: reading - value, by_state, variance })
    }

    fn moved(&mut self, input: Input, dt_s: f64) {
        self.input = Some(input);
        self.t_s += dt_s;
        self.since_power_on_s += dt_s;
    }

    fn found(&self) -> Vec<String> {
        let jumped = |w: &Watched| {
            // only what never switches back has a time to tell
            let at_s = w.turned_s.filter(|_| w.switch.share >= 1.0)?;
            let size = w.switch.ways[1].offset;
            Some(format!("the gyro's bias is taken to have jumped by {size:.2e} rad/s {at_s:.2} s after power-on"))
        };
        self.watched.iter().filter_map(jumped).collect()
    }
}
