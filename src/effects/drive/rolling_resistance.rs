//! F_i = -(M g/2) [sgn(v_i) (c + a (|v_i| - 0.5 m/s) + d exp(-|v_i|/0.1 m/s)) + q₁ s₁(v_i) + q₂ s₂(v_i)]
//!
//! In all F = (1 - φ) (F_l + F_r) + 2 φ F(v), N = (1 - φ) b (F_r - F_l) - (t + p) (M g/2) b (sgn v_r - sgn v_l), φ = p/c. c is
//! the resistance; the rest is how real tyres depart from a constant: sgn turns over within 2 mm/s or, for the shares
//! s₁(v) = tanh(|v|/12 mm/s) - tanh(|v|/2 mm/s) and s₂ with 70 mm/s, softly; resistance rises with speed, and is larger near
//! standstill; it holds against turning more or less than two wheels would, and a part of it against the robot's way instead of
//! each wheel's. Of a drive it is all at the wheels or all against the robot's way: two forms, and one of them holds.

use super::change::Law;
use super::contract::{Coordinate, ModelChange, Needs};
#[cfg(test)]
use super::tried::Tried;
use crate::effects::about::{About, Parameter, Parameters};
use crate::model::drive::{DriveEffect, ForceFollows, Moving, Robot, Shape};
use crate::robot::Truth;

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
            meaning: "q₁, how much of c turns over softly near standstill",
            bounds: [-0.5, 0.5],
            null: Some(0.0),
            required: false,
        },
        Parameter {
            name: "softer_part",
            meaning: "q₂, how much of c turns over more softly",
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
    #[cfg(test)]
    const TRIED: Tried = Tried::motion(&[("coefficient", 0.02)]);
    const ABOUT: &'static About = &ABOUT;
}

/// Scales of c, q₁, q₂, of what holds against turning, of a and d.
const OWN: [Coordinate; 6] = [
    Coordinate { scale: [2e-3, 0.05], bounds: [-0.1, 0.5] },
    Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] },
    Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] },
    Coordinate { scale: [1e-3, 0.025], bounds: [-0.5, 0.5] },
    Coordinate { scale: [2e-4, 5e-3], bounds: [-0.1, 0.1] },
    Coordinate { scale: [6e-4, 0.015], bounds: [-0.5, 0.5] },
];
/// More on the right wheel and less on the left: that is one wheel's friction.
const DEPARTURE: Coordinate = Coordinate { scale: [2e-3, 0.05], bounds: [-0.5, 0.5] };

impl ModelChange for RollingResistance {
    fn coordinates(&self) -> &'static [Coordinate] {
        const { &[OWN[0], OWN[1], OWN[2], OWN[3], OWN[3], OWN[4], OWN[5]] }
    }

    fn departures(&self) -> &'static [Coordinate] {
        &[DEPARTURE]
    }

    fn sizes(&self) -> &'static str {
        "Wong, Theory of Ground Vehicles (2008), table 1.1: 0.01 on concrete to 0.05 on firm soil"
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        let [c, q1, q2, turning, body, rise, standstill, side] =
            std::array::from_fn(|i| theta.get(i).copied().unwrap_or(0.0));
        // where c is next to nothing its part is none of it
        let at_body = if c == 0.0 { 0.0 } else { (body / c).clamp(-1.0, 2.0) };
        Box::new(Work { c, soft: [q1, q2], turning: turning + body, rise, standstill, side, at_body })
    }

    fn forms(&self) -> &'static [&'static dyn ModelChange] {
        &[&Form::Wheels, &Form::Body]
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        NAMES.into_iter().map(String::from).zip(theta.iter().copied()).collect()
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        NAMES.map(|name| parameters.get(name).copied().unwrap_or(0.0)).to_vec()
    }

    fn positive(&self) -> usize {
        1
    }

    fn described(&self, parameters: &Parameters) -> Option<Truth> {
        let [coefficient, .., rise, _] = self.theta(parameters)[..] else { return None };
        Some(Truth::Resistance { coefficient, rise })
    }

    fn needs(&self) -> Needs {
        Needs { torques: true, ..Needs::NOTHING }
    }
}

