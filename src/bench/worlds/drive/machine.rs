//! u = limit( kp (w* - ŵ) + ki ∫ (w* - ŵ) ),  w* = (v* ∓ b ω*)/r: a robot, its nominal model, and its driver
//!
//! Speeds are commanded, a controller on the measured wheel speeds makes torques of them, as on real robots; it does not
//! know the reference or the gyro. Torques of a log are what it commanded.

use crate::bench::worlds::draw::{between, chance, index, log_between, rounded};
use crate::bench::worlds::run::Unit;
use crate::config::{Config, Encoder, Kind, Pose, Vehicle};
use crate::math::random::Stream;

/// A robot as the team believes it to be, and its controller.
#[derive(Debug, Clone, Copy)]
pub(super) struct Machine {
    /// Its gyro.
    pub gyro: Unit,
    pub step_s: f64,
    pub vehicle: Vehicle,
    pub wheel_std_rad_s: f64,
    pub pose: Pose,
    /// Rows from one pose to the next.
    pub pose_rows: usize,
    pub driver: Driver,
}

/// The controller of both wheels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Driver {
    pub proportional_n_m_s: f64,
    pub integral_n_m: f64,
    pub filter_s: f64,
    pub limit_n_m: f64,
    /// Largest speeds that are commanded, m/s and rad/s.
    pub speed_m_s: f64,
    pub yaw_rate_rad_s: f64,
    /// Limit of the commanded acceleration, m/s²; infinite where commands jump.
    pub ramp_m_s2: f64,
    /// Mean length of a manoeuvre, s.
    pub manoeuvre_s: f64,
}

impl Machine {
    pub(crate) fn draw(s: &mut Stream) -> Self {
        let (step_s, divisors): (f64, &[usize]) = match s.uniform() {
            u if u < 0.6 => (0.01, &[5, 10, 10, 10, 20]),
            u if u < 0.85 => (0.02, &[2, 5, 5, 10]),
            _ => (0.0125, &[4, 8, 8, 16]),
        };
        let gyro = Unit::draw(s).sampled(step_s);
        let mass_kg = rounded(log_between(s, 5.0, 80.0), 4);
        // larger robots are wider
        let half_track_m = rounded(0.24 * (mass_kg / 20.0).powf(0.3) * between(s, 0.75, 1.3), 4);
        let wheel_radius_m = rounded(log_between(s, 0.045, 0.15), 4);
        let yaw_inertia_kg_m2 = rounded(mass_kg * half_track_m.powi(2) * between(s, 0.45, 1.1), 4);
        let wheel_inertia_kg_m2 = rounded(mass_kg * wheel_radius_m.powi(2) * log_between(s, 0.008, 0.06), 3);
        let acceleration_m_s2 = between(s, 0.7, 2.5);
        let limit_n_m = 0.5 * mass_kg * wheel_radius_m * acceleration_m_s2;
        // coasting time of a free robot, s
        let coast_s = log_between(s, 15.0, 150.0);
        let inertia = 0.5 * mass_kg * wheel_radius_m.powi(2);
        let bandwidth_rad_s = log_between(s, 2.5, 9.0);
        let filter_s = between(s, 0.0, 0.25) / bandwidth_rad_s;
        let rate_rows = divisors[index(s, divisors.len())];
        Self {
            gyro,
            step_s,
            vehicle: Vehicle {
                mass_kg,
                yaw_inertia_kg_m2,
                half_track_m,
                steering: None,
                wheel_radius_m,
                wheel_inertia_kg_m2,
                viscous_friction_n_m_s: rounded(inertia / coast_s, 3),
                torque_noise_n_m_sqrt_s: rounded(limit_n_m * log_between(s, 0.0018, 0.006), 3),
                torque_constant_n_m_a: None,
                load_kg: 0.0,
            },
            wheel_std_rad_s: rounded(log_between(s, 0.008, 0.04), 3),
            pose: Pose {
                rate_hz: rounded(1.0 / (step_s * rate_rows as f64), 6),
                position_std_m: rounded(log_between(s, 0.001, 0.006), 2),
                heading_std_rad: rounded(log_between(s, 0.001, 0.006), 2),
                lever_arm_std_m: None,
                heading_offset_std_rad: None,
                delay_std_s: None,
                correlation_time_s: None,
            },
            pose_rows: rate_rows,
            driver: Driver {
                proportional_n_m_s: bandwidth_rad_s * inertia,
                integral_n_m: bandwidth_rad_s.powi(2) * inertia * between(s, 0.1, 0.45),
                filter_s,
                limit_n_m,
                speed_m_s: log_between(s, 0.5, 1.8),
                yaw_rate_rad_s: log_between(s, 0.7, 2.2),
                ramp_m_s2: if chance(s, 0.4) { between(s, 0.3, 1.0) * acceleration_m_s2 } else { f64::INFINITY },
                manoeuvre_s: log_between(s, 3.5, 9.0),
            },
        }
    }

