//! M (dv/dt - d ω²) = F + G_x,  (J + M d²) dω/dt + M d v ω = b (F_R - F_L) + d G_y + caster
//!
//! v and ω are those of the middle of the axle, d the way from there to the centre of mass, G gravity's part along a tilted
//! floor. Two drive trains. Rolling wheels have no freedom of their own, their inertia joins that of the body:
//!
//! ```text
//! F_i = (u_i - Jw dwheel_i/dt) / r_i,  wheel_i = v_i / r_i,  v_i = v ∓ b ω         fourth-order Runge-Kutta
//! ```
//!
//! Slipping wheels have their own equation, stiff where they grip:
//!
//! ```text
//! F_i = load μ(s_i),  Jw dwheel_i/dt = u_i - r_i F_i                             second-order Rosenbrock, L-stable
//! ```
//!
//! with γ = 1 - 1/√2 (Verwer, Spee, Blom and Hundsdorfer, SIAM J. Sci. Comput. 20 (1999) 1456); it keeps its order with an
//! inexact Jacobian, which here holds the contact's part alone.

use super::grip::Grip;
use super::world::World;
use crate::config::Vehicle;
use nalgebra::{Matrix4, Vector4};

const GRAVITY_M_S2: f64 = 9.806_65;

/// How the robot moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Motion {
    /// Of the middle of the axle: forwards, m/s, and yaw rate, rad/s.
    pub v: f64,
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub heading: f64,
    /// Wheel speeds, rad/s.
    pub wheels: [f64; 2],
    /// Angles that they have turned, rad.
    pub turned: [f64; 2],
    /// Sideways velocity to the left, m/s.
    pub lateral: f64,
    /// Forward acceleration, m/s².
    pub acceleration: f64,
    /// What is left of the casters' turning round: 1 just after a reversal to forwards, -1 to backwards.
    pub caster: f64,
    /// Direction in which it went last.
    direction: f64,
}

/// What does not change within a substep.
struct Now<'a> {
    world: &'a World,
    mass: f64,
    inertia: f64,
    offset: f64,
    half_track: f64,
    radius: [f64; 2],
    wheel_inertia: f64,
    viscous: f64,
    torque: [f64; 2],
    caster: f64,
}