/// Parameters in the order of the coordinates.
const NAMES: [&str; 7] =
    ["coefficient", "soft_part", "softer_part", "turning_part", "body_part", "rise_s_per_m", "standstill_part"];

/// Motion that the resistance opposes.
enum Form {
    /// That of each wheel.
    Wheels,
    /// That of the robot: dragged castors, a brush, a trailing cable.
    Body,
}

impl ModelChange for Form {
    fn coordinates(&self) -> &'static [Coordinate] {
        &OWN
    }

    fn departures(&self) -> &'static [Coordinate] {
        &[DEPARTURE]
    }

    fn at(&self, theta: &[f64]) -> Box<dyn DriveEffect> {
        let [c, q1, q2, turning, rise, standstill, side] =
            std::array::from_fn(|i| theta.get(i).copied().unwrap_or(0.0));
        let at_body = f64::from(u8::from(matches!(self, Self::Body)));
        Box::new(Work { c, soft: [q1, q2], turning, rise, standstill, side, at_body })
    }

    fn parameters(&self, theta: &[f64]) -> Parameters {
        let [c, q1, q2, turning, rise, standstill] = std::array::from_fn(|i| theta.get(i).copied().unwrap_or(0.0));
        let body = if matches!(self, Self::Body) { c } else { 0.0 };
        RollingResistance.parameters(&[c, q1, q2, turning - body, body, rise, standstill])
    }

    fn theta(&self, parameters: &Parameters) -> Vec<f64> {
        let all = RollingResistance.theta(parameters);
        vec![all[0], all[1], all[2], all[3] + all[4], all[5], all[6]]
    }

    fn positive(&self) -> usize {
        1
    }

    fn needs(&self) -> Needs {
        RollingResistance.needs()
    }
}

struct Work {
    c: f64,
    soft: [f64; 2],
    /// t + p: resistance against turning beyond that of the wheels, over half the weight.
    turning: f64,
    rise: f64,
    standstill: f64,
    side: f64,
    at_body: f64,
}

/// Speeds within which the sign turns over, m/s: a hard contact and softer ones.
const TURNS_M_S: [f64; 3] = [0.002, 0.012, 0.07];

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

/// Signs of left wheel, right wheel and robot, sharp and soft; how near each is to standstill, where that is `wanted`, as
/// the robot's sign is.
fn shape(robot: &Robot, at: &Moving, wanted: [bool; 2]) -> Shape {
    let sign = |v: f64| TURNS_M_S.map(|turn| saturating(v / turn));
    let [left, right] = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
    let near = |v: f64| if wanted[0] { (-v.abs() / REACH_M_S).exp() } else { 0.0 };
    let ([l0, l1, l2], [r0, r1, r2]) = (sign(left), sign(right));
    let ([v0, v1, v2], n) = if wanted[1] { (sign(at.speed_m_s), near(at.speed_m_s)) } else { ([0.0; 3], 0.0) };
    [l0, l1, l2, near(left), r0, r1, r2, near(right), v0, v1, v2, n]
}

impl Work {
    /// Resistance at speed `v` (m/s) over the load, with its sign, and that sign alone, softened as the resistance is.
    /// The array holds the sign of `v`, sharp, soft and softer, and the nearness to standstill.
    fn resists(&self, v: f64, [sharp, soft, softer, near]: [f64; 4]) -> [f64; 2] {
        let gentle = [soft - sharp, softer - sharp];
        let near = if self.standstill == 0.0 { 0.0 } else { self.standstill * near };
        let bent = (self.c + self.rise * (v.abs() - TYPICAL_M_S) + near) * sharp;
        // what holds against turning turns over as softly as the resistance itself
        let share = |q: f64| if self.c == 0.0 { 0.0 } else { (q / self.c).clamp(-1.0, 2.0) };
        let [one, two] = self.soft;
        [bent + one * gentle[0] + two * gentle[1], sharp + share(one) * gentle[0] + share(two) * gentle[1]]
    }
}

