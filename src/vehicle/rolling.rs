//! (M + 2 Jw/r²) dv/dt = (uL' + uR')/r,  (Jc + 2 Jw b²/r²) dω/dt = b (uR' - uL')/r,  ui' = ui - c wheel_i
//!
//! Wheels that roll without slip: wheel_left = (v - b ω)/r, wheel_right = (v + b ω)/r. The dynamics of Alessandri et
//! al., equations (5), with two corrections: the lever arm is the half track b, not the robot's radius, and the
//! velocity turns with the heading (their 5e and 5f lack the lateral constraint force). Friction decouples:
//! uL' + uR' takes 2 c v/r, uR' - uL' takes 2 c b ω/r, so that v and ω each obey a linear equation of their own.

use super::planar::{Forcing, Motion, advance};
use crate::config::Vehicle;

/// A robot whose two driven wheels roll without slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    radius_m: f64,
    half_track_m: f64,
    friction_n_m_s: f64,
    /// M + 2 Jw/r², kg
    effective_mass_kg: f64,
    /// Jc + 2 Jw b²/r², kg·m²
    effective_inertia_kg_m2: f64,
    // what follows from them, kept for the filter, which asks at every step
    acceleration_by_torque: f64,
    yaw_acceleration_by_torque: f64,
    speed_damping_per_s: f64,
    yaw_damping_per_s: f64,
}

