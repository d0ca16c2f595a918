//! z = z* + g f(z): one stage of the implicit step, by Newton's method on the two traction forces
//!
//! Given the forces, v, ω and the wheels' speeds are affine; F = N μ(λ(F)) remains to be solved. The last matrix of
//! Newton's method carries changes of z* and of the torques to changes of z (implicit function theorem).

use super::{Slipping, Velocities};
use crate::traction::Slip;

/// Newton's method takes two to five iterations where the contact grips.
const ITERATIONS: usize = 25;
/// One more iteration is the last once the forces miss by less than this part of the load: it leaves the square of
/// that.
const NEAR: f64 = 1e-7;

/// A stage's solution, and the inverse of Newton's matrix with its factors.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    pub velocities: Velocities,
    /// ∂φ̇i/∂(φ̇i before + g/J (ui - r Fi)).
    keep: [f64; 2],
    /// ∂Fi/∂φ̇i, ∂Fi/∂(ground speed).
    by_wheel: [f64; 2],
    by_ground: [f64; 2],
    inverse: [[f64; 2]; 2],
}

/// Wheel speeds under trial forces, their derivatives, and `miss`: traction minus force, N.
#[derive(Clone, Copy, Default)]
struct Trial {
    wheels: [f64; 2],
    keep: [f64; 2],
    by_wheel: [f64; 2],
    by_ground: [f64; 2],
    miss: [f64; 2],
}

impl Slipping {
    pub(super) fn forces(&self, v: &Velocities) -> [f64; 2] {
        let ground = [v[0] - self.half_track_m * v[1], v[0] + self.half_track_m * v[1]];
        std::array::from_fn(|i| {
            let slip = Slip::new(self.radius_m * v[2 + i], ground[i], self.low_speed_m_s);
            self.loads_n[i] * self.law.friction(slip.slip)[0]
        })
    }

    /// Solves z = base + g f(z), beginning from `forces`.
    pub(super) fn stage(
        &self,
        base: &Velocities,
        torques: [f64; 2],
        g: f64,
        forces: [f64; 2],
        settle: bool,
    ) -> Option<Stage> {
        let (b, r) = (self.half_track_m, self.radius_m);
        let by_torque = g * self.inverse_wheel_inertia;
        // ground speed of a wheel by its own force, and by the other's
        let own = g * (self.inverse_mass + b * b * self.inverse_yaw_inertia);
        let other = g * (self.inverse_mass - b * b * self.inverse_yaw_inertia);
        let evaluate = |f: [f64; 2]| self.trial(base, torques, by_torque, [own, other], f);
        let size = |at: &Trial| at.miss[0] * at.miss[0] + at.miss[1] * at.miss[1];
        let near = NEAR * (self.loads_n[0] + self.loads_n[1]);
        let (mut f, mut at) = (forces, evaluate(forces));
        let mut inverse = [[0.0; 2]; 2];
        for _ in 0..ITERATIONS {
            let diagonal: [f64; 2] =
                std::array::from_fn(|i| 1.0 + at.by_wheel[i] * at.keep[i] * by_torque * r - at.by_ground[i] * own);
            let beside: [f64; 2] = std::array::from_fn(|i| -at.by_ground[i] * other);
            let determinant = diagonal[0] * diagonal[1] - beside[0] * beside[1];
            let scale = 1.0 / determinant;
            inverse = [[diagonal[1] * scale, -beside[0] * scale], [-beside[1] * scale, diagonal[0] * scale]];
            let step: [f64; 2] = std::array::from_fn(|i| inverse[i][0] * at.miss[0] + inverse[i][1] * at.miss[1]);
            if size(&at) <= near * near {
                // a negative determinant is a branch that the motion cannot follow
                if determinant <= 0.0 && !settle {
                    return None;
                }
                // the last iteration leaves the square of this: no need to look
                for i in 0..2 {
                    f[i] += step[i];
                    at.wheels[i] -= at.keep[i] * by_torque * r * step[i];
                }
                return Some(self.solved(base, &at, f, inverse, g));
            }
            if !step.iter().all(|s| s.is_finite()) {
                break;
            }
            // Newton's step, shortened until it comes nearer; at the kinks of slip and law it may overshoot
            let (mut part, mut next) = (1.0, f);
            let mut tried = at;
            for _ in 0..6 {
                next = std::array::from_fn(|i| f[i] + part * step[i]);
                tried = evaluate(next);
                if size(&tried) < size(&at) {
                    break;
                }
                part *= 0.5;
            }
            let stalled = !(size(&tried) < size(&at));
            if stalled && !settle {
                return None;
            }
            (f, at) = (next, tried);
        }
        settle.then(|| self.solved(base, &at, f, inverse, g))
    }

