//! M = (1 + m) M_nominal,  Jc = (1 + j) Jc_nominal

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Robot};

static ABOUT: About = About {
    id: "vehicle.payload",
    title: "payload",
    equation: "M = (1 + m) M_nominal, Jc = (1 + j) Jc_nominal",
    source: "Gillespie (1992), chapter 1: mass and inertia of the loaded vehicle",
    channel: "torque",
    deficient: "equations of motion: mass and yaw inertia are larger",
    condition: Some("acceleration"),
    parameters: &[
        Parameter { name: "mass_relative", meaning: "m", bounds: [-0.5, 5.0], null: Some(0.0), required: true },
        Parameter {
            name: "inertia_relative",
            meaning: "j; as m where it is missing",
            bounds: [-0.5, 10.0],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Weigh the robot as it drives and enter mass and inertia.",
};

/// Payload.
pub(super) struct Payload;

impl Law for Payload {
    const ITSELF: &'static Self = &Payload;
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("mass_relative", 0.2)]);
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for Payload {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [0.01, 0.5], bounds: [-0.5, 5.0] },
            Coordinate { scale: [0.01, 0.5], bounds: [-0.5, 10.0] },
        ]
    }

    fn sizes(&self) -> &'static str {
        "data sheets: robots carry up to their own weight, Clearpath Husky A200 (2013) 75 kg on 50 kg"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1]]))
    }

    fn is_rigid(&self) -> bool {
        true
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        Parameters::from([("mass_relative".into(), theta[0]), ("inertia_relative".into(), theta[1])])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let value = |name: &str| parameters.get(name).copied();
        let mass = value("mass_relative").unwrap_or(0.0);
        vec![mass, value("inertia_relative").unwrap_or(mass)]
    }

    /// Mass and yaw inertia.
    fn positive(&self) -> usize {
        2
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::NOTHING }
    }
}

struct Work([f64; 2]);

impl DriveEffect for Work {
    fn robot(&self, robot: &mut Robot) {
        robot.mass_kg *= 1.0 + self.0[0];
        robot.yaw_inertia_kg_m2 *= 1.0 + self.0[1];
    }
}
