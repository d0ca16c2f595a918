//! The instruments of a drive.

/// Instruments of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Instrument {
    /// The gyro.
    Gyro,
    /// Both encoders.
    Wheels,
    /// The external reference of position and heading.
    Pose,
}
