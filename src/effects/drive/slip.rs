//! rim = g + λ max(|rim|, |g|, v_low),  λ = κ f artanh(u)/u ≈ κ f + κ₃ f³,  u² = 3 κ₃ f²/κ,  f = F_i/(M g/2)
//!
//! Torque noise is force that slips, too: Jw d(rim)/dt + rim/G = noise/r, G = κ |g|/(r² M g/2). Encoders that read at an instant
//! see all of it, those that average over a row next to nothing: its share is estimated.

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs, Touches};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Moving, Robot};

/// κ, what more than proportional slip adds, and the share of the torque noise that shakes the rims.
const NAMES: [&str; 3] = ["compliance", "cubic_compliance", "torque_noise_share"];

static ABOUT: About = About {
    id: "wheel.slip",
    title: "wheel slip",
    equation: "the rim runs ahead of the ground by slip λ = κ f + κ₃ f³, f the force of the wheel over its load: the inverse of a saturating μ(λ)",
    source: "Alessandri et al.; Gillespie (1992), chapter 10",
    channel: "wheels",
    deficient: "wheel kinematics: the rim runs faster or slower than the ground",
    condition: Some("torque"),
    parameters: &[
        Parameter {
            name: NAMES[0],
            meaning: "κ = dλ/df at zero",
            bounds: [-1.0, 10.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: NAMES[1],
            meaning: "κ₃, more slip near the limit of adhesion",
            bounds: [-1000.0, 1000.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: NAMES[2],
            meaning: "share of the torque noise that shakes the rims as the encoders read them",
            bounds: [0.0, 10.0],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Limit the torque to what the ground carries, and use the filter with slip: a table [traction] in the configuration.",
};

/// Wheel slip.
pub(super) struct Slip;

impl Law for Slip {
    const ITSELF: &'static Self = &Slip;
    #[cfg(test)]
    const TRIED: Tried = Tried { optional: &[("compliance", 0.3), ("cubic_compliance", 1.0)], ..Tried::wheels(&[]) };
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for Slip {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [5e-3, 1.0], bounds: [-1.0, 10.0] },
            Coordinate { scale: [5e-2, 10.0], bounds: [-1000.0, 1000.0] },
        ]
    }

    fn sizes(&self) -> &'static str {
        "Wong, Theory of Ground Vehicles (2008), chapter 1: from tyres on asphalt to wheels on loose sand"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        let [kappa, cubic, share] = std::array::from_fn(|i| theta.get(i).copied().unwrap_or(0.0));
        Box::new(Work { compliances: [kappa, cubic], share })
    }

    /// Stiff to soft, adhesion of 0.1 to 0.6.
    fn starts(&self) -> Vec<Vec<f64>> {
        let mut all = Vec::new();
        for kappa in [0.1, 0.3, 0.8, 2.0] {
            all.extend([0.1, 0.2, 0.6].map(|friction: f64| vec![kappa, kappa / (3.0 * friction * friction)]));
        }
        all
    }

    fn touches(&self) -> Touches {
        Touches::WHEELS
    }

    /// The force must be known apart from the wheel that it moves: accelerations from the same wheel would follow its noise.
    fn positive(&self) -> usize {
        1
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::NOTHING }
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        NAMES.map(str::to_owned).into_iter().zip(theta.iter().copied()).collect()
    }

    /// The share of the torque noise stands after the coordinates, where there is one.
    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let share = parameters.get(NAMES[2]).filter(|share| **share != 0.0);
        let own = NAMES[..2].iter().map(|name| parameters.get(*name).copied().unwrap_or(0.0));
        own.chain(share.copied()).collect()
    }

    fn torque_noise_share(&self) -> Option<&'static str> {
        Some(NAMES[2])
    }

    /// κ/τ = b² M g/(J |v|): rims that run ahead of the ground while the yaw rate grows run ahead of the gyro. Slip that
    /// is not proportional to the force cannot be told.
    fn like_late_gyro(&self, robot: &Robot, speed_m_s: f64) -> Option<Vec<f64>> {
        let per_s = 2.0 * robot.wheel_load_n() * robot.half_track_m.powi(2) / (robot.yaw_inertia_kg_m2 * speed_m_s);
        Some(vec![per_s, 0.0])
    }
}

struct Work {
    /// κ and κ₃
    compliances: [f64; 2],
    /// Share of the torque noise that shakes the rims.
    share: f64,
}

/// Below this speed slip is taken over this speed, m/s: as in the configuration's `[traction]`.
const LOW_M_S: f64 = 0.05;
/// A wheel that drives spins freely beyond this, and the relation says nothing.
const SPINNING: f64 = 0.9;
/// Opposite directions of rim and ground, equally fast.
const OPPOSITE: f64 = 2.0;

/// λ of a wheel that pushes with `f` times its load: κ f artanh(u)/u, u² = 3 κ₃ f²/κ. It is μ₀ tanh(λ/(κ μ₀)) turned round,
/// with μ₀² = κ/(3 κ₃), and κ f + κ₃ f³ near zero; artan where the curve steepens.
fn slip([kappa, cubic]: [f64; 2], f: f64) -> f64 {
    let x = if kappa > 1e-9 { 3.0 * cubic * f * f / kappa } else { 0.0 };
    let bend = if x.abs() < 0.03 {
        1.0 + x / 3.0 + x * x / 5.0
    } else if x > 0.0 {
        let u = x.min(LIMIT).sqrt();
        u.atanh() / u
    } else {
        let u = (-x).sqrt();
        u.atan() / u
    };
    let plain = if kappa > 1e-9 { 0.0 } else { cubic * f * f * f };
    kappa * f * bend + plain
}