impl Now<'_> {
    /// Force forwards and moment on the body beside the wheels' drive, from friction and floor.
    fn outside(&self, v: f64, w: f64, x: f64, y: f64, heading: f64) -> (f64, f64) {
        let (body, b) = (&self.world.body, self.half_track);
        let weight = self.mass * GRAVITY_M_S2;
        let (mut force, mut moment) = (0.0, self.caster);
        if body.rolling.coefficient != 0.0 {
            if body.rolling.at_wheels {
                let left = -0.5 * weight * body.rolling.share(v - b * w);
                let right = -0.5 * weight * body.rolling.share(v + b * w);
                force += left + right;
                moment += b * (right - left);
            } else {
                force -= weight * body.rolling.share(v);
            }
        }
        if body.slope_rad != 0.0 {
            let [depth, length, phase] = body.undulation;
            let (sin_up, cos_up) = body.uphill_heading_rad.sin_cos();
            let way = x * cos_up + y * sin_up;
            let tilt = body.slope_rad * (1.0 + depth * (std::f64::consts::TAU * way / length + phase).sin());
            let (sin, cos) = (heading - body.uphill_heading_rad).sin_cos();
            force -= weight * tilt.sin() * cos;
            moment += self.offset * weight * tilt.sin() * sin;
        }
        force -= body.drag_kg_m * v * v.abs();
        (force, moment)
    }

    /// Torque of wheel `i` that turns at `speed`, less its friction.
    fn drive(&self, i: usize, speed: f64) -> f64 {
        let coulomb = self.world.body.coulomb_n_m[i];
        let dry = if coulomb != 0.0 { coulomb * (speed / 0.3).tanh() } else { 0.0 };
        self.torque[i] - self.viscous * speed - dry
    }

    /// d/dt of v and ω of a robot whose wheels roll.
    fn rolling(&self, v: f64, w: f64, x: f64, y: f64, heading: f64) -> (f64, f64) {
        let (m, d, b, [rl, rr]) = (self.mass, self.offset, self.half_track, self.radius);
        let (left, right) = (self.drive(0, (v - b * w) / rl) / rl, self.drive(1, (v + b * w) / rr) / rr);
        let (jl, jr) = (self.wheel_inertia / (rl * rl), self.wheel_inertia / (rr * rr));
        let (force, moment) = self.outside(v, w, x, y, heading);
        let f = left + right + m * d * w * w + force;
        let n = b * (right - left) - m * d * v * w + moment;
        let (a11, a12, a22) = (m + jl + jr, b * (jr - jl), self.inertia + m * d * d + b * b * (jl + jr));
        let det = a11 * a22 - a12 * a12;
        ((a22 * f - a12 * n) / det, (a11 * n - a12 * f) / det)
    }

    /// d/dt of v, ω and both wheels that slip.
    fn slipping(&self, grip: &Grip, z: &Vector4<f64>, at: &Motion) -> Vector4<f64> {
        let (m, d, b) = (self.mass, self.offset, self.half_track);
        let load = 0.5 * m * GRAVITY_M_S2;
        let ground = [z[0] - b * z[1], z[0] + b * z[1]];
        let [left, right] = [0, 1].map(|i| load * grip.share(self.radius[i] * z[2 + i], ground[i]));
        let (force, moment) = self.outside(z[0], z[1], at.x, at.y, at.heading);
        Vector4::new(
            (left + right + force) / m + d * z[1] * z[1],
            (b * (right - left) - m * d * z[0] * z[1] + moment) / (self.inertia + m * d * d),
            (self.drive(0, z[2]) - self.radius[0] * left) / self.wheel_inertia,
            (self.drive(1, z[3]) - self.radius[1] * right) / self.wheel_inertia,
        )
    }

    /// The contact's part of the Jacobian of [`Now::slipping`].
    fn jacobian(&self, grip: &Grip, z: &Vector4<f64>) -> Matrix4<f64> {
        const SMALL_M_S: f64 = 1e-7;
        let (m, b) = (self.mass, self.half_track);
        let yaw = self.inertia + m * self.offset * self.offset;
        let load = 0.5 * m * GRAVITY_M_S2;
        let mut j = Matrix4::zeros();
        for (i, side) in [(0, -1.0), (1, 1.0)] {
            let (rim, ground) = (self.radius[i] * z[2 + i], z[0] + side * b * z[1]);
            let here = grip.share(rim, ground);
            let by_rim = load * (grip.share(rim + SMALL_M_S, ground) - here) / SMALL_M_S;
            let by_ground = load * (grip.share(rim, ground + SMALL_M_S) - here) / SMALL_M_S;
            let slopes = [by_ground, side * b * by_ground, self.radius[i] * by_rim];
            for (column, slope) in [0, 1, 2 + i].into_iter().zip(slopes) {
                j[(0, column)] += slope / m;
                j[(1, column)] += side * b * slope / yaw;
                j[(2 + i, column)] -= self.radius[i] * slope / self.wheel_inertia;
            }
        }
        j
    }
}

impl Motion {
    /// Moves on by `h` seconds from `t`; `torque` is that of the wheels.
    pub fn step(&mut self, vehicle: &Vehicle, world: &World, torque: [f64; 2], t: f64, h: f64) {
        let body = &world.body;
        let kept = match body.load_falls {
            Some([at_s, share]) if t >= at_s => 1.0 - share,
            _ => 1.0,
        };
        let now = Now {
            world,
            mass: vehicle.mass_kg * body.mass_factor * kept,
            inertia: vehicle.yaw_inertia_kg_m2 * body.inertia_factor * kept,
            offset: body.com_offset_m * (1.0 - body.slosh_s2_m * self.acceleration),
            half_track: vehicle.half_track_m * world.wheels.track_factor,
            radius: [0, 1].map(|i| vehicle.wheel_radius_m * self.radius_factor(world, i, t)),
            wheel_inertia: vehicle.wheel_inertia_kg_m2,
            viscous: vehicle.viscous_friction_n_m_s,
            torque,
            caster: body.caster_n_m * self.caster,
        };
        let (v0, w0) = (self.v, self.w);
        match &world.wheels.grip {
            Some(grip) => self.slip(&now, grip, h),
            None => self.roll(&now, h),
        }
        // through a lag of 20 ms, as a sensor's mounting feels it
        self.acceleration += -(-h / 0.02_f64).exp_m1() * ((self.v - v0) / h - self.acceleration);
        for i in 0..2 {
            self.turned[i] += h * self.wheels[i];
        }
        let (v, w) = (0.5 * (v0 + self.v), 0.5 * (w0 + self.w));
        let wheels = &world.wheels;
        let before = self.lateral;
        if wheels.skid_s != 0.0 {
            let wanted = -wheels.skid_s * v * w * (1.0 + wheels.skid_bend_s2_m * (v * w).abs());
            self.lateral += -(-h / wheels.skid_lag_s).exp_m1() * (wanted - self.lateral);
        }
        let (sin, cos) = (self.heading - 0.5 * h * w).sin_cos();
        let sideways = 0.5 * h * (before + self.lateral);
        self.x -= sideways * sin;
        self.y += sideways * cos;
        if body.caster_n_m != 0.0 {
            self.turn_casters(v, body.caster_way_m, h);
        }
    }

