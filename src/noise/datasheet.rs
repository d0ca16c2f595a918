//! Manufacturers' figures for a few common gyros: typical values, in the datasheet's own units.
//!
//! An in-run bias stability is the lowest point of the Allan deviation, which flicker noise has at √(2 ln 2/π) B = 0.664 B.

use super::TermKind;
use crate::error::{Error, ErrorKind, Result};
use crate::units::{RAD_S_PER_DEG_H, RAD_S_PER_DEG_S, RAD_SQRT_S_PER_DEG_SQRT_H};
use serde::Serialize;

/// How a datasheet states its white noise.
#[derive(Debug, Clone, Copy, PartialEq)]
enum White {
    /// Rate noise density, °/s/√Hz.
    Density(f64),
    /// Angle random walk, °/√h.
    Walk(f64),
}

/// A gyro's entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datasheet {
    /// Name of the part.
    pub name: &'static str,
    white: White,
    /// In-run bias stability, °/h.
    stability_deg_h: Option<f64>,
    /// Document and the circumstances under which the values hold.
    pub source: &'static str,
}

/// One number of a datasheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Stated {
    /// The term that it belongs to.
    pub id: TermKind,
    /// Name in the datasheet.
    pub name: &'static str,
    /// In the datasheet's unit.
    pub value: f64,
    /// The datasheet's unit.
    pub unit: &'static str,
    /// The term's size in SI.
    pub size_si: f64,
}

const fn part(name: &'static str, white: White, stability_deg_h: Option<f64>, source: &'static str) -> Datasheet {
    Datasheet { name, white, stability_deg_h, source }
}

/// The table, by name.
pub(crate) const DATASHEETS: [Datasheet; 15] = [
    part(
        "ADIS16405",
        White::Density(0.05),
        Some(25.2),
        "Analog Devices ADIS16400/ADIS16405; in-run stability stated as 0.007 °/s",
    ),
    part("ADXRS150", White::Density(0.05), None, "Analog Devices ADXRS150, rate noise density at 25 °C"),
    part("BMI055", White::Density(0.014), None, "Bosch BST-BMI055-DS000, gyroscope BMG160"),
    part("BMI088", White::Density(0.014), None, "Bosch BST-BMI088-DS001, output noise density"),
    part("BMI160", White::Density(0.008), None, "Bosch BST-BMI160-DS000, at 10 Hz"),
    part("BMI270", White::Density(0.007), None, "Bosch BST-BMI270-DS000, performance mode"),
    part("ICM-20602", White::Density(0.004), None, "InvenSense DS-000176, rate noise spectral density at 10 Hz"),
    part("ICM-20948", White::Density(0.015), None, "InvenSense DS-000189, noise spectral density"),
    part("ICM-42688-P", White::Density(0.0028), None, "InvenSense DS-000347, rate noise spectral density at 10 Hz"),
    part("LSM6DSO", White::Density(0.0038), None, "STMicroelectronics DS12140, high-performance mode"),
    part("LSM6DSV16X", White::Density(0.0028), None, "STMicroelectronics DS13510, high-performance mode"),
    part("MPU-6050", White::Density(0.005), None, "InvenSense PS-MPU-6000A-00 rev. 3.4, 6.1: at 10 Hz, ±250 °/s"),
    part("MTi-1", White::Density(0.007), Some(10.0), "Xsens MTi 1-series datasheet, gyroscope specifications"),
    part("MTi-300", White::Density(0.01), Some(10.0), "Movella MTi-300 leaflet, May 2023"),
    part(
        "STIM300",
        White::Walk(0.15),
        Some(0.5),
        "Sensonor TS1524, STIM300 datasheet; the walk is read at 1 s, the stability at the minimum",
    ),
];

fn key(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase()
}

impl Datasheet {
    /// The entry called `name`; case, blanks and hyphens do not matter.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] that lists what is there.
    pub fn find(name: &str) -> Result<Self> {
        DATASHEETS.into_iter().find(|d| key(d.name) == key(name)).ok_or_else(|| {
            let all: Vec<_> = DATASHEETS.iter().map(|d| d.name).collect();
            Error::new(ErrorKind::Usage, "--datasheet", format!("no gyro {name:?} in the table"))
                .hint(format!("there are {}", all.join(", ")))
        })
    }

    /// Its figures, in its own units and in SI.
    #[must_use]
    pub(crate) fn stated(&self) -> Vec<Stated> {
        let white = match self.white {
            White::Density(value) => ("rate noise density", value, "°/s/√Hz", value * RAD_S_PER_DEG_S),
            White::Walk(value) => ("angle random walk", value, "°/√h", value * RAD_SQRT_S_PER_DEG_SQRT_H),
        };
        let one = |id, (name, value, unit, size_si)| Stated { id, name, value, unit, size_si };
        let flicker = TermKind::BiasInstability.allan_variance(1.0, 0.0).sqrt();
        let stability = self.stability_deg_h.map(|v| {
            one(TermKind::BiasInstability, ("in-run bias stability", v, "°/h", v * RAD_S_PER_DEG_H / flicker))
        });
        std::iter::once(one(TermKind::AngleRandomWalk, white)).chain(stability).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_as_people_write_them() {
        assert_eq!(Datasheet::find("mpu6050").unwrap().name, "MPU-6050");
        assert_eq!(Datasheet::find("stim 300").unwrap().stated().len(), 2);
        let error = Datasheet::find("HG1700").unwrap_err().to_string();
        assert!(error.contains("STIM300") && error.contains("HG1700"), "{error}");
        let mut names: Vec<_> = DATASHEETS.iter().map(|d| key(d.name)).collect();
        names.dedup();
        assert_eq!(names.len(), DATASHEETS.len());
        assert!(DATASHEETS.iter().all(|d| d.source.len() > 10));
    }

    #[test]
    fn the_lowest_point_of_the_deviation_is_what_is_stated() {
        let stated = Datasheet::find("MTi-1").unwrap().stated();
        let lowest = stated[1].size_si * TermKind::BiasInstability.allan_variance(5.0, 0.0).sqrt();
        assert!((lowest / RAD_S_PER_DEG_H - 10.0).abs() < 1e-9);
    }
}
