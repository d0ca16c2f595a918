//! r_r/r_l = 1 + ρ, (r_l + r_r)/2 = r

use super::{Coordinate, DriveExplanation, Driving, ModelChange};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "wheel.radius_mismatch",
    title: "unequal wheel radii",
    equation: "r_r/r_l = 1 + ρ, their mean is nominal",
    source: "Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots (1996), E_d",
    channel: "wheels",
    deficient: "wheel kinematics: the right and left radius differ",
    condition: None,
    parameters: &[Parameter {
        name: "right_over_left_minus_one",
        meaning: "ρ",
        bounds: [-0.5, 0.5],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Run the bidirectional square test of Borenstein and Feng and enter both radii.",
};

/// Unequal wheel radii.
pub(super) struct RadiusMismatch;

impl Driving for RadiusMismatch {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&RadiusMismatch)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for RadiusMismatch {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [1e-3, 0.03], bounds: [-0.5, 0.5] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("right_over_left_minus_one".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("right_over_left_minus_one").copied().unwrap_or(0.0)]
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        let [l, r] = robot.radius_m;
        let left = (l + r) / (2.0 + self.0);
        robot.radius_m = [left, left * (1.0 + self.0)];
    }
}