    /// Radius of wheel `i` over the nominal one.
    pub fn radius_factor(&self, world: &World, i: usize, t: f64) -> f64 {
        let wheels = &world.wheels;
        let mut factor = wheels.radius_factor[i] * (1.0 + wheels.growth_s_m * self.v.abs());
        if wheels.heating != 0.0 {
            factor *= 1.0 - wheels.heating * (-t / wheels.heating_s).exp_m1();
        }
        match wheels.eccentric {
            Some((wheel, ripple, phase)) if wheel == i => factor * (1.0 + ripple * (self.turned[i] + phase).sin()),
            _ => factor,
        }
    }

    fn roll(&mut self, now: &Now<'_>, h: f64) {
        let rate = |v: f64, w: f64, x: f64, y: f64, heading: f64| {
            let (dv, dw) = now.rolling(v, w, x, y, heading);
            let (sin, cos) = heading.sin_cos();
            [dv, dw, v * cos, v * sin, w]
        };
        let z = [self.v, self.w, self.x, self.y, self.heading];
        let at = |k: &[f64; 5], part: f64| -> [f64; 5] { std::array::from_fn(|i| z[i] + part * k[i]) };
        let f = |z: [f64; 5]| rate(z[0], z[1], z[2], z[3], z[4]);
        let k1 = f(z);
        let k2 = f(at(&k1, 0.5 * h));
        let k3 = f(at(&k2, 0.5 * h));
        let k4 = f(at(&k3, h));
        let sum: [f64; 5] = std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        [self.v, self.w, self.x, self.y, self.heading] = at(&sum, h);
        let b = now.half_track;
        self.wheels = [(self.v - b * self.w) / now.radius[0], (self.v + b * self.w) / now.radius[1]];
    }

    fn slip(&mut self, now: &Now<'_>, grip: &Grip, h: f64) {
        const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
        let z = Vector4::new(self.v, self.w, self.wheels[0], self.wheels[1]);
        let matrix = Matrix4::identity() - now.jacobian(grip, &z) * (GAMMA * h);
        let lu = matrix.lu();
        let Some(k1) = lu.solve(&now.slipping(grip, &z, self)) else { return };
        let second = now.slipping(grip, &(z + h * k1), self) - 2.0 * k1;
        let Some(k2) = lu.solve(&second) else { return };
        let next = z + h * (1.5 * k1 + 0.5 * k2);
        let (v, w) = (0.5 * (self.v + next[0]), 0.5 * (self.w + next[1]));
        let (sin, cos) = (self.heading + 0.5 * h * w).sin_cos();
        self.x += h * v * cos;
        self.y += h * v * sin;
        self.heading += h * w;
        (self.v, self.w, self.wheels) = (next[0], next[1], [next[2], next[3]]);
    }

    /// Casters trail: after a reversal they turn round, over a way, and push sideways while they do.
    fn turn_casters(&mut self, v: f64, way_m: f64, h: f64) {
        if v.abs() > 0.03 && v.signum() != self.direction {
            self.caster = if self.direction == 0.0 { 0.0 } else { v.signum() };
            self.direction = v.signum();
        }
        self.caster *= (-h * v.abs() / way_m).exp();
    }
}
