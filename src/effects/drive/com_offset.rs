//! M (dv/dt - d ω²) = F,  (Jc + M d²) dω/dt + M d v ω = moment

use super::change::{Constant, Law};
use super::contract::Needs;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

/// Centre of mass off the axle.
pub(super) struct ComOffset;

impl Law for ComOffset {
    const ITSELF: &'static Self = &ComOffset;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("offset_m", 0.05)]);
    const ABOUT: &'static About = &About {
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
}

impl Constant for ComOffset {
    const SCALE: [f64; 2] = [3e-3, 0.15];
    const SIZES: &'static str = "Fierro and Lewis (1997): some centimetres up to the radius of a wheel";
    const NEEDS: Needs = Needs { torques: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.com_offset_m += self.0;
    }
}