    /// Result of the trial forces `f` (N); `reach`: ground speed of a wheel by its own force, and by the other's.
    #[inline]
    fn trial(&self, base: &Velocities, torques: [f64; 2], by_torque: f64, reach: [f64; 2], f: [f64; 2]) -> Trial {
        let lead = self.half_track_m * base[1];
        let ground_before = [base[0] - lead, base[0] + lead];
        let mut at = Trial::default();
        for i in 0..2 {
            let free = base[2 + i] + by_torque * (torques[i] - self.radius_m * f[i]);
            let (wheel, keep) = self.resisted(i, free, by_torque);
            let ground = ground_before[i] + reach[0] * f[i] + reach[1] * f[1 - i];
            let slip = Slip::new(self.radius_m * wheel, ground, self.low_speed_m_s);
            let [mu, slope] = self.law.friction(slip.slip);
            let slope_n = self.loads_n[i] * slope;
            at.wheels[i] = wheel;
            at.keep[i] = keep;
            at.by_wheel[i] = slope_n * slip.by_rim * self.radius_m;
            at.by_ground[i] = slope_n * slip.by_ground;
            at.miss[i] = self.loads_n[i] * mu - f[i];
        }
        at
    }

    /// Wheel speed φ̇ with φ̇ + g/J (c φ̇ + rolling resistance) = `free`, and its derivative by `free`.
    fn resisted(&self, i: usize, free: f64, by_torque: f64) -> (f64, f64) {
        let viscous = 1.0 + by_torque * self.friction_n_m_s;
        if self.rolling_n_m[i] == 0.0 {
            let keep = 1.0 / viscous;
            return (free * keep, keep);
        }
        // inside ± v_low the resistance is proportional, outside constant
        let steep = 1.0 / (viscous + by_torque * self.rolling_n_m[i] * self.radius_m / self.low_speed_m_s);
        let slow = free * steep;
        if (self.radius_m * slow).abs() <= self.low_speed_m_s {
            return (slow, steep);
        }
        ((free - (by_torque * self.rolling_n_m[i]).copysign(free)) / viscous, 1.0 / viscous)
    }

    fn solved(&self, base: &Velocities, at: &Trial, f: [f64; 2], inverse: [[f64; 2]; 2], g: f64) -> Stage {
        Stage {
            velocities: [
                base[0] + g * self.inverse_mass * (f[0] + f[1]),
                base[1] + g * self.inverse_yaw_inertia * self.half_track_m * (f[1] - f[0]),
                at.wheels[0],
                at.wheels[1],
            ],
            keep: at.keep,
            by_wheel: at.by_wheel,
            by_ground: at.by_ground,
            inverse,
        }
    }

    /// Change of a stage's solution by a change of its base and torques.
    pub(super) fn carry(&self, stage: &Stage, base: &Velocities, torques: [f64; 2], g: f64) -> Velocities {
        let (b, r) = (self.half_track_m, self.radius_m);
        let by_torque = g * self.inverse_wheel_inertia;
        let ground = [base[0] - b * base[1], base[0] + b * base[1]];
        let cause: [f64; 2] = std::array::from_fn(|i| {
            stage.by_wheel[i] * stage.keep[i] * (base[2 + i] + by_torque * torques[i]) + stage.by_ground[i] * ground[i]
        });
        let f: [f64; 2] = std::array::from_fn(|i| stage.inverse[i][0] * cause[0] + stage.inverse[i][1] * cause[1]);
        [
            base[0] + g * self.inverse_mass * (f[0] + f[1]),
            base[1] + g * self.inverse_yaw_inertia * b * (f[1] - f[0]),
            stage.keep[0] * (base[2] + by_torque * (torques[0] - r * f[0])),
            stage.keep[1] * (base[3] + by_torque * (torques[1] - r * f[1])),
        ]
    }
}
