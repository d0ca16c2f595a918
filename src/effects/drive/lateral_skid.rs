//! s = -[k + q (|v ω| - 0.4 m/s²)] v ω + p d(v ω)/dt

use super::change::{Law, TIMED_ROWS};
use super::contract::{Coordinate, ModelChange, Needs, Touches};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, Moving};

const SLIP: &str = "lateral_slip_s";
const BEND: &str = "bend_s3_per_m";
const LATE: &str = "late_part_s2";
/// Where the bend changes nothing: k is what the robot does in its usual turns, m/s².
const TYPICAL_M_S2: f64 = 0.4;

static ABOUT: About = About {
    id: "wheel.lateral_skid",
    title: "sideways skid in turns",
    equation: "s = -[k + q (|v ω| - 0.4 m/s²)] v ω + p d(v ω)/dt: the robot slides outwards in turns, more or less than in \
               proportion, and a little late",
    source: "Martínez et al., Approximating kinematics for tracked mobile robots (2005)",
    channel: "pose",
    deficient: "kinematics: the robot moves sideways in turns",
    condition: None,
    parameters: &[
        Parameter { name: SLIP, meaning: "k, s", bounds: [-2.0, 2.0], null: Some(0.0), required: true },
        Parameter {
            name: BEND,
            meaning: "q, how the slide departs from proportion, s³/m",
            bounds: [-2.0, 2.0],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: LATE,
            meaning: "p, k times the time by which the slide is late, s²",
            bounds: [-1.0, 1.0],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Lower the speed in turns, or give the filter a sideways velocity.",
};

/// Sideways skid in turns.
pub(super) struct LateralSkid;

impl Law for LateralSkid {
    const ITSELF: &'static Self = &LateralSkid;
    #[cfg(test)]
    const TRIED: Tried =
        Tried { moves: [false, false, false, true, false], ..Tried::motion(&[("lateral_slip_s", 0.05)]) };
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for LateralSkid {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [2e-3, 0.2], bounds: [-2.0, 2.0] },
            Coordinate { scale: [6e-4, 0.06], bounds: [-2.0, 2.0] },
            Coordinate { scale: [4e-4, 0.04], bounds: [-1.0, 1.0] },
        ]
    }

    fn unbent(&self) -> usize {
        1
    }

    fn sizes(&self) -> &'static str {
        "Martínez et al. (2005): up to some tenths of what turning asks for"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work([theta[0], theta[1], theta[2]]))
    }

    fn touches(&self) -> Touches {
        Touches::MOTION
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        [SLIP, BEND, LATE].into_iter().map(String::from).zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        [SLIP, BEND, LATE].map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn usual_std(&self, sample_time_s: f64) -> f64 {
        TIMED_ROWS * sample_time_s
    }

    fn needs(&self) -> Needs {
        Needs { pose: true, ..Needs::NOTHING }
    }
}

struct Work([f64; 3]);

impl DriveEffect for Work {
    fn sideways_m_s(&self, at: &Moving) -> f64 {
        let [slip, bend, late] = self.0;
        let (v, w) = (at.speed_m_s, at.yaw_rate_rad_s);
        let changes = at.acceleration_m_s2 * w + v * at.yaw_acceleration_rad_s2;
        late * changes - (slip + bend * ((v * w).abs() - TYPICAL_M_S2)) * v * w
    }
}
