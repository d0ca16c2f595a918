//! Meaning of columns: names, units, scales, mappings by the user, and the mounting of a sensor.

pub(crate) mod channel_map;
pub(crate) mod channels;
pub(crate) mod gravity;
pub(crate) mod gyro;
pub(crate) mod mounted;
pub(crate) mod mounting;
pub(crate) mod names;
pub(crate) mod quantity;
pub(crate) mod rate_unit;
pub(crate) mod scale;
