//! Kalibr `imu.yaml`: gyroscope_noise_density = N, gyroscope_random_walk = K
//!
//! Continuous: `ImuParameters.getGyroStatistics` (kalibr_common/ConfigReader.py) divides the density by √(1/update_rate)
//! itself and hands the random walk on as it is. It refuses either where it is missing or not above zero.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "kalibr",
    program: "Kalibr, calibration of cameras and IMUs",
    file: "imu.yaml",
    keys: &[
        Key { name: "gyroscope_noise_density", unit: "rad/s/sqrt(Hz), continuous", meaning: "angle random walk N" },
        Key {
            name: "gyroscope_random_walk",
            unit: "rad/s^2/sqrt(Hz), continuous",
            meaning: "rate random walk K (not the bias instability)",
        },
        Key { name: "update_rate", unit: "Hz", meaning: "rate of the IMU; Kalibr makes the density discrete with it" },
    ],
    needs: "N; K from a log of hours, which Kalibr does not do without; the accelerometer's four keys from elsewhere",
    convention: "continuous densities; Kalibr divides N by sqrt(1/update_rate) itself",
    source: "github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model; kalibr_common/ConfigReader.py",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct Kalibr;

impl Target for Kalibr {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        densities(source, sheet)
    }
}

/// The keys that Kalibr and those who took over its file share.
pub(super) fn densities(source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
    let topic = source.options.topic.as_deref().unwrap_or("/imu/data");
    sheet.put("gyroscope_noise_density", source.angle_random_walk()?, Shape::Scalar, |v| {
        format!("gyroscope_noise_density: {v}")
    });
    let without = "the program refuses a file without it";
    sheet.put_walk("gyroscope_random_walk", source.rate_random_walk(), Shape::Scalar, without, |v| {
        format!("gyroscope_random_walk: {v}")
    });
    sheet.leave_out_accelerometer("accelerometer_noise_density, accelerometer_random_walk");
    let stated = if source.options.topic.is_some() { "" } else { " (assumed; --topic names yours)" };
    sheet.comment(&format!("rostopic: topic of the IMU{stated}"));
    sheet.line(&format!("rostopic: \"{topic}\""));
    sheet.note(source.rate_text()?);
    sheet.put("update_rate", Known::exact(source.rate_hz()?), Shape::Scalar, |v| format!("update_rate: {v}"));
    Ok(())
}
