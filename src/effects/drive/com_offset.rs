//! M (dv/dt - d ω²) = F,  (Jc + M d²) dω/dt + M d v ω = moment

use super::{Coordinate, DriveExplanation, Driving, ModelChange, Needs};
use crate::effects::parts::Checked;
use crate::effects::{About, Parameter, Parameters};
use crate::error::Result;
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "vehicle.com_offset",
    title: "centre of mass off the axle",
    equation: "M (dv/dt - d ω²) = F, (Jc + M d²) dω/dt + M d v ω = moment",
    source: "Fierro and Lewis, Control of a nonholonomic mobile robot (1997), equation 3",
    channel: "torque",
    deficient: "equations of motion: the centre of mass lies off the axle",
    condition: None,
    parameters: &[Parameter {
        name: "offset_m",
        meaning: "d, ahead of the axle, m",
        bounds: [-1.0, 1.0],
        null: Some(0.0),
        required: true,
    }],
    remedy: "Weigh the robot on its wheels and casters and enter the offset.",
};

/// Centre of mass off the axle.
pub(super) struct ComOffset;

impl Driving for ComOffset {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn explanation(&self) -> DriveExplanation {
        DriveExplanation::Model(&ComOffset)
    }

    fn simulated(&self, parameters: &Parameters, _: f64, _: u64) -> Result<Box<dyn DriveEffect>> {
        Checked::of(&ABOUT, parameters)?;
        Ok(self.at(&self.theta(parameters)))
    }
}

impl ModelChange for ComOffset {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[Coordinate { scale: [3e-3, 0.15], bounds: [-1.0, 1.0] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(theta[0]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("offset_m".into(), theta[0])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        vec![parameters.get("offset_m").copied().unwrap_or(0.0)]
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::default() }
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.com_offset_m += self.0;
    }
}
