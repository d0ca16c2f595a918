//! ORB-SLAM3 settings: IMU.NoiseGyro = N, IMU.GyroWalk = K, IMU.Frequency = f
//!
//! Continuous: `Tracking::newParameterLoader` (src/Tracking.cc) makes `Calib(Tbc, Ng √f, Na √f, Ngw/√f, Naw/√f)` of them
//! itself. A walk of K moves the bias by K √(1/f) from sample to sample, which is Ngw/√f.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "orb-slam3",
    program: "ORB-SLAM3, visual-inertial SLAM",
    file: "settings.yaml",
    keys: &[
        Key { name: "IMU.NoiseGyro", unit: "rad/s/sqrt(Hz), continuous", meaning: "angle random walk N" },
        Key { name: "IMU.GyroWalk", unit: "rad/s^2/sqrt(Hz), continuous", meaning: "rate random walk K" },
        Key { name: "IMU.Frequency", unit: "Hz", meaning: "rate of the IMU, with which ORB-SLAM3 scales both" },
    ],
    needs: "N; K from a log of hours; IMU.NoiseAcc and IMU.AccWalk from elsewhere; the lines go into your settings file",
    convention: "continuous densities; Tracking.cc multiplies N by sqrt(f) and divides K by sqrt(f) itself",
    source: "github.com/UZ-SLAMLab/ORB_SLAM3: src/Tracking.cc, src/Settings.cc, Calibration_Tutorial.pdf",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct OrbSlam3;

impl Target for OrbSlam3 {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn first_line(&self) -> Option<&'static str> {
        Some("%YAML:1.0")
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let rate = Known::exact(source.rate_hz()?);
        sheet.note(source.rate_text()?);
        sheet.put("IMU.NoiseGyro", source.angle_random_walk()?, Shape::Scalar, |v| format!("IMU.NoiseGyro: {v}"));
        let without = "ORB-SLAM3 stops without it";
        sheet.put_walk("IMU.GyroWalk", source.rate_random_walk(), Shape::Scalar, without, |v| {
            format!("IMU.GyroWalk: {v}")
        });
        sheet.put("IMU.Frequency", rate, Shape::Scalar, |v| format!("IMU.Frequency: {v}"));
        sheet.leave_out_accelerometer("IMU.NoiseAcc, IMU.AccWalk");
        Ok(())
    }
}
