//! x' = vx,  y' = vy,  θ' = ω,  ω' = (R/Jc)(FR - FL),  vx' = (FR + FL) cos θ/M,  vy' = (FR + FL) sin θ/M,
//! φ̇i' = (ui - r Fi)/Jw,  vc' = (FR + FL)/M
//!
//! Equations (5a) to (5i) of Alessandri et al. as they are printed, kept to reproduce the paper and to show the
//! difference. Two things are wrong in them ([`super::Slipping`] has them right): (5d) takes the robot's radius R for the
//! lever arm of the wheels' forces, where half the track stands; and (5e, f) lack the lateral constraint force, so that
//! the velocity does not turn with the heading, against (5i). At v = 0.5 m/s, ω = 0.5 rad/s and no force, ten seconds
//! lead 6.0 m apart: straight on 5 m, against a circle of 1 m radius. Forces follow [`crate::traction`]; the paper gives
//! no law. Time steps are the paper's explicit Euler's.

use super::Motion;
use crate::config::{Traction, Vehicle};
use crate::traction::{Slip, TractionLaw};
use crate::units::STANDARD_GRAVITY_M_S2;

/// The nine states of (5a) to (5i).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PrintedState {
    /// Position, m.
    pub x_m: f64,
    /// Position, m.
    pub y_m: f64,
    /// θ, rad.
    pub heading_rad: f64,
    /// ω, rad/s.
    pub yaw_rate_rad_s: f64,
    /// vx, m/s.
    pub velocity_x_m_s: f64,
    /// vy, m/s.
    pub velocity_y_m_s: f64,
    /// φ̇ of the wheels, left and right, rad/s.
    pub wheels_rad_s: [f64; 2],
    /// vc, m/s.
    pub speed_m_s: f64,
}

/// The robot of the printed equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsPrinted {
    vehicle: Vehicle,
    /// R, m.
    robot_radius_m: f64,
    load_n: f64,
    low_speed_m_s: f64,
    law: TractionLaw,
}

impl AsPrinted {
    /// The robot that the two tables describe, with the lever arm `robot_radius_m` of (5d).
    #[must_use]
    pub fn new(vehicle: &Vehicle, traction: &Traction, robot_radius_m: f64) -> Self {
        Self {
            vehicle: *vehicle,
            robot_radius_m,
            load_n: 0.5 * vehicle.whole_mass_kg() * STANDARD_GRAVITY_M_S2,
            low_speed_m_s: traction.low_speed_m_s,
            law: traction.law,
        }
    }

    /// A robot that rolls without slip along its heading.
    #[must_use]
    pub fn rolling(&self, motion: &Motion) -> PrintedState {
        let (sin, cos) = motion.heading_rad.sin_cos();
        let lead = self.vehicle.half_track_m * motion.yaw_rate_rad_s;
        let r = self.vehicle.wheel_radius_m;
        PrintedState {
            x_m: motion.x_m,
            y_m: motion.y_m,
            heading_rad: motion.heading_rad,
            yaw_rate_rad_s: motion.yaw_rate_rad_s,
            velocity_x_m_s: motion.speed_m_s * cos,
            velocity_y_m_s: motion.speed_m_s * sin,
            wheels_rad_s: [(motion.speed_m_s - lead) / r, (motion.speed_m_s + lead) / r],
            speed_m_s: motion.speed_m_s,
        }
    }

