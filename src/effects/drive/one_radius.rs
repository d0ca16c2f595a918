//! r_i = (1 + s) r_nominal of one wheel, the other's is nominal

use super::change::{Constant, Law};
use super::contract::{Equivalent, Needs};
use super::equivalent::{Map, Within};
use super::missed_ticks::MissedTicks;
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

const PARAMETERS: &[Parameter] =
    &[Parameter { name: "relative", meaning: "s", bounds: [-0.5, 0.5], null: Some(0.0), required: true }];
const SOURCE: &str = "Borenstein and Feng, Measurement and correction of systematic odometry errors in mobile robots (1996): \
                      one tyre under pressure, or worn";
const SIZES: &str = "Borenstein and Feng (1996): rubber tyres of one robot differ by up to some percent";
const REMEDY: &str = "Measure that wheel's circumference under load, fill or change its tyre, and enter its radius.";

/// The left wheel's radius off nominal.
pub(super) struct RadiusLeft;

impl Law for RadiusLeft {
    const ITSELF: &'static Self = &RadiusLeft;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("relative", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "wheel.radius_left",
        title: "left wheel's radius off nominal",
        equation: "r_l = (1 + s) r_nominal, r_r is nominal",
        source: SOURCE,
        channel: "wheels",
        deficient: "wheel kinematics: the left wheel's radius differs from nominal",
        condition: None,
        parameters: PARAMETERS,
        remedy: REMEDY,
    };
}

impl Constant for RadiusLeft {
    const SCALE: [f64; 2] = [1e-3, 0.03];
    const SIZES: &'static str = SIZES;
    const NEEDS: Needs = Needs { length: true, ..Needs::NOTHING };
    const EQUIVALENTS: &'static [Equivalent] =
        &[Equivalent { effect: &MissedTicks, map: Map::Loss, side: 0, within: Within::NoTorques }];

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work { side: 0, by: value })
    }
}

/// The right wheel's radius off nominal.
pub(super) struct RadiusRight;

impl Law for RadiusRight {
    const ITSELF: &'static Self = &RadiusRight;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("relative", 0.03)]);
    const ABOUT: &'static About = &About {
        id: "wheel.radius_right",
        title: "right wheel's radius off nominal",
        equation: "r_r = (1 + s) r_nominal, r_l is nominal",
        source: SOURCE,
        channel: "wheels",
        deficient: "wheel kinematics: the right wheel's radius differs from nominal",
        condition: None,
        parameters: PARAMETERS,
        remedy: REMEDY,
    };
}

impl Constant for RadiusRight {
    const SCALE: [f64; 2] = [1e-3, 0.03];
    const SIZES: &'static str = SIZES;
    const NEEDS: Needs = Needs { length: true, ..Needs::NOTHING };
    const EQUIVALENTS: &'static [Equivalent] =
        &[Equivalent { effect: &MissedTicks, map: Map::Loss, side: 1, within: Within::NoTorques }];

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work { side: 1, by: value })
    }
}

struct Work {
    side: usize,
    by: f64,
}

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.radius_m[self.side] *= 1.0 + self.by;
    }
}
