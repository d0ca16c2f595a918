//! Ids of effects of drives for the tests of other modules, each as its effect states it.

use super::Driving;
use crate::effects::ids::ids;

ids! {
    bias_step: super::bias_step::BiasStep,
    gyro_delay: super::gyro_delay::GyroDelay,
    gyro_noise: super::noise_level::GYRO,
    missed_ticks: super::missed_ticks::MissedTicks,
    payload: super::payload::Payload,
    pose_noise: super::noise_level::POSE,
    radius_right: super::one_radius::RadiusRight,
    radius_scale: super::radius_scale::RadiusScale,
    scale_asymmetry: super::scale_asymmetry::ScaleAsymmetry,
    scale_factor: super::scale_factor::ScaleFactor,
    slip: super::slip::Slip,
    track_width: super::track_width::TrackWidth,
    wheel_delay: super::wheel_delay::WheelDelay,
    wheel_noise: super::noise_level::WHEELS,
}
