//! r_l, r_r: both (1 + s) times their nominal value

use super::change::{Constant, Law};
use super::contract::Needs;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

/// Wheel radius off nominal.
pub(super) struct RadiusScale;

impl Law for RadiusScale {
    const ITSELF: &'static Self = &RadiusScale;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("relative", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "wheel.radius_scale",
        title: "wheel radius off nominal",
        equation: "r = (1 + s) r_nominal of both wheels",
        source: "Borenstein and Feng (1996), E_s",
        channel: "wheels",
        deficient: "wheel kinematics: both radii differ from nominal",
        condition: None,
        parameters: &[Parameter {
            name: "relative",
            meaning: "s",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Measure the distance of a straight drive of ten metres against the wheel turns.",
    };
}

impl Constant for RadiusScale {
    const SCALE: [f64; 2] = [2e-3, 0.05];
    const SIZES: &'static str = "Borenstein and Feng (1996): load and wear change rubber tyres by some percent";
    const NEEDS: Needs = Needs { length: true, ..Needs::NOTHING };

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.radius_m = robot.radius_m.map(|r| r * (1.0 + self.0));
    }
}
