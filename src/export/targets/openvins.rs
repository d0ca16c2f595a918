//! OpenVINS `kalibr_imu_chain.yaml`: under `imu0:` gyroscope_noise_density = N, gyroscope_random_walk = K
//!
//! Continuous, as in Kalibr: `Propagator::predict_and_compute` (ov_msckf/src/state/Propagator.cpp) turns them into the noise
//! of a step itself, N² dt for the rotation and K² dt for the bias. The file is read by OpenCV's FileStorage, hence its first line.

use super::super::sheet::Sheet;
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use super::kalibr;
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "openvins",
    program: "OpenVINS, visual-inertial odometry",
    file: "kalibr_imu_chain.yaml",
    keys: &[
        Key { name: "gyroscope_noise_density", unit: "rad/s/sqrt(Hz), continuous", meaning: "angle random walk N" },
        Key {
            name: "gyroscope_random_walk",
            unit: "rad/s^2/sqrt(Hz), continuous",
            meaning: "rate random walk K (not the bias instability)",
        },
        Key { name: "update_rate", unit: "Hz", meaning: "rate of the IMU" },
    ],
    needs: "N; K from a log of hours, which OpenVINS does not do without; the accelerometer's keys and T_i_b from elsewhere",
    convention: "continuous densities; the propagator makes N^2 dt and K^2 dt of them, the noise of a step, itself",
    source: "docs.openvins.com/gs-calibration.html; ov_msckf/src/state/Propagator.cpp",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct OpenVins;

impl Target for OpenVins {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn first_line(&self) -> Option<&'static str> {
        Some("%YAML:1.0")
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        sheet.line("imu0:");
        sheet.indent("  ");
        kalibr::densities(source, sheet)?;
        let why = "a gyro at rest says nothing of the mounting and of the intrinsic calibration";
        sheet.leave_out(
            "T_i_b, time_offset, model, Tw, R_IMUtoGYRO, Ta, R_IMUtoACC, Tg",
            why,
            "take them from Kalibr's result or from OpenVINS' example of the same name",
        );
        Ok(())
    }
}
