//! b = (1 + s) b_nominal

use super::change::{Constant, Law};
use super::contract::Coordinate;
#[cfg(test)]
use super::tried::Tried;
use crate::config::Steering;
use crate::effects::about::{About, Parameter};
use crate::model::drive::{DriveEffect, Robot};

/// Half track off nominal.
pub(super) struct TrackWidth;

impl Law for TrackWidth {
    const ITSELF: &'static Self = &TrackWidth;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("relative", 0.03)]);
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
            bounds: [-0.5, 1.5],
            null: Some(0.0),
            required: true,
        }],
        remedy: "Turn ten times on the spot and compare the turned angle with the wheels.",
    };
}

impl Constant for TrackWidth {
    const SCALE: [f64; 2] = [3e-3, 0.5];
    const SIZES: &'static str = "Borenstein and Feng (1996): the contact of a rolling wheel is known to some percent; Mandow et al., \
                                 Experimental kinematics for wheeled skid-steer mobile robots (2007): skidding ones turn as on a track \
                                 1.2 to 2 times as wide";

    fn steered(steering: Option<Steering>) -> Option<&'static [Coordinate]> {
        const BOUNDS: [f64; 2] = TrackWidth::ABOUT.parameters[0].bounds;
        const ROLLS: &[Coordinate] = &[Coordinate { scale: [3e-3, 0.05], bounds: BOUNDS }];
        const SKIDS: &[Coordinate] = &[Coordinate { scale: [0.05, 0.5], bounds: BOUNDS }];
        steering.map(|steering| match steering {
            Steering::Differential => ROLLS,
            Steering::Skid => SKIDS,
        })
    }

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
