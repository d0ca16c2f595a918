//! F = -M g sin(α) cos(θ - ψ) = -M g (p cos θ + q sin θ)

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs, Touches};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, ForceFollows, GRAVITY_M_S2, Moving, Robot};
use crate::robot::Truth;

static ABOUT: About = About {
    id: "ground.slope",
    title: "tilted floor",
    equation: "F = -M g sin(α) cos(θ - ψ), α the slope, ψ the heading that points uphill",
    source: "Gillespie (1992), chapter 4, grade",
    channel: "torque",
    deficient: "equations of motion: the floor is tilted",
    condition: Some("heading"),
    parameters: &[
        Parameter { name: "slope_rad", meaning: "α, rad", bounds: [0.0, 1.0], null: Some(0.0), required: true },
        Parameter { name: "uphill_heading_rad", meaning: "ψ, rad", bounds: [-7.0, 7.0], null: None, required: true },
    ],
    remedy: "Level the floor, or give the controller the pitch of an accelerometer.",
};

/// Tilted floor.
pub(super) struct Slope;

impl Law for Slope {
    const ITSELF: &'static Self = &Slope;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("slope_rad", 0.02), ("uphill_heading_rad", 0.7)]);
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for Slope {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [2e-3, 0.1], bounds: [-0.8, 0.8] },
            Coordinate { scale: [2e-3, 0.1], bounds: [-0.8, 0.8] },
        ]
    }

    fn sizes(&self) -> &'static str {
        "ISO 21542:2011: floors are level to some thousandths, ramps rise by up to 1 in 12"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1]]))
    }

    fn touches(&self) -> Touches {
        Touches::MOTION
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        let sine = theta[0].hypot(theta[1]).min(1.0);
        Parameters::from([("slope_rad".into(), sine.asin()), ("uphill_heading_rad".into(), theta[1].atan2(theta[0]))])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let value = |name: &str| parameters.get(name).copied().unwrap_or(0.0);
        let (sine, (sin, cos)) = (value("slope_rad").sin(), value("uphill_heading_rad").sin_cos());
        vec![sine * cos, sine * sin]
    }

    fn described(&self, parameters: &Parameters) -> Option<Truth> {
        let value = |name: &str| parameters.get(name).copied().unwrap_or(0.0);
        Some(Truth::Slope { slope: value("slope_rad"), uphill: value("uphill_heading_rad") })
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::NOTHING }
    }
}

struct Work([f64; 2]);

impl DriveEffect for Work {
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let (sin, cos) = at.heading_rad.sin_cos();
        [-robot.mass_kg * GRAVITY_M_S2 * (self.0[0] * cos + self.0[1] * sin), 0.0]
    }

    fn force_follows(&self) -> ForceFollows {
        ForceFollows { position: false, heading: true, speeds: false, accelerations: false }
    }

    fn pushes_alike(&self, one: &Robot, other: &Robot) -> bool {
        one.mass_kg == other.mass_kg
    }
}
