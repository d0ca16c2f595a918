//! d[x, y, θ, v, ω]/dt = [v cos θ - s sin θ, v sin θ + s cos θ, ω, a, α],  a, α, s of [`crate::model::drive`]
//!
//! The robot with effects, by the classical Runge-Kutta method of order 4 in parts of at most 2 ms. Where an effect makes
//! the equations stiff (dry friction near standstill), a part is halved until Collatz's key figure
//! 2 |k3 - k2|/|k2 - k1|, which is h times the local rate of decay, is small (The Numerical Treatment of Differential
//! Equations (1960), II.2.4). A part h leaves (h λ)⁵/120 of what decays at the rate λ: 2.6e-4 at most.

use crate::model::drive::{DriveEffect, DriveModel, Instrument, Moving, Past, Reading, Robot};
use crate::vehicle::Motion;
use std::collections::VecDeque;

/// Longest part of a step, s.
const LONGEST_S: f64 = 2e-3;
/// A bound on the parts of one step: motion through a gap of minutes means little, and must not cost much.
const PARTS_LIMIT: f64 = 1e5;
/// Largest product h λ of step and decay rate.
const LARGEST_DECAY: f64 = 0.5;
/// Most halvings of one part: down to 30 µs.
const HALVINGS: u32 = 6;
/// A change of speed over half a part (m/s, or rad/s) that is too small to matter, however fast it decays.
const NO_MATTER: f64 = 1e-9;

/// Input that moves the robot over a step.
#[derive(Debug, Clone, Copy)]
pub(super) enum Push {
    /// Torques, left and right, N·m.
    Torques([f64; 2]),
    /// Recorded accelerations, m/s² and rad/s²; forces are not computed.
    Recorded([f64; 2]),
}

/// A robot with effects and its state; at rest in x = y = θ = 0 at first.
pub(super) struct Changed {
    model: DriveModel,
    motion: Motion,
    /// Times, accelerations and forces; the fields of the motion are set on use.
    at: Moving<'static>,
    past: Past,
    /// Motion so far, no longer than the reference is late
    tracked: VecDeque<(f64, Motion)>,
    angles_rad: [f64; 2],
}

impl Changed {
    pub(crate) fn new(nominal: Robot, effects: Vec<Box<dyn DriveEffect>>) -> Self {
        Self {
            model: DriveModel::new(nominal, effects),
            motion: Motion::default(),
            at: Moving::default(),
            past: Past::default(),
            tracked: VecDeque::new(),
            angles_rad: [0.0; 2],
        }
    }

    pub(crate) fn motion(&self) -> &Motion {
        &self.motion
    }

    pub(crate) fn wheel_angles_rad(&self) -> [f64; 2] {
        self.angles_rad
    }

    /// Sets the robot's motion.
    pub(crate) fn put(&mut self, motion: Motion) {
        self.motion = motion;
    }

    /// Sets the time: s since the log began, and s since power-on.
    pub(crate) fn clock(&mut self, t_s: f64, since_power_on_s: f64) {
        self.at.t_s = t_s;
        self.at.since_power_on_s = since_power_on_s;
        self.past.push(t_s, [self.motion.speed_m_s, self.motion.yaw_rate_rad_s], self.at.wheel_force_n);
        self.remember(t_s);
    }

    fn remember(&mut self, t_s: f64) {
        let late_s = self.model.delay_s(Instrument::Pose);
        if late_s > 0.0 {
            self.tracked.push_back((t_s, self.motion));
            while self.tracked.len() > 2 && self.tracked[1].0 <= t_s - late_s {
                self.tracked.pop_front();
            }
        }
    }

