//! LIO-SAM `params.yaml`: imuGyrNoise = N, imuGyrBiasN = K
//!
//! Continuous: src/imuPreintegration.cpp sets `gyroscopeCovariance` to imuGyrNoise² (GTSAM's continuous-time covariance) and
//! scales imuGyrBiasN by √Δt of the preintegrated interval, as a walk of K does.

use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

const KEYS: &[Key] = &[
    Key { name: "imuGyrNoise", unit: "rad/s/sqrt(Hz), continuous", meaning: "angle random walk N" },
    Key { name: "imuGyrBiasN", unit: "rad/s^2/sqrt(Hz), continuous", meaning: "rate random walk K" },
];
const NEEDS: &str =
    "N; K from a log of hours; imuAccNoise and imuAccBiasN from elsewhere; the lines go into your params.yaml";
const CONVENTION: &str =
    "continuous densities; imuPreintegration.cpp squares N for GTSAM and multiplies K by sqrt(dt) itself";
const SOURCE: &str = "github.com/TixiaoShan/LIO-SAM: src/imuPreintegration.cpp, config/params.yaml";

static ONE: About = about("lio-sam", "LIO-SAM for ROS 1, lidar-inertial odometry");
static TWO: About = about("lio-sam-ros2", "LIO-SAM for ROS 2, lidar-inertial odometry");

const fn about(id: &'static str, program: &'static str) -> About {
    About {
        id,
        program,
        file: "params.yaml",
        keys: KEYS,
        needs: NEEDS,
        convention: CONVENTION,
        source: SOURCE,
        warm_up: SUBTRACT,
        comment: Comment::Hash,
    }
}

/// The two branches nest the same keys differently.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ros {
    One,
    Two,
}

pub(super) struct LioSam {
    pub ros: Ros,
}

impl Target for LioSam {
    fn about(&self) -> &'static About {
        match self.ros {
            Ros::One => &ONE,
            Ros::Two => &TWO,
        }
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        match self.ros {
            Ros::One => {
                sheet.line("lio_sam:");
                sheet.indent("  ");
            }
            Ros::Two => {
                sheet.line("/**:");
                sheet.line("  ros__parameters:");
                sheet.indent("    ");
            }
        }
        sheet.put("imuGyrNoise", source.angle_random_walk()?, Shape::Scalar, |v| format!("imuGyrNoise: {v}"));
        let without = "LIO-SAM then keeps its default";
        sheet.put_walk("imuGyrBiasN", source.rate_random_walk(), Shape::Scalar, without, |v| {
            format!("imuGyrBiasN: {v}")
        });
        sheet.leave_out_accelerometer("imuAccNoise, imuAccBiasN");
        Ok(())
    }
}
