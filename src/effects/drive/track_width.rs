//! b = (1 + s) b_nominal

use super::change::{Constant, Law};
use crate::effects::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

/// Half track off nominal.
pub(super) struct TrackWidth;

impl Law for TrackWidth {
    const ITSELF: &'static Self = &TrackWidth;
    const ABOUT: &'static About = &About {
        id: "vehicle.track_width",
        title: "half track off nominal",
        equation: "b = (1 + s) b_nominal",
        source: "Borenstein and Feng (1996), E_b",
        channel: "wheels",
        deficient: "wheel kinematics: the half track differs from nominal",
        condition: None,
        parameters: &[Parameter {
            name: "relative",
            meaning: "s",
            bounds: [-0.5, 1.0],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Turn ten times on the spot and compare the turned angle with the wheels.",
    };
}

impl Constant for TrackWidth {
    const SCALE: [f64; 2] = [3e-3, 0.1];

    fn off_by(value: f64) -> Box<dyn DriveEffect> {
        Box::new(Work(value))
    }
}

struct Work(f64);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.half_track_m *= 1.0 + self.0;
    }
}
