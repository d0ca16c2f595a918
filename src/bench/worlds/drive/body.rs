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
//! F_i = load μ(s_i),  Jw dwheel_i/dt = u_i - r_i F_i                             diagonally implicit Runge-Kutta, two stages
//! ```
//!
//! with γ = 1 - 1/√2: L-stable and stiffly accurate (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006), so that the stiffer the
//! contact, the nearer it comes to rolling. The contact's equation is solved, not linearised: a step that is linear in μ
//! overshoots its bend.

use super::grip::Grip;
use super::world::World;
use crate::config::Vehicle;

const GRAVITY_M_S2: f64 = 9.806_65;

/// How the robot moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Motion {
    /// Speed forwards, m/s, and yaw rate, rad/s, of the middle of the axle.
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
    /// Moment of the casters over its largest: 1 just after a reversal to forwards, -1 to backwards, then decaying.
    pub caster: f64,
    /// Forces of the wheels on the ground where they slip, N.
    pub grip_n: [f64; 2],
    /// Direction in which it went last.
    pub direction: f64,
}

/// Quantities that are constant within a substep, SI.
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

    /// One stage of wheels that slip: z = base + q f(z), and f(z). `forces` of the wheels are a guess and become the solution.
    ///
    /// Slow terms (friction, floor, those of the offset) are evaluated at `base`. The wheels' forces couple weakly
    /// through the body: each is solved for in its turn, and both once more.
    fn stage(&self, grip: &Grip, base: [f64; 4], q: f64, at: &Motion, forces: &mut [f64; 2]) -> ([f64; 4], [f64; 4]) {
        let (m, d, b) = (self.mass, self.offset, self.half_track);
        let yaw = self.inertia + m * d * d;
        let [v, w, left, right] = base;
        let (force, moment) = self.outside(v, w, at.x, at.y, at.heading);
        let slow = [
            force / m + d * w * w,
            (moment - m * d * v * w) / yaw,
            self.drive(0, left) / self.wheel_inertia,
            self.drive(1, right) / self.wheel_inertia,
        ];
        let free: [f64; 4] = std::array::from_fn(|i| base[i] + q * slow[i]);
        let (own, other) = (q * (1.0 / m + b * b / yaw), q * (1.0 / m - b * b / yaw));
        let load = 0.5 * m * GRAVITY_M_S2;
        for _ in 0..2 {
            for (i, side) in [(0, -1.0), (1, 1.0)] {
                let r = self.radius[i];
                let rim = [r * free[2 + i], q * r * r / self.wheel_inertia];
                let ground = [free[0] + side * b * free[1] + other * forces[1 - i], own];
                forces[i] = contact(grip, load, rim, ground, forces[i]);
            }
        }
        let [fl, fr] = *forces;
        let rate = [
            slow[0] + (fl + fr) / m,
            slow[1] + b * (fr - fl) / yaw,
            slow[2] - self.radius[0] * fl / self.wheel_inertia,
            slow[3] - self.radius[1] * fr / self.wheel_inertia,
        ];
        (std::array::from_fn(|i| base[i] + q * rate[i]), rate)
    }
}

/// The force F = load μ of a wheel whose rim moves at rim₀ - rim₁ F over ground at ground₀ + ground₁ F: by false position between
/// both limits of the friction (Illinois variant), halving now and then.
fn contact(grip: &Grip, load: f64, rim: [f64; 2], ground: [f64; 2], guess: f64) -> f64 {
    let off = |f: f64| f - load * grip.share(rim[0] - rim[1] * f, ground[0] + ground[1] * f);
    let most = 1.000_1 * load * grip.limit;
    let (mut low, mut high) = (-most, most);
    let (mut off_low, mut off_high) = (off(low), off(high));
    let mut at = guess.clamp(low, high);
    let mut kept = 0;
    for turn in 1..60 {
        let here = off(at);
        if here.abs() < 1e-10 * load || high - low < 1e-13 * load {
            break;
        }
        if here < 0.0 {
            (low, off_low) = (at, here);
            if kept == -1 {
                off_high *= 0.5;
            }
            kept = -1;
        } else {
            (high, off_high) = (at, here);
            if kept == 1 {
                off_low *= 0.5;
            }
            kept = 1;
        }
        at = match turn % 4 {
            3 => 0.5 * (low + high),
            _ => high - off_high * (high - low) / (off_high - off_low),
        };
    }
    at
}

impl Motion {
    /// Moves on by `h` seconds from `t`; `torque` is that of the wheels.
    pub(crate) fn step(&mut self, vehicle: &Vehicle, world: &World, torque: [f64; 2], t: f64, h: f64) {
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
            half_track: vehicle.half_track_m * world.wheels.half_track_factor(self.v),
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
    pub(crate) fn radius_factor(&self, world: &World, i: usize, t: f64) -> f64 {
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
        let base = [self.v, self.w, self.wheels[0], self.wheels[1]];
        let mut forces = self.grip_n;
        let (_, first) = now.stage(grip, base, GAMMA * h, self, &mut forces);
        let base = std::array::from_fn(|i| base[i] + (1.0 - GAMMA) * h * first[i]);
        let (next, _) = now.stage(grip, base, GAMMA * h, self, &mut forces);
        self.grip_n = forces;
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
