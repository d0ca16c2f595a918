//! Hypotheses about the recording itself: clocks, offsets, lost ticks, outliers, noise levels, and motion without torques.

pub(crate) mod acceleration_model;
pub(crate) mod changepoint;
pub(crate) mod clocks;
pub(crate) mod heteroscedastic;
pub(crate) mod hypothesis;
pub(crate) mod initial_noise;
pub(crate) mod lag;
pub(crate) mod level;
pub(crate) mod lost_ticks;
pub(crate) mod noise_levels;
pub(crate) mod offset;
pub(crate) mod outliers;
pub(crate) mod pace;
pub(crate) mod reference_extrinsics;
pub(crate) mod restored;
pub(crate) mod sensor_offset;
pub(crate) mod settle;
pub(crate) mod start_heading;
pub(crate) mod torque_bandwidth;
pub(crate) mod wander;
pub(crate) mod wheel_offset;