impl DriveEffect for Work {
    fn force(&self, robot: &Robot, at: &Moving) -> [f64; 2] {
        self.force_of(&shape(robot, at, [self.standstill != 0.0, self.at_body != 0.0]), robot, at)
    }

    fn shape(&self, robot: &Robot, at: &Moving) -> Shape {
        shape(robot, at, [true; 2])
    }

    fn force_of(&self, shape: &Shape, robot: &Robot, at: &Moving) -> [f64; 2] {
        let [left, right] = robot.ground_speeds_m_s(at.speed_m_s, at.yaw_rate_rad_s);
        let [l0, l1, l2, ln, r0, r1, r2, rn, v0, v1, v2, vn] = *shape;
        let l = self.resists(left, [l0, l1, l2, ln]);
        let r = self.resists(right, [r0, r1, r2, rn]);
        let at_wheels = 1.0 - self.at_body;
        let way = if self.at_body == 0.0 { 0.0 } else { self.resists(at.speed_m_s, [v0, v1, v2, vn])[0] };
        let load = robot.wheel_load_n();
        [
            -load * (at_wheels * (l[0] + r[0]) + 2.0 * self.at_body * way + self.side * (r[1] - l[1])),
            -load
                * robot.half_track_m
                * (at_wheels * (r[0] - l[0]) + self.turning * (r[1] - l[1]) + self.side * (r[1] + l[1])),
        ]
    }

    fn force_follows(&self) -> ForceFollows {
        ForceFollows { position: false, heading: false, speeds: true, accelerations: false }
    }

    fn pushes_alike(&self, one: &Robot, other: &Robot) -> bool {
        one.mass_kg == other.mass_kg && one.half_track_m == other.half_track_m
    }
}

#[cfg(test)]
mod tests {
    use super::super::by_id;
    use super::*;

    /// Force and moment of `law` at θ, turning about a wheel, reversing and straight on.
    fn pushes(work: &dyn DriveEffect) -> Vec<[f64; 2]> {
        let robot = Robot::small();
        let motions = [(0.02, 0.1), (-0.3, 0.4), (0.6, 0.0), (0.004, -0.01)];
        let one = |(speed_m_s, yaw_rate_rad_s): (f64, f64)| {
            let at = Moving { speed_m_s, yaw_rate_rad_s, ..Moving::default() };
            let force = work.force(&robot, &at);
            assert_eq!(force, work.force_of(&work.shape(&robot, &at), &robot, &at));
            force
        };
        motions.into_iter().map(one).collect()
    }

    #[test]
    fn each_form_is_simulated_as_it_was_fitted() {
        let theta = [0.03, 0.011, 0.007, 0.004, 0.002, -0.005];
        for form in RollingResistance.forms() {
            let parameters = form.parameters(&theta);
            let there = by_id("wheel.rolling_resistance").unwrap().simulated(&parameters, 60.0, 1).unwrap();
            for (fitted, simulated) in pushes(form.at(&theta).as_ref()).iter().zip(pushes(there.as_ref())) {
                let apart = (fitted[0] - simulated[0]).abs() + (fitted[1] - simulated[1]).abs();
                assert!(apart < 1e-12 * fitted[0].abs(), "{fitted:?} {simulated:?}");
            }
            let again = form.theta(&parameters);
            assert!(theta.iter().zip(&again).all(|(a, b)| (a - b).abs() < 1e-15), "{again:?}");
        }
    }

    #[test]
    fn what_acts_against_the_robots_way_does_not_hold_it_from_turning() {
        let robot = Robot::small();
        let at = Moving { speed_m_s: 0.3, yaw_rate_rad_s: 3.0, ..Moving::default() };
        let [wheels, body] = [Form::Wheels, Form::Body].map(|form| form.at(&[0.03]).force(&robot, &at));
        let weight = 2.0 * robot.wheel_load_n();
        // one wheel goes backwards: at the wheels it is a moment, and no force
        assert!(wheels[0].abs() < 1e-9 * weight && wheels[1] < 0.0, "{wheels:?}");
        assert!((body[0] / weight + 0.03).abs() < 1e-9 && body[1] == 0.0, "{body:?}");
    }
}
