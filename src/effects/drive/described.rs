//! An effect as a change of what a robot's description says.

use super::contract::Driving;
use crate::effects::about::Parameters;
use crate::model::drive::Robot;
use crate::robot::Truth;

/// Sizes of `robot` under the effect that its description has not; empty where descriptions have no such number.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::drive::{by_id, ids};

    fn of(id: &str, parameters: &[(&str, f64)]) -> Vec<Truth> {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_string(), *value)).collect();
        described(by_id(id).unwrap(), &parameters, &Robot::small())
    }

    #[test]
    fn constants_of_the_robot_are_in_its_description_and_delays_are_not() {
        let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-12, "{found} for {wanted}");
        let [Truth::Load { mass, inertia }] =
            of(ids::payload(), &[("mass_relative", 0.2), ("inertia_relative", 0.3)])[..]
        else {
            panic!("a payload is a load")
        };
        near(mass, 0.2);
        near(inertia, 0.3);
        let [Truth::Radius { left, right }] = of(ids::radius_right(), &[("relative", -0.02)])[..] else {
            panic!("a radius is a radius")
        };
        near(left, 1.0);
        near(right, 0.98);
        let [Truth::Track(over)] = of(ids::track_width(), &[("relative", 0.05)])[..] else {
            panic!("a track is a track")
        };
        near(over, 1.05);
        assert_eq!(of(ids::gyro_delay(), &[("delay_s", 0.03)]), []);
        assert_eq!(of(ids::pose_noise(), &[("noise_over_nominal", 2.0)]), []);
    }
}
