//! b = (1 + s) b_nominal

use super::{Coordinate, DriveExplanation, Driving, ModelChange};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "vehicle.track_width",
    title: "half track off nominal",
    equation: "b = (1 + s) b_nominal",
    source: "Borenstein and Feng (1996), E_b",
    channel: "wheels",
    deficient: "wheel kinematics: the half track differs from nominal",
    condition: None,
    parameters: &[Parameter { name: "relative", meaning: "s", bounds: [-0.5, 1.0], null: Some(0.0), required: true }],
    remedy: "Turn ten times on the spot and compare the turned angle with the wheels.",
};

/// Half track off nominal.
pub(super) struct TrackWidth;

impl Driving for TrackWidth {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&TrackWidth)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for TrackWidth {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [3e-3, 0.1], bounds: [-0.5, 1.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("relative".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("relative").copied().unwrap_or(0.0)]
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.half_track_m *= 1.0 + self.0;
    }
}
