//! F_i = -(M g/2) sgn(v_i) [c + q s(v_i) + a (|v_i| - 0.5 m/s) + d exp(-|v_i|/0.1 m/s)]
//!
//! In all F = F_l + F_r + p (M g/2) (sgn v_l + sgn v_r - 2 sgn v), N = b (F_r - F_l) - t (M g/2) b (sgn v_r - sgn v_l). c is the
//! resistance; the rest is how real tyres depart from a constant: sgn turns over within 2 mm/s or, for the share
//! s(v) = tanh(|v|/20 mm/s) - tanh(|v|/2 mm/s), softly; resistance rises with speed, and is larger near standstill; it holds
//! against turning more or less than two wheels would, and a part of it against the robot's way instead of each wheel's.

use super::change::Law;
use super::{Coordinate, ModelChange, Needs};
use crate::effects::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, ForceFollows, Moving, Robot, Shape};

static ABOUT: About = About {
    id: "wheel.rolling_resistance",
    title: "rolling resistance",
    equation: "F_i = -(M g/2) sgn(v_i) [c + a (|v_i| - 0.5 m/s) + d exp(-|v_i|/0.1 m/s)] at each wheel",
    source: "Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 4",
    channel: "torque",
    deficient: "equations of motion: a constant force against rolling",
    condition: Some("speed"),
    parameters: &[
        Parameter {
            name: "coefficient",
            meaning: "c, force over weight",
            bounds: [-0.1, 0.5],
            null: Some(0.0),
            required: true,
        },
        Parameter {
            name: "soft_part",
            meaning: "q, how much of c turns over softly near standstill",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "turning_part",
            meaning: "t, how much more than c holds against turning",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "body_part",
            meaning: "p, how much of c holds against the robot's way instead of each wheel's",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "rise_s_per_m",
            meaning: "a, how it grows with speed, s/m",
            bounds: [-0.1, 0.1],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "standstill_part",
            meaning: "d, what adds to it near standstill",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
    ],
    remedy: "Let the robot coast to a stop and enter the deceleration over g.",
};

/// Rolling resistance.
pub(super) struct RollingResistance;

impl Law for RollingResistance {
    const ITSELF: &'static Self = &RollingResistance;
    const ABOUT: &'static About = &ABOUT;
}

impl ModelChange for RollingResistance {
    fn coordinates(&self) -> &'static [Coordinate] {
        &[
            Coordinate { scale: [2e-3, 0.05], bounds: [-0.1, 0.5] },
            Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] },
            Coordinate { scale: [1e-3, 0.025], bounds: [-0.5, 0.5] },
            Coordinate { scale: [1e-3, 0.025], bounds: [-0.5, 0.5] },
            Coordinate { scale: [2e-4, 5e-3], bounds: [-0.1, 0.1] },
            Coordinate { scale: [6e-4, 0.015], bounds: [-0.5, 0.5] },
        ]
    }

    fn departures(&self) -> &'static [Coordinate] {
        // more on the right wheel and less on the left: that is one wheel's friction
        &[Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] }]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        Box::new(Work(std::array::from_fn(|i| theta.get(i).copied().unwrap_or(0.0))))
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        NAMES.into_iter().map(String::from).zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        NAMES.map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::NOTHING }
    }
}

/// Parameters in the order of the coordinates.
const NAMES: [&str; 6] = ["coefficient", "soft_part", "turning_part", "body_part", "rise_s_per_m", "standstill_part"];

struct Work([f64; 7]);

/// Speeds within which the sign turns over, m/s: a hard contact and a soft one.
const TURNS_M_S: [f64; 2] = [0.002, 0.02];

/// Speed at which the rise changes nothing: c is what the robot feels where it mostly drives, m/s.
const TYPICAL_M_S: f64 = 0.5;
/// How far from standstill its part reaches, m/s.
const REACH_M_S: f64 = 0.1;

/// tanh x to 1e-16 absolutely, in a third of the time: the filter takes it at every step of every model.
fn saturating(x: f64) -> f64 {
    if x.abs() > 19.0 {
        return x.signum();
    }
    let t = (-2.0 * x.abs()).exp();
    ((1.0 - t) / (1.0 + t)).copysign(x)
}

/// Signs of left wheel, right wheel and robot, sharp and soft; how near the wheels are to standstill, where that is `wanted`,
/// as the robot's sign is.
fn shape(robot: &Robot, at: &Moving, wanted: [bool; 2]) -> Shape {
    let sign = |v: f64| TURNS_M_S.map(|turn| saturating(v / turn));
    let [left, right] = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
    let near = |v: f64| if wanted[0] { (-v.abs() / REACH_M_S).exp() } else { 0.0 };
    let ([l0, l1], [r0, r1]) = (sign(left), sign(right));
    let [v0, v1] = if wanted[1] { sign(at.speed_m_s) } else { [0.0; 2] };
    [l0, l1, r0, r1, v0, v1, near(left), near(right)]
}

impl DriveEffect for Work {
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        let [_, _, _, body, _, standstill, _] = self.0;
        self.force_of(&shape(robot, at, [standstill != 0.0, body != 0.0]), robot, at)
    }

    fn shape(&self, robot: &Robot, at: &Moving) -> Shape {
        shape(robot, at, [true; 2])
    }

    fn force_of(&self, shape: &Shape, robot: &Robot, at: &Moving) -> [f64; 2] {
        let [hard, soft, turning, body, rise, standstill, side] = self.0;
        // t and p turn over as softly as the resistance itself
        let softness = if hard == 0.0 { 0.0 } else { (soft / hard).clamp(-0.5, 1.0) };
        let [left, right] = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
        // of each wheel over its load: what resists, and the sign it does it with
        let of = |v: f64, sharp: f64, slow: f64, near: f64| {
            let gentle = slow - sharp;
            let near = if standstill == 0.0 { 0.0 } else { standstill * near };
            let resists = (hard + rise * (v.abs() - TYPICAL_M_S) + near) * sharp + soft * gentle;
            [resists, sharp + softness * gentle]
        };
        let l = of(left, shape[0], shape[1], shape[6]);
        let r = of(right, shape[2], shape[3], shape[7]);
        let load = robot.wheel_load_n();
        let instead = if body == 0.0 {
            0.0
        } else {
            let (sharp, gentle) = (shape[4], shape[5] - shape[4]);
            2.0 * body * (sharp + softness * gentle)
        };
        [
            -load * (l[0] + r[0] - body * (l[1] + r[1]) + instead + side * (r[1] - l[1])),
            -load * robot.half_track_m * (r[0] - l[0] + turning * (r[1] - l[1]) + side * (r[1] + l[1])),
        ]
    }

    fn force_follows(&self) -> ForceFollows {
        ForceFollows { heading: false, speeds: true, accelerations: false }
    }

    fn pushes_alike(&self, one: &Robot, other: &Robot) -> bool {
        one.mass_kg == other.mass_kg && one.half_track_m == other.half_track_m
    }
}
