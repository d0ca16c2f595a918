//! M dv/dt = FL + FR,  Jc dω/dt = b (FR - FL),  Jw dφ̇i/dt = ui - c φ̇i - ρ Ni r sat(r φ̇i/v_low) - r Fi,  Fi = Ni μ(λi)
//!
//! Wheels that slip: the dynamics of Alessandri et al., equations (5c), (5d), (5g), (5h), (5i), corrected: the lever arm
//! is the half track b, and x' = v cos θ, y' = v sin θ in place of (5e, f), which lack the lateral constraint force. The
//! law of traction μ, which the paper leaves open, and slip λ are those of [`crate::traction`]. Ni is the load on a
//! wheel, ρ the rolling resistance, c the viscous friction.
//!
//! # Integrator
//!
//! Slip decays at about (r² k N/Jw + 2 k N/M)/v, k = dμ/dλ at zero: 6475 1/s for r = 0.1 m, Jw = 0.01 kg·m², M = 20 kg,
//! k = 30, v = 0.5 m/s, and more at lower speed. The step is implicit: the two-stage diagonally implicit Runge-Kutta
//! method of order 2 with γ = 1 - 1/√2, L-stable and stiffly accurate (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006).
//! Each stage z = z* + g f(z) is affine in the two forces but for F = N μ(λ): Newton's method runs on two unknowns,
//! whatever the size of the state, and its last matrix gives the exact derivatives of the step (implicit function
//! theorem). Where it does not converge (a light wheel beyond the peak of μ may jump), the step is
//! split, and so it is where its error, estimated by the difference to a step of order one, is too large.
//!
//! x, y and θ follow by [`super::advance`] with the step's mean accelerations: of order 2, and without sideways motion.
//! [`Slipping::euler`] is the paper's explicit step, for comparison: it diverges where h times the rate above exceeds 2.

mod stage;

use super::planar::{Forcing, Motion, MotionJacobian, advance, advance_with_jacobian};
use crate::config::{Traction, Vehicle};
use crate::traction::{Slip, TractionLaw};
use crate::units::STANDARD_GRAVITY_M_S2;

/// State of the slipping robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SlippingState {
    /// Pose and velocity of the axle's centre.
    pub motion: Motion,
    /// φ̇ of the wheels, left and right, rad/s.
    pub wheels_rad_s: [f64; 2],
}

/// Number of velocities: v, ω, φ̇L, φ̇R.
const VELOCITIES: usize = 4;
/// Number of inputs to a step's velocities: the velocities before, and the two torques.
const CAUSES: usize = VELOCITIES + 2;

/// Derivatives of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SlippingJacobian {
    /// ∂(v, ω, φ̇L, φ̇R)/∂(v, ω, φ̇L, φ̇R, uL, uR): row by row.
    pub velocities: [[f64; CAUSES]; VELOCITIES],
    /// ∂(x, y, θ)/∂(v, ω, φ̇L, φ̇R, uL, uR): row by row.
    pub pose: [[f64; CAUSES]; 3],
    /// ∂(x, y)/∂θ.
    pub position_by_heading: [f64; 2],
}

/// A robot whose two driven wheels slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slipping {
    radius_m: f64,
    half_track_m: f64,
    inverse_mass: f64,
    inverse_yaw_inertia: f64,
    inverse_wheel_inertia: f64,
    friction_n_m_s: f64,
    low_speed_m_s: f64,
    loads_n: [f64; 2],
    /// Greatest torque of the rolling resistance, N·m.
    rolling_n_m: [f64; 2],
    law: TractionLaw,
    tolerance_m_s: f64,
}

/// Velocities v, ω, φ̇L, φ̇R.
type Velocities = [f64; VELOCITIES];

/// Error of a speed that a step may make, m/s, estimated by the difference of orders two and one, which is larger: a
/// third of what an encoder of 0.02 rad/s shows of a wheel of 5 cm.
const TOLERANCE_M_S: f64 = 3e-4;

/// γ of the two stages.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Weight of the first stage's slope in the second stage's base: (1 - γ)/γ.
const CARRY: f64 = (1.0 - GAMMA) / GAMMA;
/// A step is split at most this often, one part inside the other, where it has no solution, and where it is not accurate.
const SPLITS: u32 = 12;
const SPLITS_FOR_ACCURACY: u32 = 3;
/// At once it is split into at most so many parts.
const PARTS_LIMIT: u32 = 8;
/// A wheel without inertia would follow its force without delay: taken as this, kg·m².
const WHEEL_INERTIA_FLOOR: f64 = 1e-9;

