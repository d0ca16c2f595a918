//! The driving effects by id.

use super::effect::Effect;
use super::machine::Machine;
use super::{listed, unlisted};
use crate::bench::worlds::bias::Step;
use crate::bench::worlds::catalogue::draw as draw_at_rest;
use crate::math::random::Stream;

/// Effects of a driving robot that have a name in the contract.
pub(crate) const LISTED: [&str; 24] = [
    "wheel.slip",
    "wheel.radius_mismatch",
    "wheel.radius_scale",
    "wheel.radius_left",
    "wheel.radius_right",
    "wheel.rolling_resistance",
    "wheel.lateral_skid",
    "vehicle.track_width",
    "vehicle.payload",
    "vehicle.com_offset",
    "motor.torque_gain",
    "encoder.quantization",
    "encoder.missed_ticks",
    "encoder.noise_level",
    "gyro.noise_level",
    "gyro.scale_factor",
    "gyro.scale_asymmetry",
    "gyro.vibration_rectification",
    "gyro.bias_step",
    "pose.noise_level",
    "sensor.gyro_delay",
    "sensor.wheel_delay",
    "sensor.pose_delay",
    "ground.slope",
];

/// Effects that are in no list.
pub(crate) const UNLISTED: [&str; 20] = [
    "x.gyro_g_sensitivity",
    "x.gyro_heading_error",
    "x.gyro_noise_with_speed",
    "x.torque_dead_band",
    "x.torque_saturation",
    "x.motor_lag",
    "x.battery_sag",
    "x.eccentric_wheel",
    "x.radius_with_speed",
    "x.tyre_heating",
    "x.encoder_low_pass",
    "x.encoder_noise_with_speed",
    "x.quadratic_drag",
    "x.rubbing_wheel",
    "x.load_falls_off",
    "x.caster_kick",
    "x.pose_clock_drift",
    "x.pose_scale",
    "x.pose_lever_arm",
    "x.pose_outliers",
];

/// Effects that real robots commonly have in small amounts; the last are a gyro's own.
pub(crate) const COMMON: [&str; 18] = [
    "wheel.radius_mismatch",
    "wheel.radius_scale",
    "wheel.rolling_resistance",
    "wheel.lateral_skid",
    "vehicle.track_width",
    "vehicle.payload",
    "vehicle.com_offset",
    "motor.torque_gain",
    "gyro.scale_factor",
    "gyro.scale_asymmetry",
    "gyro.vibration_rectification",
    "gyro.bias_step",
    "sensor.gyro_delay",
    "ground.slope",
    "gyro.rate_random_walk",
    "gyro.gauss_markov",
    "gyro.tone",
    "gyro.outliers",
];

/// One effect `id` of `machine`, its form drawn from `s`; none for an id that is in no list.
pub(super) fn draw(id: &str, machine: &Machine, s: &mut Stream) -> Option<Effect> {
    Some(match id {
        "wheel.slip" => listed::slip(s),
        "wheel.radius_mismatch" => listed::radius_mismatch(s),
        "wheel.radius_scale" => listed::radius_scale(s),
        "wheel.radius_left" => listed::one_radius(0, s),
        "wheel.radius_right" => listed::one_radius(1, s),
        "wheel.rolling_resistance" => listed::rolling_resistance(s),
        "wheel.lateral_skid" => listed::lateral_skid(s),
        "vehicle.track_width" => listed::track_width(machine, s),
        "vehicle.payload" => listed::payload(s),
        "vehicle.com_offset" => listed::com_offset(s),
        "motor.torque_gain" => listed::torque_gain(s),
        "encoder.quantization" => listed::encoder_quantization(s),
        "encoder.missed_ticks" => listed::missed_ticks(s),
        "encoder.noise_level" => listed::encoder_noise(machine, s),
        "gyro.noise_level" => listed::gyro_noise(machine, s),
        "pose.noise_level" => listed::pose_noise(machine, s),
        "gyro.scale_factor" => listed::scale_factor(s),
        "gyro.scale_asymmetry" => listed::scale_asymmetry(s),
        "gyro.vibration_rectification" => listed::vibration_rectification(s),
        "gyro.bias_step" => Effect::at_rest(Box::new(Step::draw(s)), machine),
        "sensor.gyro_delay" => listed::gyro_delay(s),
        "sensor.wheel_delay" => listed::wheel_delay(s),
        "sensor.pose_delay" => listed::pose_delay(s),
        "ground.slope" => listed::ground_slope(s),
        "gyro.rate_random_walk" | "gyro.gauss_markov" | "gyro.tone" | "gyro.outliers" => {
            Effect::at_rest(draw_at_rest(id, &machine.gyro, s)?, machine)
        }
        "x.gyro_g_sensitivity" => unlisted::g_sensitivity(s),
        "x.gyro_heading_error" => unlisted::heading_error(s),
        "x.gyro_noise_with_speed" => unlisted::gyro_rattle(s),
        "x.torque_dead_band" => unlisted::dead_band(machine, s),
        "x.torque_saturation" => unlisted::torque_saturation(machine, s),
        "x.motor_lag" => unlisted::motor_lag(s),
        "x.battery_sag" => unlisted::battery_sag(s),
        "x.eccentric_wheel" => unlisted::eccentric_wheel(s),
        "x.radius_with_speed" => unlisted::radius_growth(s),
        "x.tyre_heating" => unlisted::tyre_heating(s),
        "x.encoder_low_pass" => unlisted::encoder_low_pass(s),
        "x.encoder_noise_with_speed" => unlisted::encoder_rattle(s),
        "x.quadratic_drag" => unlisted::drag(machine, s),
        "x.rubbing_wheel" => unlisted::rubbing_wheel(machine, s),
        "x.load_falls_off" => unlisted::falling_load(s),
        "x.caster_kick" => unlisted::caster_kick(machine, s),
        "x.pose_clock_drift" => unlisted::clock_drift(s),
        "x.pose_scale" => unlisted::pose_scale(s),
        "x.pose_lever_arm" => unlisted::lever_arm(s),
        "x.pose_outliers" => unlisted::pose_outliers(s),
        _ => return None,
    })
}
