//! Effects that are in no list, as real robots have them: a diagnosis should say 'unknown'.

use super::effect::{Effect, Need, Shows};
use super::machine::Machine;
use crate::bench::worlds::draw::{between, chance, index, log_between, sign};
use crate::math::random::Stream;
use std::f64::consts::PI;

/// The gyro feels forward acceleration.
pub(super) fn g_sensitivity(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("x.gyro_g_sensitivity", "gyro", Need::Gyro, [2e-3, 0.3])
        .following("acceleration")
        .sets(move |a, world, _, _| world.gyro.g_sensitivity_s_m = side * a)
}

/// The gyro's bias turns with the heading, once or twice a turn, as in a magnetic field.
pub(super) fn heading_error(s: &mut Stream) -> Effect {
    let (times, phase) = (1.0 + index(s, 2) as f64, between(s, 0.0, 2.0 * PI));
    Effect::new("x.gyro_heading_error", "gyro", Need::Gyro, [1e-3, 0.2])
        .following("heading")
        .sets(move |a, world, _, _| world.gyro.heading_error = [a, times, phase])
}

/// The gyro gets louder with speed.
pub(super) fn gyro_rattle(_: &mut Stream) -> Effect {
    Effect::new("x.gyro_noise_with_speed", "gyro", Need::Gyro, [0.1, 8.0])
        .following("speed")
        .shows(Shows::Noise)
        .sets(|a, world, _, _| world.gyro.noise_growth_s_m = a)
}

/// Small torques do not arrive.
pub(super) fn dead_band(machine: &Machine, _: &mut Stream) -> Effect {
    let most = machine.driver.limit_n_m;
    Effect::new("x.torque_dead_band", "torque", Need::Torque, [0.01 * most, 0.3 * most])
        .following("torque")
        .sets(|a, world, _, _| world.motors.dead_band_n_m = a)
}

/// Large torques do not arrive whole: strength is the share of the commanded limit that is cut.
pub(super) fn torque_saturation(machine: &Machine, _: &mut Stream) -> Effect {
    let most = machine.driver.limit_n_m;
    Effect::new("x.torque_saturation", "torque", Need::Torque, [0.2, 0.9])
        .following("torque")
        .sets(move |a, world, _, _| world.motors.limit_n_m = most * (1.0 - a))
}

/// Motors take their time.
pub(super) fn motor_lag(_: &mut Stream) -> Effect {
    Effect::new("x.motor_lag", "torque", Need::Torque, [0.01, 0.25])
        .following("torque")
        .sets(|a, world, _, _| world.motors.lag_s = a)
}

/// The battery empties, and with it the torque.
pub(super) fn battery_sag(s: &mut Stream) -> Effect {
    let bend = between(s, 0.6, 1.8);
    Effect::new("x.battery_sag", "torque", Need::Torque, [0.03, 0.7])
        .following("elapsed_time")
        .sets(move |a, world, _, _| (world.motors.sag, world.motors.sag_bend) = (a, bend))
}

/// One wheel is not round.
pub(super) fn eccentric_wheel(s: &mut Stream) -> Effect {
    let (wheel, phase) = (index(s, 2), between(s, 0.0, 2.0 * PI));
    Effect::new("x.eccentric_wheel", ["wheel_left", "wheel_right"][wheel], Need::Anything, [0.005, 0.25])
        .following("wheel_angle")
        .sets(move |a, world, _, _| world.wheels.eccentric = (a != 0.0).then_some((wheel, a, phase)))
}

/// Wheels grow with speed.
pub(super) fn radius_growth(s: &mut Stream) -> Effect {
    let side = if chance(s, 0.7) { 1.0 } else { -1.0 };
    Effect::new("x.radius_with_speed", "wheels", Need::Anything, [0.005, 0.2])
        .following("speed")
        .sets(move |a, world, _, _| world.wheels.growth_s_m = side * a)
}

/// Tyres warm, and grow.
pub(super) fn tyre_heating(s: &mut Stream) -> Effect {
    let share = log_between(s, 0.2, 1.5);
    Effect::new("x.tyre_heating", "wheels", Need::Anything, [0.004, 0.15]).following("elapsed_time").sets(
        move |a, world, scene, _| {
            world.wheels.heating = a;
            world.wheels.heating_s = share * scene.run.course.len() as f64 * scene.machine.step_s;
        },
    )
}

