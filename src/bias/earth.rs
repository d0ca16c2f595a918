//! y = ω sin φ: what a gyro at rest measures of the Earth about the vertical at latitude φ
//!
//! Upwards and counter-clockwise are positive, so that it is positive in the north. A robot on level ground keeps measuring
//! it wherever it drives and however it turns: a filter that counts the heading from the ground has to take it off together
//! with the bias. About an axis that lies down it depends on where the axis points, and is not told by the latitude.

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
                .mend("give degrees north of the equator, between -90 and 90"));
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
