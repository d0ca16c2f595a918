//! y = ω sin φ: the Earth's rotation as a gyro at rest measures it about the vertical at latitude φ
//!
//! Upwards and counter-clockwise are positive, so that it is positive in the north. A robot on level ground measures it
//! at rest and in motion, at any heading: a filter whose heading is relative to the ground has to subtract it together
//! with the bias. About a horizontal axis it depends on the axis's azimuth, and the latitude alone does not determine
//! it.

use crate::error::{Error, ErrorKind, Result};
use serde::Serialize;

/// ω: the Earth's rotation in inertial space (WGS 84), rad/s.
pub const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;

/// The Earth's part of the rate about the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EarthRate {
    /// Latitude, degrees, positive in the north.
    pub latitude_deg: f64,
    /// ω sin φ, rad/s, about the axis that points up.
    pub vertical_rad_s: f64,
}

impl EarthRate {
    /// At `latitude_deg`.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] for a latitude beyond a pole.
    pub fn at(latitude_deg: f64) -> Result<Self> {
        if !(latitude_deg.abs() <= 90.0) {
            return Err(Error::new(ErrorKind::Usage, "--latitude", format!("{latitude_deg} is no latitude"))
                .hint("give degrees north of the equator, between -90 and 90"));
        }
        Ok(Self { latitude_deg, vertical_rad_s: EARTH_RATE_RAD_S * latitude_deg.to_radians().sin() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertical_turns_with_the_sine_of_the_latitude() {
        assert_eq!(EarthRate::at(0.0).unwrap().vertical_rad_s, 0.0);
        let [north, south] = [30.0, -30.0].map(|deg| EarthRate::at(deg).unwrap().vertical_rad_s);
        assert!((north - 0.5 * EARTH_RATE_RAD_S).abs() < 1e-20 && north == -south);
        // once round in a sidereal day of 86 164.1 s
        let day_s = std::f64::consts::TAU / EarthRate::at(90.0).unwrap().vertical_rad_s;
        assert!((day_s - 86_164.1).abs() < 0.05, "{day_s}");
        for wrong in [90.1, -91.0, f64::NAN, f64::INFINITY] {
            assert_eq!(EarthRate::at(wrong).unwrap_err().kind, ErrorKind::Usage);
        }
    }
}
