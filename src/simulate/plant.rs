//! The robot that is simulated: its wheels roll, or slip where the configuration has `[traction]`; effects may change it.

use super::changed::{Changed, Push};
use crate::config::Config;
use crate::error::Result;
use crate::model::drive::{DriveEffect, Instrument, Reading, Robot};
use crate::vehicle::{Forcing, Motion, Rolling, Slipping, SlippingState, advance, travel};

/// Error of a speed that a slipping step may make, m/s: a sixth of the filter's.
const TOLERANCE_M_S: f64 = 5e-5;

/// Where ticks are counted a slipping step is taken in this many parts, so that the wheels' angles, sums of trapezia, are
/// as good as their speeds.
const PARTS: u32 = 4;

/// A robot and its state, at rest in x = y = θ = 0 at first.
pub(super) struct Plant {
    rolling: Rolling,
    slipping: Option<Slipping>,
    state: SlippingState,
    parts: u32,
    angles_rad: [f64; 2],
    /// The robot with effects, which then moves in place of all this; `None` without effects.
    changed: Option<Changed>,
}

impl Plant {
    pub(crate) fn new(config: &Config) -> Result<Self> {
        let vehicle = config.require_vehicle()?;
        Ok(Self {
            rolling: Rolling::new(vehicle),
            slipping: config.traction.map(|traction| Slipping::new(vehicle, &traction).with_tolerance(TOLERANCE_M_S)),
            state: SlippingState::default(),
            parts: if config.encoder.is_some_and(|e| e.ticks_per_revolution.is_some()) { PARTS } else { 1 },
            angles_rad: [0.0; 2],
            changed: None,
        })
    }

    /// The same robot with effects; without any, it stays what it is.
    pub(crate) fn changed_by(mut self, effects: Vec<Box<dyn DriveEffect>>, config: &Config) -> Result<Self> {
        if !effects.is_empty() {
            self.changed = Some(Changed::new(Robot::from(config.require_vehicle()?), effects));
        }
        Ok(self)
    }

    /// Sets the time: s since the log began, and s since power-on.
    pub(crate) fn clock(&mut self, t_s: f64, since_power_on_s: f64) {
        if let Some(changed) = &mut self.changed {
            changed.clock(t_s, since_power_on_s);
        }
    }

    /// The nominal robot as if it rolled: its kinematics and inverse dynamics.
    pub(crate) fn rolling(&self) -> &Rolling {
        &self.rolling
    }

    pub(crate) fn motion(&self) -> &Motion {
        self.changed.as_ref().map_or(&self.state.motion, Changed::motion)
    }

    /// The motion that the external reference reads now.
    pub(crate) fn tracked(&self) -> Motion {
        self.changed.as_ref().map_or(self.state.motion, Changed::tracked)
    }

    /// Standard deviation of an instrument's white noise over the nominal one.
    pub(crate) fn noise_over_nominal(&self, instrument: Instrument) -> f64 {
        self.changed.as_ref().map_or(1.0, |changed| changed.noise_over_nominal(instrument))
    }

    pub(crate) fn wheels_rad_s(&self) -> [f64; 2] {
        self.changed.as_ref().map_or(self.state.wheels_rad_s, Changed::wheels_rad_s)
    }

    /// Reading of the gyro without its own error and noise, rad/s.
    pub(crate) fn gyro_rad_s(&self) -> f64 {
        self.changed.as_ref().map_or(self.state.motion.yaw_rate_rad_s, Changed::gyro_rad_s)
    }

    /// Changes a row's readings as the recorder does.
    pub(crate) fn record(&mut self, reading: &mut Reading) {
        if let Some(changed) = &mut self.changed {
            changed.record(reading);
        }
    }

    /// Speed (m/s) and yaw rate (rad/s) at which the wheels turn like this, left and right.
    pub(crate) fn speed_and_yaw_rate(&self, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let nominal = || self.rolling.speed_and_yaw_rate(wheels_rad_s);
        self.changed.as_ref().map_or_else(nominal, |changed| changed.speed_and_yaw_rate(wheels_rad_s))
    }

    /// How far the wheels have turned, rad.
    pub(crate) fn wheel_angles_rad(&self) -> [f64; 2] {
        self.changed.as_ref().map_or(self.angles_rad, Changed::wheel_angles_rad)
    }

    /// λ of both wheels, where they slip.
    pub(crate) fn slips(&self) -> Option<[f64; 2]> {
        self.slipping.map(|robot| robot.slips(&self.state).map(|s| s.slip))
    }

    /// The true pose, with the speed and yaw rate that follow from the recorded wheel speeds: the input of a robot's
    /// own control. Speeds that are not there yet (NaN) are zero: the robot stands. Where wheels slip, it is their true
    /// speeds: the slip is not linear over the noise that the control would pass on.
    pub(crate) fn indicated(&self, recorded_rad_s: [f64; 2]) -> Motion {
        let seen = if self.slipping.is_some() { self.state.wheels_rad_s } else { recorded_rad_s };
        let held = seen.map(|speed| if speed.is_finite() { speed } else { 0.0 });
        let [speed_m_s, yaw_rate_rad_s] = self.rolling.speed_and_yaw_rate(held);
        Motion { speed_m_s, yaw_rate_rad_s, ..*self.motion() }
    }

    /// Moves on by `dt_s` under these torques.
    pub(crate) fn drive(&mut self, torques_n_m: [f64; 2], dt_s: f64) {
        if let Some(changed) = &mut self.changed {
            return changed.advance(Push::Torques(torques_n_m), dt_s);
        }
        match &self.slipping {
            Some(robot) => {
                let part = dt_s / f64::from(self.parts);
                for _ in 0..self.parts {
                    let next = robot.step(&self.state, torques_n_m, part);
                    // the trapezium is of the integrator's order
                    for (angle, (a, b)) in
                        self.angles_rad.iter_mut().zip(self.state.wheels_rad_s.into_iter().zip(next.wheels_rad_s))
                    {
                        *angle += 0.5 * part * (a + b);
                    }
                    self.state = next;
                }
            }
            None => self.roll(&self.rolling.forcing(torques_n_m), dt_s),
        }
    }

    /// Moves on by `dt_s` with wheels that roll as recorded.
    pub(crate) fn roll(&mut self, forcing: &Forcing, dt_s: f64) {
        if let Some(changed) = &mut self.changed {
            let recorded = [forcing.acceleration_m_s2, forcing.yaw_acceleration_rad_s2];
            return changed.advance(Push::Recorded(recorded), dt_s);
        }
        let motion = self.state.motion;
        let [way_m, turn_rad] = travel(&motion, forcing, dt_s);
        let turns = self.rolling.wheel_turns(way_m, turn_rad);
        self.angles_rad.iter_mut().zip(turns).for_each(|(angle, turn)| *angle += turn);
        self.put(advance(&motion, forcing, dt_s));
    }

    /// Sets the robot's motion, its wheels rolling.
    pub(crate) fn put(&mut self, motion: Motion) {
        if let Some(changed) = &mut self.changed {
            changed.put(motion);
        }
        self.state = SlippingState { motion, wheels_rad_s: self.rolling.wheel_speeds(&motion) };
    }
}