/// Upper limit of u², so near the limit of adhesion that the difference is negligible.
const LIMIT: f64 = 0.9999;

/// Time over which a motor's inductance holds its torque noise, s: the order of the electrical time constant of small motors.
const HELD_S: f64 = 1e-3;

/// The deeper the slip, the less the relation says: share of the rim's lead, and of the force, that is uncertain at λ = 1.
const UNCERTAIN: f64 = 0.5;

impl Work {
    /// λ of a wheel, and the speed by which its rim leads the ground, m/s.
    fn lead(&self, robot: &Robot, at: &Moving, i: usize, ground_m_s: f64) -> [f64; 2] {
        let slip = slip(self.compliances, at.wheel_force_n[i] / robot.wheel_load_n());
        let (size, ground) = (slip.abs(), ground_m_s.abs());
        // λ is taken over the faster of rim and ground: where the wheel drives, that is the rim
        let ahead = if slip * ground_m_s > 0.0 {
            let size = size.min(SPINNING);
            size / (1.0 - size) * ground
        } else {
            size.min(OPPOSITE) * ground
        };
        [slip, ahead.max(size.min(OPPOSITE) * LOW_M_S).copysign(slip)]
    }

    /// Variance of the rim's lead by torque noise of the density 1 N·m·√s, (rad/s)². The rim follows its force within
    /// τ = Jw G, G = κ |g|/(r² M g/2): G²/T tanh(T/(2 τ)) of noise that is held for T.
    fn shaken(&self, robot: &Robot, i: usize, ground_m_s: f64) -> f64 {
        let load = robot.radius_m[i].powi(2) * robot.wheel_load_n();
        let gain = self.compliances[0].max(0.0) * ground_m_s.abs().max(LOW_M_S) / load;
        let follows_s = (robot.wheel_inertia_kg_m2 * gain).max(f64::MIN_POSITIVE);
        gain.powi(2) / HELD_S * (0.5 * HELD_S / follows_s).tanh()
    }
}

impl DriveEffect for Work {
    fn wheels_rad_s(&self, robot: &Robot, at: &Moving, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|i| {
            let ground = wheels_rad_s[i] * robot.radius_m[i];
            (ground + self.lead(robot, at, i, ground)[1]) / robot.radius_m[i]
        })
    }

    fn wheel_std_rad_s(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let ground = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
        std::array::from_fn(|i| {
            let [slip, lead] = self.lead(robot, at, i, ground[i]);
            let uncertain = UNCERTAIN * slip.abs().min(1.0) * (lead.abs() + ground[i].abs() * slip.abs().min(1.0));
            let noise = self.share * robot.torque_noise_n_m_sqrt_s;
            let shaken = if noise == 0.0 { 0.0 } else { noise * noise * self.shaken(robot, i, ground[i]) };
            (uncertain / robot.radius_m[i]).powi(2) + shaken
        })
        .map(f64::sqrt)
    }

    fn wheel_variance_by_torque_noise(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let ground = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
        std::array::from_fn(|i| self.shaken(robot, i, ground[i]))
    }

    fn force_std_n(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let load = robot.wheel_load_n();
        at.wheel_force_n.map(|force| UNCERTAIN * slip(self.compliances, force / load).abs().min(1.0) * force.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Stream;

    /// Rims that roll at a constant speed, integrated in small steps, vary by torque noise as much as the law states.
    #[test]
    fn torque_noise_shakes_the_rims_as_their_equation_of_motion_says() {
        const KAPPA: f64 = 0.3;
        const STEPS: usize = 50;
        const HOLDS: usize = 40_000;
        let robot = Robot { wheel_inertia_kg_m2: 2e-3, torque_noise_n_m_sqrt_s: 2e-3, ..Robot::small() };
        let [r, load] = [robot.radius_m[0], robot.wheel_load_n()];
        for speed_m_s in [0.1, 0.4, 2.0] {
            let draw = &mut Stream::new(7, 1);
            let (mut lead, mut sum) = (0.0, 0.0);
            let h = HELD_S / STEPS as f64;
            for _ in 0..HOLDS {
                let noise = robot.torque_noise_n_m_sqrt_s / HELD_S.sqrt() * draw.normal();
                for _ in 0..STEPS {
                    // Jw d(rim)/dt = noise - r F,  F = load λ/κ,  λ = r lead/speed
                    lead += h * (noise - r * load * r * lead / (KAPPA * speed_m_s)) / robot.wheel_inertia_kg_m2;
                }
                sum += lead * lead;
            }
            let at = Moving { speed_m_s, ..Moving::default() };
            let std = |share: f64| Slip.at(&[KAPPA, 0.0, share]).wheel_std_rad_s(&robot, &at)[0];
            let follows_s = robot.wheel_inertia_kg_m2 * KAPPA * speed_m_s / (r * r * load);
            let independent = HOLDS as f64 * (HELD_S / follows_s).min(1.0);
            let ratio = sum / HOLDS as f64 / std(1.0).powi(2);
            // four standard deviations of a mean of squares, and the step's error, first order in h over τ
            let bound = 4.0 * (2.0 / independent).sqrt() + h / follows_s;
            assert!((ratio - 1.0).abs() < bound, "{speed_m_s}: {ratio} ± {bound}");
            assert!(std(0.0) == 0.0);
        }
    }
}