    /// The motion that the external reference reads now: straight lines between the parts of a step.
    pub(crate) fn tracked(&self) -> Motion {
        let at_s = self.at.t_s - self.model.delay_s(Instrument::Pose);
        let after = self.tracked.iter().position(|(t_s, _)| *t_s > at_s);
        let Some(&(from_s, from)) = after.map_or(self.tracked.back(), |i| self.tracked.get(i.saturating_sub(1))) else {
            return self.motion;
        };
        let Some(&(to_s, to)) = after.and_then(|i| self.tracked.get(i)) else { return from };
        let u = if to_s > from_s { ((at_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) } else { 0.0 };
        let between = |a: f64, b: f64| a + u * (b - a);
        Motion {
            x_m: between(from.x_m, to.x_m),
            y_m: between(from.y_m, to.y_m),
            heading_rad: between(from.heading_rad, to.heading_rad),
            speed_m_s: between(from.speed_m_s, to.speed_m_s),
            yaw_rate_rad_s: between(from.yaw_rate_rad_s, to.yaw_rate_rad_s),
        }
    }

    /// Standard deviation of an instrument's white noise over the nominal one.
    pub(crate) fn noise_over_nominal(&self, instrument: Instrument) -> f64 {
        self.model.noise_over_nominal(instrument)
    }

    /// Speed (m/s) and yaw rate (rad/s) at which the wheels of this robot turn like this, left and right.
    pub(crate) fn speed_and_yaw_rate(&self, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        self.model.robot.speed_and_yaw_rate(wheels_rad_s)
    }

    /// Wheel speeds under the torques that acted last, left and right, rad/s.
    pub(crate) fn wheels_rad_s(&self) -> [f64; 2] {
        self.model.wheels_rad_s(&Moving { past: Some(&self.past), ..self.now() })
    }

    /// Reading of the gyro without its own error and noise, rad/s.
    pub(crate) fn gyro_rad_s(&self) -> f64 {
        self.model.gyro_rad_s(&Moving { past: Some(&self.past), ..self.now() })
    }

    /// Changes a row's readings as the recorder does.
    pub(crate) fn record(&mut self, reading: &mut Reading) {
        self.model.record(reading);
    }

    /// Moves on for `dt_s`.
    pub(crate) fn advance(&mut self, push: Push, dt_s: f64) {
        let parts = (dt_s / LONGEST_S).ceil().clamp(1.0, PARTS_LIMIT);
        for _ in 0..parts as usize {
            self.step(push, dt_s / parts, HALVINGS);
        }
    }

    fn now(&self) -> Moving<'_> {
        self.moving(&self.motion, 0.0)
    }

    fn moving(&self, motion: &Motion, after_s: f64) -> Moving<'static> {
        Moving {
            t_s: self.at.t_s + after_s,
            since_power_on_s: self.at.since_power_on_s + after_s,
            x_m: motion.x_m,
            y_m: motion.y_m,
            heading_rad: motion.heading_rad,
            speed_m_s: motion.speed_m_s,
            yaw_rate_rad_s: motion.yaw_rate_rad_s,
            ..self.at
        }
    }

    /// Slopes of x, y, θ, v and ω at this motion, and the robot there.
    fn slopes(&self, motion: &Motion, after_s: f64, push: Push) -> ([f64; 5], Moving<'static>) {
        let mut at = self.moving(motion, after_s);
        match push {
            Push::Torques(torques_n_m) => self.model.accelerate(&mut at, torques_n_m),
            Push::Recorded([acceleration, yaw_acceleration]) => {
                at.acceleration_m_s2 = acceleration;
                at.yaw_acceleration_rad_s2 = yaw_acceleration;
            }
        }
        (self.model.rates(&at), at)
    }

    fn step(&mut self, push: Push, h: f64, halvings: u32) {
        let start = self.motion;
        let (k1, first) = self.slopes(&start, 0.0, push);
        let (k2, _) = self.slopes(&moved(&start, &k1, 0.5 * h), 0.5 * h, push);
        let (k3, _) = self.slopes(&moved(&start, &k2, 0.5 * h), 0.5 * h, push);
        let apart = |a: &[f64; 5], b: &[f64; 5]| (a[3] - b[3]).abs().max((a[4] - b[4]).abs());
        let change = apart(&k2, &k1);
        if halvings > 0 && 0.5 * h * change > NO_MATTER && 2.0 * apart(&k3, &k2) > LARGEST_DECAY * change {
            self.step(push, 0.5 * h, halvings - 1);
            self.step(push, 0.5 * h, halvings - 1);
            return;
        }
        let (k4, _) = self.slopes(&moved(&start, &k3, h), h, push);
        let mean = std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        self.motion = moved(&start, &mean, h);
        let (_, last) = self.slopes(&self.motion, h, push);
        // both ends under the same torques, though the next ones may jump
        let turning = |at: Moving| self.model.wheels_rad_s(&Moving { past: Some(&self.past), ..at });
        let (from, to) = (turning(first), turning(last));
        for (i, angle) in self.angles_rad.iter_mut().enumerate() {
            *angle += 0.5 * h * (from[i] + to[i]);
        }
        self.at = last;
        self.past.push(last.t_s, [last.speed_m_s, last.yaw_rate_rad_s], last.wheel_force_n);
        self.remember(last.t_s);
    }
}

fn moved(from: &Motion, slopes: &[f64; 5], by_s: f64) -> Motion {
    Motion {
        x_m: from.x_m + by_s * slopes[0],
        y_m: from.y_m + by_s * slopes[1],
        heading_rad: from.heading_rad + by_s * slopes[2],
        speed_m_s: from.speed_m_s + by_s * slopes[3],
        yaw_rate_rad_s: from.yaw_rate_rad_s + by_s * slopes[4],
    }
}