/// Encoders smooth.
pub(super) fn encoder_low_pass(_: &mut Stream) -> Effect {
    Effect::new("x.encoder_low_pass", "wheels", Need::Anything, [0.01, 0.25])
        .following("acceleration")
        .sets(|a, world, _, _| world.encoders.lag_s = a)
}

/// Encoders get louder with speed.
pub(super) fn encoder_rattle(_: &mut Stream) -> Effect {
    Effect::new("x.encoder_noise_with_speed", "wheels", Need::Anything, [0.02, 1.5])
        .following("speed")
        .shows(Shows::Noise)
        .sets(|a, world, _, _| world.encoders.noise_growth_s = a)
}

/// Air, or grass: a force with the square of the speed.
pub(super) fn drag(machine: &Machine, _: &mut Stream) -> Effect {
    let mass = machine.vehicle.mass_kg;
    Effect::new("x.quadratic_drag", "torque", Need::Torque, [0.02 * mass, 0.8 * mass])
        .following("speed")
        .sets(|a, world, _, _| world.body.drag_kg_m = a)
}

/// One wheel rubs more than the other.
pub(super) fn rubbing_wheel(machine: &Machine, s: &mut Stream) -> Effect {
    let most = machine.driver.limit_n_m;
    let (wheel, other) = (index(s, 2), between(s, 0.0, 0.25));
    Effect::new("x.rubbing_wheel", "torque", Need::Torque, [0.01 * most, 0.4 * most]).following("speed").sets(
        move |a, world, _, _| {
            world.body.coulomb_n_m[wheel] = a;
            world.body.coulomb_n_m[1 - wheel] = other * a;
        },
    )
}

/// A load falls off.
pub(super) fn falling_load(_: &mut Stream) -> Effect {
    Effect::new("x.load_falls_off", "torque", Need::Torque, [0.05, 0.6]).following("elapsed_time").sets(
        |a, world, scene, s| {
            let span_s = scene.run.course.len() as f64 * scene.machine.step_s;
            world.body.load_falls = Some([between(s, 0.2, 0.8) * span_s, a]);
        },
    )
}

/// Casters kick after a reversal.
pub(super) fn caster_kick(machine: &Machine, s: &mut Stream) -> Effect {
    let (side, way_m) = (sign(s), log_between(s, 0.03, 0.25));
    let yaw = machine.vehicle.yaw_inertia_kg_m2;
    Effect::new("x.caster_kick", "torque", Need::Torque, [0.3 * yaw, 8.0 * yaw])
        .following("speed")
        .sets(move |a, world, _, _| (world.body.caster_n_m, world.body.caster_way_m) = (side * a, way_m))
}

/// The reference's clock runs otherwise.
pub(super) fn clock_drift(_: &mut Stream) -> Effect {
    Effect::new("x.pose_clock_drift", "pose", Need::Pose, [1e-4, 1.5e-3])
        .following("elapsed_time")
        .sets(|a, world, _, _| world.pose.drift = a)
}

/// The reference's metre is another.
pub(super) fn pose_scale(s: &mut Stream) -> Effect {
    let side = sign(s);
    Effect::new("x.pose_scale", "pose", Need::Pose, [0.004, 0.3])
        .following("speed")
        .sets(move |a, world, _, _| world.pose.scale = 1.0 + side * a)
}

/// The reference sees a point beside the axle's middle.
pub(super) fn lever_arm(s: &mut Stream) -> Effect {
    let angle = between(s, -PI, PI);
    Effect::new("x.pose_lever_arm", "pose", Need::Pose, [0.01, 0.5])
        .following("heading")
        .sets(move |a, world, _, _| world.pose.lever_m = [a * angle.cos(), a * angle.sin()])
}

/// The reference is off now and then.
pub(super) fn pose_outliers(s: &mut Stream) -> Effect {
    let share = log_between(s, 0.003, 0.05);
    Effect::new("x.pose_outliers", "pose", Need::Pose, [5.0, 400.0])
        .shows(Shows::Rare)
        .sets(move |a, world, _, _| (world.pose.outliers, world.pose.outlier_size) = (share, a))
}
