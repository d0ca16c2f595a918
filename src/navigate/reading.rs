//! innovation = reading - expected reading,  NIS = innovation²/variance

use crate::config::Encoder;

/// A sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sensor {
    /// Yaw rate, rad/s.
    Gyro,
    /// Left encoder, rad/s.
    WheelLeft,
    /// Right encoder, rad/s.
    WheelRight,
    /// Speed as the mean of both wheels, m/s: the reading of a car's odometry.
    Speed,
    /// Reference position, m.
    PoseX,
    /// Reference position, m.
    PoseY,
    /// Reference heading, rad.
    PoseHeading,
}

impl Sensor {
    /// All sensors, in the order in which a row's readings are taken in.
    pub const ALL: [Self; 7] =
        [Self::Gyro, Self::WheelLeft, Self::WheelRight, Self::Speed, Self::PoseX, Self::PoseY, Self::PoseHeading];
}

/// Those that read the wheels, and may count ticks.
pub(super) const WHEELS: [Sensor; 3] = [Sensor::WheelLeft, Sensor::WheelRight, Sensor::Speed];

/// Innovation of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Reading minus expectation, in the sensor's unit.
    pub residual: f64,
    /// Its variance.
    pub variance: f64,
    /// Whether it passed the gate and was used.
    pub used: bool,
}

impl Innovation {
    /// Normalised innovation squared: chi-squared with one degree of freedom if the model holds.
    #[must_use]
    pub fn nis(&self) -> f64 {
        self.residual * self.residual / self.variance
    }

    /// The residual in standard deviations.
    #[must_use]
    pub fn standardised(&self) -> f64 {
        self.residual / self.variance.sqrt()
    }
}

/// Variance of a reading of `sensor`, one of [`WHEELS`], over `interval_s`.
pub(super) fn wheel_variance(encoder: &Encoder, wheel_radius_m: f64, sensor: Sensor, interval_s: f64) -> f64 {
    let wheel = encoder.speed_variance_rad2_s2(interval_s);
    match sensor {
        // the mean of two wheels
        Sensor::Speed => 0.5 * wheel_radius_m * wheel_radius_m * wheel,
        _ => wheel,
    }
}
