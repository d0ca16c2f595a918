//! F_i = -(M g/2) (c h(v_i/v₁) + q [h(v_i/v₂) - h(v_i/v₁)]), h = tanh: -c (M g/2) sgn(v_i), turned over sharply or softly
//!
//! In all: F = -c (M g/2) Σ_i sgn(v_i),  N = -c (M g/2) b (sgn v_r - sgn v_l)

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving, Robot};

static ABOUT: About = About {
    id: "wheel.rolling_resistance",
    title: "rolling resistance",
    equation: "F_i = -c (M g/2) sgn(v_i) at each wheel",
    source: "Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 4",
    channel: "torque",
    deficient: "equations of motion: a constant force against rolling",
    condition: Some("speed"),
    parameters: &[
        Parameter {
            name: "coefficient",
            meaning: "c, force over weight",
            bounds: [-0.1, 0.5],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: "soft_part",
            meaning: "q, how much of c turns over softly near standstill",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Let the robot coast to a stop and enter the deceleration over g.",
};

/// Rolling resistance.
pub(super) struct RollingResistance;

impl Driving for RollingResistance {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&RollingResistance)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for RollingResistance {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [2e-3, 0.05], bounds: [-0.1, 0.5] },
            Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] },
        ]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1]]))
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("coefficient".into(), theta[0]), ("soft_part".into(), theta[1])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        ["coefficient", "soft_part"].map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::default() }
    }
}

struct Work([f64; 2]);

/// Speeds within which the sign turns over, m/s: a hard contact and a soft one.
const TURNS_M_S: [f64; 2] = [0.002, 0.02];

/// tanh x to 1e-16 absolutely, in a third of the time: the filter takes it at every step of every model.
fn saturating(x: f64) -> f64 {
    if x.abs() > 19.0 {
        return x.signum();
    }
    let t = (-2.0 * x.abs()).exp();
    ((1.0 - t) / (1.0 + t)).copysign(x)
}

impl DriveEffect for Work {
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let [hard, soft] = self.0;
        let [l, r] = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s).map(|v| {
            let [sharp, slow] = TURNS_M_S.map(|turn| saturating(v / turn));
            hard * sharp + soft * (slow - sharp)
        });
        let load = robot.wheel_load_n();
        [-load * (l + r), -load * robot.half_track_m * (r - l)]
    }
}
