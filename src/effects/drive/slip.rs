//! rim = g + λ max(|rim|, |g|, v_low),  λ = κ f + κ₃ f³,  f = F_i/(M g/2)

use super::{Coordinate, DriveExplanation, Driving, ModelChange};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving, Robot};

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
            name: "compliance",
            meaning: "κ = dλ/df at zero",
            bounds: [-1.0, 10.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "cubic_compliance",
            meaning: "κ₃, more slip near the limit of adhesion",
            bounds: [-1000.0, 1000.0],
            null: None,
            required: false,
        },
    ],
    remedy: "Limit the torque to what the ground carries, and use the filter with slip: a table [traction] in the configuration.",
};

/// Wheel slip.
pub(super) struct Slip;

impl Driving for Slip {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&Slip)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for Slip {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [5e-3, 1.0], bounds: [-1.0, 10.0] },
            Coordinate { scale: [5e-2, 10.0], bounds: [-1000.0, 1000.0] },
        ]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1]]))
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("compliance".into(), theta[0]), ("cubic_compliance".into(), theta[1])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let value = |name: &str| parameters.get(name).copied().unwrap_or(0.0);
        vec![value("compliance"), value("cubic_compliance")]
    }
}

struct Work([f64; 2]);

/// Below this speed slip is taken over this speed, m/s: as in the configuration's `[traction]`.
const LOW_M_S: f64 = 0.05;
/// Beyond it the wheel spins freely and the relation says nothing.
const LARGEST: f64 = 0.8;

impl DriveEffect for Work {
    fn wheels_rad_s(&self, robot: &Robot, at: &Moving, wheels_rad_s: [f64; 2]) -> [f64; 2] {
        let load = robot.wheel_load_n();
        std::array::from_fn(|i| {
            let f = at.wheel_force_n[i] / load;
            let slip = (f * (self.0[0] + self.0[1] * f * f)).clamp(-LARGEST, LARGEST);
            let ground = wheels_rad_s[i] * robot.radius_m[i];
            // λ is taken over the faster of rim and ground: where the wheel drives, that is the rim
            let over = if slip * ground > 0.0 { ground.abs() / (1.0 - slip.abs()) } else { ground.abs() };
            (ground + slip * over.max(LOW_M_S)) / robot.radius_m[i]
        })
    }
}