impl Rolling {
    /// The robot that `vehicle` describes; its values are taken as checked by the configuration.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        let (r, b) = (vehicle.wheel_radius_m, vehicle.half_track_m);
        let wheels_kg = 2.0 * vehicle.wheel_inertia_kg_m2 / (r * r);
        let effective_mass_kg = vehicle.whole_mass_kg() + wheels_kg;
        let effective_inertia_kg_m2 = vehicle.yaw_inertia_kg_m2 + wheels_kg * b * b;
        let friction = 2.0 * vehicle.viscous_friction_n_m_s / (r * r);
        Self {
            radius_m: r,
            half_track_m: b,
            friction_n_m_s: vehicle.viscous_friction_n_m_s,
            effective_mass_kg,
            effective_inertia_kg_m2,
            acceleration_by_torque: 1.0 / (r * effective_mass_kg),
            yaw_acceleration_by_torque: b / (r * effective_inertia_kg_m2),
            speed_damping_per_s: friction / effective_mass_kg,
            yaw_damping_per_s: friction * b * b / effective_inertia_kg_m2,
        }
    }

    /// Accelerations and damping under wheel torques `[left, right]` (N·m).
    #[must_use]
    #[inline]
    pub fn forcing(&self, torques_n_m: [f64; 2]) -> Forcing {
        let [left, right] = torques_n_m;
        Forcing {
            acceleration_m_s2: self.acceleration_by_torque * (left + right),
            yaw_acceleration_rad_s2: self.yaw_acceleration_by_torque * (right - left),
            speed_damping_per_s: self.speed_damping_per_s,
            yaw_damping_per_s: self.yaw_damping_per_s,
        }
    }

    /// ∂a/∂uL = ∂a/∂uR, 1/(kg·m).
    #[must_use]
    pub fn acceleration_by_torque(&self) -> f64 {
        self.acceleration_by_torque
    }

    /// ∂α/∂uR = -∂α/∂uL, 1/(kg·m²).
    #[must_use]
    pub fn yaw_acceleration_by_torque(&self) -> f64 {
        self.yaw_acceleration_by_torque
    }

    /// The motion `dt_s` later, `torques_n_m` (left, right) held; exact in speed, yaw rate and heading, the position
    /// by quadrature of order 6 (see `advance`).
    #[must_use]
    pub fn step(&self, motion: &Motion, torques_n_m: [f64; 2], dt_s: f64) -> Motion {
        advance(motion, &self.forcing(torques_n_m), dt_s)
    }

    /// Torques (left, right; N·m) that give these accelerations at this motion.
    #[must_use]
    pub fn torques_for(&self, motion: &Motion, acceleration_m_s2: f64, yaw_acceleration_rad_s2: f64) -> [f64; 2] {
        let [left, right] = self.wheel_speeds(motion);
        let half_sum = 0.5 * self.radius_m * self.effective_mass_kg * acceleration_m_s2;
        let half_difference =
            0.5 * self.radius_m / self.half_track_m * self.effective_inertia_kg_m2 * yaw_acceleration_rad_s2;
        [
            half_sum - half_difference + self.friction_n_m_s * left,
            half_sum + half_difference + self.friction_n_m_s * right,
        ]
    }

    /// Wheel speeds (left, right), rad/s.
    #[must_use]
    pub fn wheel_speeds(&self, motion: &Motion) -> [f64; 2] {
        let lead = self.half_track_m * motion.yaw_rate_rad_s;
        [(motion.speed_m_s - lead) / self.radius_m, (motion.speed_m_s + lead) / self.radius_m]
    }

    /// How far the wheels turn (left, right; rad) on this way and turn (see [`super::travel`]).
    #[must_use]
    pub(crate) fn wheel_turns(&self, way_m: f64, turn_rad: f64) -> [f64; 2] {
        self.wheel_speeds(&Motion { speed_m_s: way_m, yaw_rate_rad_s: turn_rad, ..Motion::default() })
    }

    /// Speed (m/s) and yaw rate (rad/s) at which the wheels turn like this (left, right; rad/s).
    #[must_use]
    pub fn speed_and_yaw_rate(&self, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let [left, right] = wheels_rad_s;
        [0.5 * self.radius_m * (left + right), 0.5 * self.radius_m * (right - left) / self.half_track_m]
    }

    /// Rows of ∂wheel/∂(v, ω) for the left and the right wheel.
    #[must_use]
    pub fn wheel_by_motion(&self) -> [[f64; 2]; 2] {
        let (by_speed, by_yaw) = (1.0 / self.radius_m, self.half_track_m / self.radius_m);
        [[by_speed, -by_yaw], [by_speed, by_yaw]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Rolling {
        /// Energy of body and wheels in motion, J.
        fn kinetic_energy_j(&self, motion: &Motion) -> f64 {
            let (v, w) = (motion.speed_m_s, motion.yaw_rate_rad_s);
            0.5 * (self.effective_mass_kg * v * v + self.effective_inertia_kg_m2 * w * w)
        }
    }

    fn robot(friction: f64) -> (Vehicle, Rolling) {
        let v = Vehicle {
            mass_kg: 17.1,
            yaw_inertia_kg_m2: 0.61,
            half_track_m: 0.24,
            steering: None,
            wheel_radius_m: 0.066,
            wheel_inertia_kg_m2: 0.0011,
            viscous_friction_n_m_s: friction,
            torque_noise_n_m_sqrt_s: 0.0,
            torque_constant_n_m_a: None,
            load_kg: 0.0,
        };
        (v, Rolling::new(&v))
    }

    #[test]
    fn torque_work_is_the_energy_gained_without_friction() {
        let (_, robot) = robot(0.0);
        let mut m = Motion { speed_m_s: 0.2, yaw_rate_rad_s: -0.4, ..Motion::default() };
        let before = robot.kinetic_energy_j(&m);
        let (mut work, mut size) = (0.0, 0.0);
        for k in 0..500 {
            let u = [0.3 * (0.02 * f64::from(k)).sin(), 0.25 * (0.013 * f64::from(k)).cos()];
            let (h, w0) = (0.02, robot.wheel_speeds(&m));
            m = robot.step(&m, u, h);
            let w1 = robot.wheel_speeds(&m);
            // without friction wheel speeds are linear over the step: the trapezium is exact
            for i in 0..2 {
                let part = 0.5 * h * u[i] * (w0[i] + w1[i]);
                work += part;
                size += part.abs();
            }
        }
        let gained = robot.kinetic_energy_j(&m) - before;
        assert!(size > 0.1, "the torques did work: {size}");
        assert!((gained - work).abs() < 500.0 * f64::EPSILON * size, "{gained} {work}");
    }

    #[test]
    fn the_step_agrees_with_fine_integration_of_the_wheels_equations() {
        // body and wheels integrated from Newton's law, friction taken from each wheel's own speed
        let (v, robot) = robot(0.004);
        let u = [0.31, -0.12];
        let start = Motion { speed_m_s: 0.5, yaw_rate_rad_s: 0.8, ..Motion::default() };
        let (mass, inertia) = (
            v.mass_kg + 2.0 * v.wheel_inertia_kg_m2 / v.wheel_radius_m.powi(2),
            v.yaw_inertia_kg_m2 + 2.0 * v.wheel_inertia_kg_m2 * (v.half_track_m / v.wheel_radius_m).powi(2),
        );
        let rates = |s: [f64; 5]| {
            let [_, _, heading, speed, yaw] = s;
            let left = u[0] - v.viscous_friction_n_m_s * (speed - v.half_track_m * yaw) / v.wheel_radius_m;
            let right = u[1] - v.viscous_friction_n_m_s * (speed + v.half_track_m * yaw) / v.wheel_radius_m;
            [
                speed * heading.cos(),
                speed * heading.sin(),
                yaw,
                (left + right) / (v.wheel_radius_m * mass),
                v.half_track_m * (right - left) / (v.wheel_radius_m * inertia),
            ]
        };
        let h = 1e-3;
        let mut s = [0.0, 0.0, 0.0, start.speed_m_s, start.yaw_rate_rad_s];
        for _ in 0..400 {
            let plus = |k: [f64; 5], by: f64| std::array::from_fn::<f64, 5, _>(|i| s[i] + by * k[i]);
            let k1 = rates(s);
            let k2 = rates(plus(k1, h / 2.0));
            let k3 = rates(plus(k2, h / 2.0));
            let k4 = rates(plus(k3, h));
            s = std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        let m = robot.step(&start, u, 0.4);
        let found = [m.x_m, m.y_m, m.heading_rad, m.speed_m_s, m.yaw_rate_rad_s];
        for (a, b) in found.iter().zip(s) {
            // Runge-Kutta of order 4 with 1e-3 s: 1e-12; the quadrature over 0.4 s: 1e-9
            assert!((a - b).abs() < 3e-9, "{a} {b}");
        }
    }

    #[test]
    fn inverse_dynamics_undo_the_dynamics() {
        let (_, robot) = robot(0.004);
        let m = Motion { speed_m_s: 0.4, yaw_rate_rad_s: -0.9, ..Motion::default() };
        let f = robot.forcing(robot.torques_for(&m, 0.37, -0.21));
        let a = f.acceleration_m_s2 - f.speed_damping_per_s * m.speed_m_s;
        let alpha = f.yaw_acceleration_rad_s2 - f.yaw_damping_per_s * m.yaw_rate_rad_s;
        assert!((a - 0.37).abs() < 1e-15 && (alpha + 0.21).abs() < 1e-15, "{a} {alpha}");
    }

    #[test]
    fn wheels_and_motion_are_inverse() {
        let (_, robot) = robot(0.0);
        let m = Motion { speed_m_s: 0.4, yaw_rate_rad_s: -0.9, ..Motion::default() };
        let [v, w] = robot.speed_and_yaw_rate(robot.wheel_speeds(&m));
        assert!((v - 0.4).abs() < 1e-15 && (w + 0.9).abs() < 1e-15);
        let rows = robot.wheel_by_motion();
        for (row, wheel) in rows.iter().zip(robot.wheel_speeds(&m)) {
            assert!((row[0] * m.speed_m_s + row[1] * m.yaw_rate_rad_s - wheel).abs() < 1e-14);
        }
    }
}
