//! s = -k v ω

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs, Touches};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Moving};

static ABOUT: About = About {
    id: "wheel.lateral_skid",
    title: "sideways skid in turns",
    equation: "s = -k v ω: the robot slides outwards in turns",
    source: "Martínez et al., Approximating kinematics for tracked mobile robots (2005)",
    channel: "pose",
    deficient: "kinematics: the robot moves sideways in turns",
    condition: None,
    parameters: &[Parameter {
        name: "lateral_slip_s",
        meaning: "k, s",
        bounds: [-2.0, 2.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Lower the speed in turns, or give the filter a sideways velocity.",
};

/// Sideways skid in turns.
pub(super) struct LateralSkid;

impl Driving for LateralSkid {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&LateralSkid)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for LateralSkid {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [2e-3, 0.2], bounds: [-2.0, 2.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn touches(&self) -> Touches {
        Touches::MOTION
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("lateral_slip_s".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("lateral_slip_s").copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        Needs { pose: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn sideways_m_s(&self, at: &Moving) -> f64 {
        -self.0 * at.speed_m_s * at.yaw_rate_rad_s
    }
}