impl Slipping {
    /// The robot that the two tables describe; their values are taken as checked by the configuration.
    #[must_use]
    pub fn new(vehicle: &Vehicle, traction: &Traction) -> Self {
        let driven_n = vehicle.whole_mass_kg() * STANDARD_GRAVITY_M_S2 * traction.driven_load_share;
        let loads_n = [driven_n * traction.left_load_share, driven_n * (1.0 - traction.left_load_share)];
        Self {
            radius_m: vehicle.wheel_radius_m,
            half_track_m: vehicle.half_track_m,
            inverse_mass: 1.0 / vehicle.whole_mass_kg(),
            inverse_yaw_inertia: 1.0 / vehicle.yaw_inertia_kg_m2,
            inverse_wheel_inertia: 1.0 / vehicle.wheel_inertia_kg_m2.max(WHEEL_INERTIA_FLOOR),
            friction_n_m_s: vehicle.viscous_friction_n_m_s,
            low_speed_m_s: traction.low_speed_m_s,
            loads_n,
            rolling_n_m: loads_n.map(|n| traction.rolling_resistance * n * vehicle.wheel_radius_m),
            law: traction.law,
            tolerance_m_s: TOLERANCE_M_S,
        }
    }

    /// The same with steps split until a speed's error is estimated below `tolerance_m_s` (3e-4 m/s without this call).
    #[must_use]
    pub(crate) fn with_tolerance(self, tolerance_m_s: f64) -> Self {
        Self { tolerance_m_s, ..self }
    }

    /// Speed of each wheel's centre over ground, m/s.
    #[must_use]
    pub(crate) fn ground_speeds_m_s(&self, motion: &Motion) -> [f64; 2] {
        let lead = self.half_track_m * motion.yaw_rate_rad_s;
        [motion.speed_m_s - lead, motion.speed_m_s + lead]
    }

    /// λ of each wheel.
    #[must_use]
    pub(crate) fn slips(&self, state: &SlippingState) -> [Slip; 2] {
        let ground = self.ground_speeds_m_s(&state.motion);
        std::array::from_fn(|i| Slip::new(self.radius_m * state.wheels_rad_s[i], ground[i], self.low_speed_m_s))
    }

    /// ∂λ/∂(v, ω, φ̇) of each wheel, φ̇ being its own.
    #[must_use]
    pub(crate) fn slip_derivatives(&self, state: &SlippingState) -> [[f64; 3]; 2] {
        let slips = self.slips(state);
        let arm = [-self.half_track_m, self.half_track_m];
        std::array::from_fn(|i| [slips[i].by_ground, slips[i].by_ground * arm[i], slips[i].by_rim * self.radius_m])
    }

    /// The law of traction.
    #[must_use]
    pub(crate) fn law(&self) -> &TractionLaw {
        &self.law
    }

    /// Decay rate of slip at speed `speed_m_s`, 1/s: the stiffness that limits an explicit step.
    #[must_use]
    pub(crate) fn slip_rate_per_s(&self, speed_m_s: f64) -> f64 {
        let slope = self.law.friction(0.0)[1];
        let load = 0.5 * (self.loads_n[0] + self.loads_n[1]);
        let r = self.radius_m;
        slope * load * (r * r * self.inverse_wheel_inertia + 2.0 * self.inverse_mass)
            / speed_m_s.abs().max(self.low_speed_m_s)
    }

    /// The state `dt_s` later, `torques_n_m` (left, right) held.
    #[must_use]
    pub fn step(&self, state: &SlippingState, torques_n_m: [f64; 2], dt_s: f64) -> SlippingState {
        self.split::<false>(state, torques_n_m, dt_s, 0).0
    }

    /// The state `dt_s` later, and its derivatives.
    #[must_use]
    pub(crate) fn step_with_jacobian(
        &self,
        state: &SlippingState,
        torques_n_m: [f64; 2],
        dt_s: f64,
    ) -> (SlippingState, SlippingJacobian) {
        self.split::<true>(state, torques_n_m, dt_s, 0)
    }

    /// A step in as many parts as it takes; `deep`: how many times it has been split already.
    fn split<const JACOBIAN: bool>(
        &self,
        state: &SlippingState,
        torques: [f64; 2],
        dt_s: f64,
        deep: u32,
    ) -> (SlippingState, SlippingJacobian) {
        let parts = match self.whole::<JACOBIAN>(state, torques, dt_s, deep) {
            Ok(done) => return done,
            Err(parts) => parts,
        };
        let part = dt_s / f64::from(parts);
        let (mut state, mut all) = self.split::<JACOBIAN>(state, torques, part, deep + 1);
        for _ in 1..parts {
            let (next, by) = self.split::<JACOBIAN>(&state, torques, part, deep + 1);
            if JACOBIAN {
                all = by.after(&all);
            }
            state = next;
        }
        (state, all)
    }

