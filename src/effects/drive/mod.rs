//! Effects of reality on a drive. One file an effect, one line in [`registry()`].
//!
//! An effect is defined once, as a change of the robot's equations ([`DriveEffect`](crate::model::drive::DriveEffect)):
//! the simulator integrates it, the filter predicts with it, and its derivatives with respect to its coordinates are what the
//! likelihood is fitted by.
//! How one is added, [`crate::effects`] tells. What the diagnosis must know of an effect, the effect says: that it delays an
//! instrument ([`Driving::delays`]), loses ticks ([`Driving::tick_loss`]), looks like a late gyro
//! ([`ModelChange::like_late_gyro`]), equals another effect ([`ModelChange::equivalents`]).

mod bias_step;
mod change;
mod com_offset;
mod contract;
mod described;
mod encoder_quantization;
mod equivalent;
mod gyro_delay;
#[cfg(test)]
pub(crate) mod ids;
mod lateral_skid;
mod loss;
mod missed_ticks;
mod noise_level;
mod on_log;
mod one_radius;
mod payload;
mod pose_delay;
mod radius_mismatch;
mod radius_scale;
mod rolling_resistance;
mod scale_asymmetry;
mod scale_factor;
mod slip;
mod slope;
mod torque_gain;
mod track_width;
#[cfg(test)]
mod tried;
mod vibration_rectification;
mod wheel_delay;

pub use contract::{Coordinate, DriveExplanation, Driving, Equivalent, ModelChange, Needs, TickLoss, Touches};
pub use described::described;
pub use equivalent::{Map, Within};
pub use loss::Lost;
pub use on_log::{OnLog, Stage};
#[cfg(test)]
pub(super) use tried::Tried;

use super::about::About;
use crate::model::drive::Instrument;

/// Every effect of drives, one line each.
static REGISTRY: &[&dyn Driving] = &[
    &slip::Slip,
    &radius_mismatch::RadiusMismatch,
    &radius_scale::RadiusScale,
    &one_radius::RadiusLeft,
    &one_radius::RadiusRight,
    &rolling_resistance::RollingResistance,
    &lateral_skid::LateralSkid,
    &track_width::TrackWidth,
    &payload::Payload,
    &com_offset::ComOffset,
    &torque_gain::TorqueGain,
    &encoder_quantization::EncoderQuantization,
    &missed_ticks::MissedTicks,
    &scale_factor::ScaleFactor,
    &scale_asymmetry::ScaleAsymmetry,
    &vibration_rectification::VibrationRectification,
    &bias_step::BiasStep,
    &gyro_delay::GyroDelay,
    &wheel_delay::WheelDelay,
    &pose_delay::PoseDelay,
    &noise_level::GYRO,
    &noise_level::WHEELS,
    &noise_level::POSE,
    &slope::Slope,
];

/// Every effect of drives.
#[must_use]
pub fn registry() -> &'static [&'static dyn Driving] {
    REGISTRY
}

/// The effect `id`.
#[must_use]
pub fn by_id(id: &str) -> Option<&'static dyn Driving> {
    registry().iter().copied().find(|e| e.about().id == id)
}

/// The one of `effects` by which the readings of this instrument come late.
pub(crate) fn late(effects: &[&'static dyn Driving], of: Instrument) -> Option<&'static About> {
    effects.iter().find(|e| e.delays() == Some(of)).map(|e| e.about())
}

#[cfg(test)]
mod battery;