    /// The nominal simulator's file.
    pub(crate) fn config(&self) -> Config {
        Config {
            kind: Kind::Driving,
            sample_time_s: Some(self.step_s),
            vehicle: Some(self.vehicle),
            encoder: Some(Encoder { speed_noise_std_rad_s: self.wheel_std_rad_s, ticks_per_revolution: None }),
            pose: Some(self.pose),
            ..self.gyro.config()
        }
    }
}

/// Commanded speeds, one a row: forwards, m/s, and yaw rate, rad/s.
pub(super) struct Course {
    pub speed_m_s: Vec<f64>,
    pub yaw_rate_rad_s: Vec<f64>,
}

impl Course {
    /// Manoeuvres one after another: stops, straights, arcs, turns on the spot, weaves; some backwards.
    pub(crate) fn draw(machine: &Machine, len: usize, s: &mut Stream) -> Self {
        let (driver, dt) = (&machine.driver, machine.step_s);
        let mut out = Self { speed_m_s: vec![0.0; len], yaw_rate_rad_s: vec![0.0; len] };
        let mut row = (between(s, 1.0, 4.0) / dt) as usize;
        while row < len {
            let rows = ((driver.manoeuvre_s * log_between(s, 0.4, 2.2)) / dt) as usize;
            let forwards = if chance(s, 0.18) { -between(s, 0.2, 0.6) } else { between(s, 0.25, 1.0) };
            let turning = between(s, 0.15, 1.0) * if chance(s, 0.5) { 1.0 } else { -1.0 };
            let (v, w, weave_hz) = match s.uniform() {
                u if u < 0.13 => (0.0, 0.0, 0.0),
                u if u < 0.38 => (forwards, 0.0, 0.0),
                u if u < 0.68 => (forwards, 0.8 * turning, 0.0),
                u if u < 0.82 => (0.0, turning, 0.0),
                _ => (0.8 * forwards, turning, log_between(s, 0.1, 0.5)),
            };
            for k in row..(row + rows.max(1)).min(len) {
                let swing =
                    if weave_hz > 0.0 { (std::f64::consts::TAU * weave_hz * (k - row) as f64 * dt).sin() } else { 1.0 };
                out.speed_m_s[k] = driver.speed_m_s * v;
                out.yaw_rate_rad_s[k] = driver.yaw_rate_rad_s * w * swing;
            }
            row += rows.max(1);
        }
        if driver.ramp_m_s2.is_finite() {
            ramp(&mut out.speed_m_s, driver.ramp_m_s2 * dt);
            ramp(&mut out.yaw_rate_rad_s, driver.ramp_m_s2 * dt / machine.vehicle.half_track_m);
        }
        out
    }

    pub(crate) fn len(&self) -> usize {
        self.speed_m_s.len()
    }
}

/// Limits the change from one value to the next.
fn ramp(values: &mut [f64], most: f64) {
    let mut at = 0.0;
    for v in values {
        at += (*v - at).clamp(-most, most);
        *v = at;
    }
}
