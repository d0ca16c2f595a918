//! An effect as a change of what a robot's description says.

use super::contract::Driving;
use crate::effects::about::Parameters;
use crate::model::drive::Robot;
use crate::robot::Truth;

/// What is true of `robot` under the effect and not in its description; empty where descriptions have no such number.
#[must_use]
pub fn described(effect: &dyn Driving, parameters: &Parameters, robot: &Robot) -> Vec<Truth> {
    let Some(change) = effect.change() else { return Vec::new() };
    let mut real = *robot;
    change.at(&change.theta(parameters)).robot(&mut real);
    let over =
        |real: [f64; 2], described: [f64; 2]| (real != described).then(|| [0, 1].map(|i| real[i] / described[i]));
    let mass = real.mass_kg / robot.mass_kg - 1.0;
    let inertia = real.yaw_inertia_kg_m2 / robot.yaw_inertia_kg_m2 - 1.0;
    let ahead = real.com_offset_m - robot.com_offset_m;
    let track = real.half_track_m / robot.half_track_m;
    let constants = [
        over(real.radius_m, robot.radius_m).map(|[left, right]| Truth::Radius { left, right }),
        over(real.torque_gain, robot.torque_gain).map(|[left, right]| Truth::Torque { left, right }),
        (mass != 0.0 || inertia != 0.0).then_some(Truth::Load { mass, inertia }),
        (ahead != 0.0).then_some(Truth::Ahead(ahead)),
        (track != 1.0).then_some(Truth::Track(track)),
    ];
    constants.into_iter().flatten().chain(change.described(parameters)).collect()
}
