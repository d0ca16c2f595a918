//! The robot that is simulated: its wheels roll, or slip where the configuration has `[traction]`.

use crate::config::Config;
use crate::error::Result;
use crate::vehicle::{Forcing, Motion, Rolling, Slipping, SlippingState, advance, travel};

/// Error of a speed that a slipping step may make, m/s: a sixth of the filter's.
const TOLERANCE_M_S: f64 = 5e-5;

/// Where ticks are counted a slipping step is taken in this many parts, so that the wheels' angles, sums of trapezia, are
/// as good as their speeds.
const PARTS: u32 = 4;

/// A robot and its state, at rest in x = y = θ = 0 at first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plant {
    rolling: Rolling,
    slipping: Option<Slipping>,
    state: SlippingState,
    parts: u32,
    angles_rad: [f64; 2],
}

impl Plant {
    pub fn new(config: &Config) -> Result<Self> {
        let vehicle = config.require_vehicle()?;
        Ok(Self {
            rolling: Rolling::new(vehicle),
            slipping: config.traction.map(|traction| Slipping::new(vehicle, &traction).with_tolerance(TOLERANCE_M_S)),
            state: SlippingState::default(),
            parts: if config.encoder.is_some_and(|e| e.ticks_per_revolution.is_some()) { PARTS } else { 1 },
            angles_rad: [0.0; 2],
        })
    }

    /// The robot as if it rolled: its kinematics and inverse dynamics.
    pub fn rolling(&self) -> &Rolling {
        &self.rolling
    }

    pub fn motion(&self) -> &Motion {
        &self.state.motion
    }

    pub fn wheels_rad_s(&self) -> [f64; 2] {
        self.state.wheels_rad_s
    }

    /// How far the wheels have turned, rad.
    pub fn wheel_angles_rad(&self) -> [f64; 2] {
        self.angles_rad
    }

    /// λ of both wheels, where they slip.
    pub fn slips(&self) -> Option<[f64; 2]> {
        self.slipping.map(|robot| robot.slips(&self.state).map(|s| s.slip))
    }

    /// The pose, with the speed and yaw rate that the wheels show: what a robot's own speed control sees.
    pub fn indicated(&self) -> Motion {
        if self.slipping.is_none() {
            return self.state.motion;
        }
        let [speed_m_s, yaw_rate_rad_s] = self.rolling.speed_and_yaw_rate(self.state.wheels_rad_s);
        Motion { speed_m_s, yaw_rate_rad_s, ..self.state.motion }
    }

    /// Lets the torques act for `dt_s`.
    pub fn drive(&mut self, torques_n_m: [f64; 2], dt_s: f64) {
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

    /// Rolls on for `dt_s`.
    pub fn roll(&mut self, forcing: &Forcing, dt_s: f64) {
        let motion = self.state.motion;
        let [way_m, turn_rad] = travel(&motion, forcing, dt_s);
        let turns = self.rolling.wheel_turns(way_m, turn_rad);
        self.angles_rad.iter_mut().zip(turns).for_each(|(angle, turn)| *angle += turn);
        self.put(advance(&motion, forcing, dt_s));
    }

    /// Puts the robot there, its wheels rolling.
    pub fn put(&mut self, motion: Motion) {
        self.state = SlippingState { motion, wheels_rad_s: self.rolling.wheel_speeds(&motion) };
    }
}
