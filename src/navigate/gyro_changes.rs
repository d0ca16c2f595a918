//! The changes that effects make to the gyro's readings before the filter takes them in.

/// The gyro's readings and noise, and the delays, as effects change them.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct GyroChanges {
    /// Readings without the bias that is known, where there is any.
    pub readings: Option<Vec<f64>>,
    /// Noise variance of each row, rad²/s², where it is not the configuration's.
    pub variances: Vec<f64>,
    /// How late the readings are, s.
    pub delay_s: f64,
    /// How late those of the wheels are, s.
    pub wheel_delay_s: f64,
}
