//! rim = g + λ max(|rim|, |g|, v_low),  λ = κ f artanh(u)/u ≈ κ f + κ₃ f³,  u² = 3 κ₃ f²/κ,  f = F_i/(M g/2)

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs, Touches};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Moving, Robot};

/// κ, and what more than proportional slip adds.
const COMPLIANCES: [&str; 2] = ["compliance", "cubic_compliance"];

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
            name: COMPLIANCES[0],
            meaning: "κ = dλ/df at zero",
            bounds: [-1.0, 10.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: COMPLIANCES[1],
            meaning: "κ₃, more slip near the limit of adhesion",
            bounds: [-1000.0, 1000.0],
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
        Box::new(Work([theta[0], theta[1]]))
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
        COMPLIANCES.map(str::to_owned).into_iter().zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        COMPLIANCES.map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    /// κ/τ = b² M g / (J |v|): rims that run ahead of the ground while the yaw rate grows run ahead of the gyro. Slip that
    /// is not proportional to the force cannot be told.
    fn like_late_gyro(&self, robot: &Robot, speed_m_s: f64) -> Option<Vec<f64>> {
        let per_s = 2.0 * robot.wheel_load_n() * robot.half_track_m.powi(2) / (robot.yaw_inertia_kg_m2 * speed_m_s);
        Some(vec![per_s, 0.0])
    }
}

struct Work([f64; 2]);

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

/// The deeper the slip, the less the relation says: share of the rim's lead, and of the force, that is uncertain at λ = 1.
const UNCERTAIN: f64 = 0.5;

impl Work {
    /// λ of a wheel, and the speed by which its rim leads the ground, m/s.
    fn lead(&self, robot: &Robot, at: &Moving, i: usize, ground_m_s: f64) -> [f64; 2] {
        let slip = slip(self.0, at.wheel_force_n[i] / robot.wheel_load_n());
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
            UNCERTAIN * slip.abs().min(1.0) * (lead.abs() + ground[i].abs() * slip.abs().min(1.0)) / robot.radius_m[i]
        })
    }

    fn force_std_n(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let load = robot.wheel_load_n();
        at.wheel_force_n.map(|force| UNCERTAIN * slip(self.0, force / load).abs().min(1.0) * force.abs())
    }
}