    /// One step, or the number of parts to take it in, where a stage has no solution near or the error is too large. A
    /// step at the limit of splitting is accepted.
    fn whole<const JACOBIAN: bool>(
        &self,
        state: &SlippingState,
        torques: [f64; 2],
        dt_s: f64,
        deep: u32,
    ) -> std::result::Result<(SlippingState, SlippingJacobian), u32> {
        let settle = deep == SPLITS;
        let m = &state.motion;
        let before = [m.speed_m_s, m.yaw_rate_rad_s, state.wheels_rad_s[0], state.wheels_rad_s[1]];
        let g = GAMMA * dt_s;
        let first = self.stage(&before, torques, g, self.forces(&before), settle).ok_or(2u32)?;
        let base: Velocities = std::array::from_fn(|i| before[i] + CARRY * (first.velocities[i] - before[i]));
        let second = self.stage(&base, torques, g, self.forces(&first.velocities), settle).ok_or(2u32)?;
        let after = second.velocities;
        if deep < SPLITS_FOR_ACCURACY {
            // against the step of order one with the last slope, what is stiff damped as the stage damps it
            let error = std::array::from_fn(|i| after[i] - before[i] - (after[i] - base[i]) / GAMMA);
            let error = self.carry(&second, &error, [0.0; 2], g);
            let speeds = [error[0], self.half_track_m * error[1], self.radius_m * error[2], self.radius_m * error[3]];
            let excess = speeds.iter().fold(0.0, |most, e| f64::max(most, e.abs())) / self.tolerance_m_s;
            if excess > 1.0 {
                // the error falls with the square of the step
                return Err((excess.sqrt().ceil() as u32).clamp(2, PARTS_LIMIT));
            }
        }
        let forcing = Forcing::between([before[0], before[1]], [after[0], after[1]], dt_s);
        if !JACOBIAN {
            let motion = advance(m, &forcing, dt_s);
            return Ok((self.state(motion, after), SlippingJacobian::identity()));
        }
        let (motion, by) = advance_with_jacobian(m, &forcing, dt_s);
        let mut velocities = [[0.0; CAUSES]; VELOCITIES];
        for cause in 0..CAUSES {
            let mut start = [0.0; VELOCITIES];
            let mut torque = [0.0; 2];
            match cause.checked_sub(VELOCITIES) {
                None => start[cause] = 1.0,
                Some(side) => torque[side] = 1.0,
            }
            let middle = self.carry(&first, &start, torque, g);
            let base = std::array::from_fn(|i| start[i] + CARRY * (middle[i] - start[i]));
            let end = self.carry(&second, &base, torque, g);
            for (row, value) in velocities.iter_mut().zip(end) {
                row[cause] = value;
            }
        }
        Ok((self.state(motion, after), SlippingJacobian::new(velocities, &by, dt_s)))
    }

    /// The motion with its velocities exactly as the stages have them.
    fn state(&self, motion: Motion, v: Velocities) -> SlippingState {
        SlippingState { motion: Motion { speed_m_s: v[0], yaw_rate_rad_s: v[1], ..motion }, wheels_rad_s: [v[2], v[3]] }
    }
}

impl SlippingJacobian {
    fn identity() -> Self {
        let mut velocities = [[0.0; CAUSES]; VELOCITIES];
        for (i, row) in velocities.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        Self { velocities, pose: [[0.0; CAUSES]; 3], position_by_heading: [0.0; 2] }
    }

    /// Derivatives of a step whose pose was carried with the accelerations (after - before)/dt.
    fn new(velocities: [[f64; CAUSES]; VELOCITIES], by: &MotionJacobian, dt_s: f64) -> Self {
        let mut pose = [[0.0; CAUSES]; 3];
        let rate = 1.0 / dt_s;
        for cause in 0..CAUSES {
            // the change of v or ω before the step itself
            let own = |k: usize| if cause == k { 1.0 } else { 0.0 };
            let a = (velocities[0][cause] - own(0)) * rate;
            let alpha = (velocities[1][cause] - own(1)) * rate;
            for (i, row) in pose.iter_mut().take(2).enumerate() {
                row[cause] = by.position_by_speed[i] * own(0)
                    + by.position_by_yaw_rate[i] * own(1)
                    + by.position_by_acceleration[i] * a
                    + by.position_by_yaw_acceleration[i] * alpha;
            }
            pose[2][cause] = by.heading_by_yaw_rate * own(1) + by.heading_by_yaw_acceleration * alpha;
        }
        Self { velocities, pose, position_by_heading: by.position_by_heading }
    }

    /// Chain rule: this step's derivatives after those of the step `before`, under the same torques.
    fn after(&self, before: &Self) -> Self {
        // a row by velocities and torques, after the step before: torques act in both
        let chain = |row: &[f64; CAUSES]| {
            let mut out = [0.0; CAUSES];
            for (k, factor) in row.iter().take(VELOCITIES).enumerate() {
                for (o, b) in out.iter_mut().zip(&before.velocities[k]) {
                    *o += factor * b;
                }
            }
            for side in VELOCITIES..CAUSES {
                out[side] += row[side];
            }
            out
        };
        let velocities = self.velocities.map(|row| chain(&row));
        let mut pose = self.pose.map(|row| chain(&row));
        for (i, row) in pose.iter_mut().enumerate() {
            let by_heading = self.position_by_heading.get(i).copied().unwrap_or(0.0);
            for (value, (own, heading)) in row.iter_mut().zip(before.pose[i].iter().zip(&before.pose[2])) {
                *value += own + by_heading * heading;
            }
        }
        let position_by_heading = std::array::from_fn(|i| before.position_by_heading[i] + self.position_by_heading[i]);
        Self { velocities, pose, position_by_heading }
    }
}

#[cfg(test)]
mod tests;
