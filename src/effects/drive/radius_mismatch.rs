//! r_r/r_l = 1 + ρ, (r_l + r_r)/2 = r

use super::change::{Constant, Law};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

/// Unequal wheel radii.
pub(super) struct RadiusMismatch;

impl Law for RadiusMismatch {
    const ITSELF: &'static Self = &RadiusMismatch;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("right_over_left_minus_one", 0.05)]);
    const ABOUT: &'static About = &About {
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
}

impl Constant for RadiusMismatch {
    const SCALE: [f64; 2] = [1e-3, 0.03];
    const SIZES: &'static str = "Borenstein and Feng (1996): rubber tyres of one robot differ by up to some percent";

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
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
