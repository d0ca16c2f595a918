//! Noise levels of the instruments, and the residuals that tell them

use crate::effects::About;
use crate::gap::drive::ekf::noise::Channel;
use crate::model::drive::Instrument;
use std::ops::Range;

/// Least net gain of a level, nats.
pub(crate) const WORTH: f64 = 3.0;

/// An innovation: channel, row, ν/√S, √S (in the channel's unit).
pub(crate) type Residual = (Channel, usize, f64, f64);

/// Name of a channel, or of channels alike, and their indices.
pub(super) type Named = (&'static str, Range<usize>);

/// Channels of each instrument, and its name in texts.
pub(super) const CHANNELS: [(Instrument, &str, &[Named]); 3] = [
    (Instrument::Wheels, "the wheels", &[("wheel_left", 0..1), ("wheel_right", 1..2)]),
    (Instrument::Gyro, "the gyro", &[("gyro", 2..3)]),
    (Instrument::Pose, "the reference", &[("position", 3..5), ("heading", 5..6)]),
];

/// Noise level of an instrument, as a named effect.
#[derive(Clone)]
pub(crate) struct Level {
    /// The effect.
    pub(crate) about: &'static About,
    pub(super) instrument: Instrument,
    /// Number of its residuals.
    pub(super) count: usize,
    /// ln weight with it over that without it, nats.
    pub(crate) margin: f64,
    /// Cost of naming it, nats: uncertainty of one parameter, and prior odds.
    pub(super) cost: f64,
}

impl Level {
    /// Indices of its instrument's channels.
    pub(super) fn places(&self) -> Vec<usize> {
        let own = CHANNELS.iter().filter(|c| c.0 == self.instrument);
        own.flat_map(|c| c.2.iter().flat_map(|(_, places)| places.clone())).collect()
    }
}

/// Cost of one unknown parameter, nats: ½ ln n.
pub(crate) fn price(n: usize) -> f64 {
    0.5 * (n.max(1) as f64).ln()
}