    /// The explicit Euler step, `torques_n_m` (left, right) held over `dt_s`.
    #[must_use]
    pub fn euler(&self, s: &PrintedState, torques_n_m: [f64; 2], dt_s: f64) -> PrintedState {
        let v = &self.vehicle;
        let lead = v.half_track_m * s.yaw_rate_rad_s;
        let ground = [s.speed_m_s - lead, s.speed_m_s + lead];
        let force: [f64; 2] = std::array::from_fn(|i| {
            let slip = Slip::new(v.wheel_radius_m * s.wheels_rad_s[i], ground[i], self.low_speed_m_s);
            self.load_n * self.law.friction(slip.slip)[0]
        });
        let acceleration = (force[0] + force[1]) / v.whole_mass_kg();
        let (sin, cos) = s.heading_rad.sin_cos();
        PrintedState {
            x_m: s.x_m + dt_s * s.velocity_x_m_s,
            y_m: s.y_m + dt_s * s.velocity_y_m_s,
            heading_rad: s.heading_rad + dt_s * s.yaw_rate_rad_s,
            yaw_rate_rad_s: s.yaw_rate_rad_s + dt_s * self.robot_radius_m / v.yaw_inertia_kg_m2 * (force[1] - force[0]),
            velocity_x_m_s: s.velocity_x_m_s + dt_s * acceleration * cos,
            velocity_y_m_s: s.velocity_y_m_s + dt_s * acceleration * sin,
            wheels_rad_s: std::array::from_fn(|i| {
                s.wheels_rad_s[i] + dt_s * (torques_n_m[i] - v.wheel_radius_m * force[i]) / v.wheel_inertia_kg_m2
            }),
            speed_m_s: s.speed_m_s + dt_s * acceleration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traction::{Surface, TractionLaw};
    use crate::vehicle::{Slipping, SlippingState};

    fn vehicle() -> Vehicle {
        Vehicle {
            mass_kg: 20.0,
            yaw_inertia_kg_m2: 0.6,
            half_track_m: 0.2,
            steering: None,
            wheel_radius_m: 0.1,
            wheel_inertia_kg_m2: 0.01,
            viscous_friction_n_m_s: 0.0,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        }
    }

    fn traction() -> Traction {
        Traction::new(TractionLaw::Burckhardt(Surface::DryAsphalt.law()))
    }

    #[test]
    fn without_force_the_printed_robot_drifts_six_metres_off_its_circle() {
        let turning = Motion { speed_m_s: 0.5, yaw_rate_rad_s: 0.5, ..Motion::default() };
        let printed = AsPrinted::new(&vehicle(), &traction(), 0.2);
        let steps = 100_000;
        let end = (0..steps).fold(printed.rolling(&turning), |s, _| printed.euler(&s, [0.0; 2], 1e-4));
        // it goes straight on, while its heading turns
        assert!((end.x_m - 5.0).abs() < 1e-9 && end.y_m.abs() < 1e-9, "{end:?}");
        assert!((end.heading_rad - 5.0).abs() < 1e-9);

        let robot = Slipping::new(&vehicle(), &traction());
        let start = printed.rolling(&turning);
        let start = SlippingState { motion: turning, wheels_rad_s: start.wheels_rad_s };
        let right = (0..1000).fold(start, |s, _| robot.step(&s, [0.0; 2], 0.01)).motion;
        let (sin, cos) = 5f64.sin_cos();
        assert!((right.x_m - sin).abs() < 1e-6 && (right.y_m - (1.0 - cos)).abs() < 1e-6, "{right:?}");
        let apart = (end.x_m - right.x_m).hypot(end.y_m - right.y_m);
        // hypot(5 - sin 5, 1 - cos 5)
        assert!((apart - (5.0 - sin).hypot(1.0 - cos)).abs() < 1e-6 && (apart - 6.0).abs() < 0.05, "{apart}");
    }

    #[test]
    fn printed_and_corrected_agree_straight_ahead() {
        let printed = AsPrinted::new(&vehicle(), &traction(), 0.2);
        let robot = Slipping::new(&vehicle(), &traction());
        let ahead = Motion { speed_m_s: 0.5, ..Motion::default() };
        let mut a = printed.rolling(&ahead);
        let mut b = SlippingState { motion: ahead, wheels_rad_s: a.wheels_rad_s };
        for _ in 0..20_000 {
            a = printed.euler(&a, [0.3; 2], 5e-5);
            b = robot.step(&b, [0.3; 2], 5e-5);
        }
        // Euler's error: half a step of the acceleration, 0.27 m/s² times 25 µs
        assert!((a.speed_m_s - b.motion.speed_m_s).abs() < 2e-5, "{} {}", a.speed_m_s, b.motion.speed_m_s);
        assert!((a.x_m - b.motion.x_m).abs() < 2e-5, "{} {}", a.x_m, b.motion.x_m);
    }

    #[test]
    fn the_printed_lever_arm_turns_a_robot_whose_wheels_stand_inside_its_rim_too_fast() {
        // R twice the half track: twice the yaw acceleration for the same forces
        let sliding = TractionLaw::Linear(crate::traction::Linear { stiffness: 20.0, friction: 0.3 });
        let traction = Traction::new(sliding);
        let yaw = |radius: f64| {
            let printed = AsPrinted::new(&vehicle(), &traction, radius);
            let mut s = PrintedState::default();
            for _ in 0..1000 {
                s = printed.euler(&s, [-20.0, 20.0], 1e-4);
            }
            s.yaw_rate_rad_s
        };
        assert!((yaw(0.4) / yaw(0.2) - 2.0).abs() < 1e-9);
    }
}
