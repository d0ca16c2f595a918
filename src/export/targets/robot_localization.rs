//! robot_localization: imu0_config takes the yaw rate alone; its variance N² f travels in the message
//!
//! `ekf_node` has no state for a gyro's bias and no parameter for its noise: it takes the variance of each rate from
//! `sensor_msgs/Imu.angular_velocity_covariance`. What a fit can say is which component to fuse, and with which
//! covariance and correction the messages are to be published.

use super::super::number::digits;
use super::super::sheet::{Shape, Sheet};
use super::super::source::Source;
use super::super::target::{SUBTRACT, Target};
use crate::error::{Error, ErrorKind, Result};
use crate::export::about::{About, Comment, Key};
use crate::ingest::Axis;

static ABOUT: About = About {
    id: "robot-localization",
    program: "robot_localization for ROS 2, ekf_node: how to fuse the corrected yaw rate",
    file: "ekf.yaml",
    keys: &[Key {
        name: "angular_velocity_covariance[8]",
        unit: "(rad/s)^2, discrete",
        meaning: "N^2 f: to be published in each message; the node takes it from there and has no parameter for it",
    }],
    needs: "N and the rate of the messages; whoever publishes the rates must subtract e(t), as the node cannot",
    convention: "discrete: the covariance of one message, N^2 f; f is the rate of the messages",
    source: "docs.ros.org: robot_localization, state estimation nodes and preparing sensor data; sensor_msgs/Imu",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct RobotLocalization;

impl Target for RobotLocalization {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        if source.axis().0 != Axis::Z {
            let found = "a yaw rate is fused, and the fitted axis is not the vertical one";
            return Err(Error::new(ErrorKind::Config, &source.origin.file, found)
                .at("axis")
                .hint("fit the yaw axis; if the IMU is mounted so that this axis is vertical, give --axis z"));
        }
        let rate = source.rate_hz()?;
        let variance = source.angle_random_walk()?.squared().times(rate);
        sheet.note(format!("{}, the rate of the messages", source.rate_text()?));
        sheet.note(
            "the node has no state for a gyro's bias: subtract e(t) before publishing, or the heading drifts by the bias \
             however small the covariance is",
        );
        if let Some(d) = &source.gyro.discrete {
            sheet.comment(&format!(
                "e[k+1] = {} e[k] + {}, e[0] = {} rad/s, every {} s from power-on ({})",
                digits(d.decay),
                digits(d.drive),
                digits(d.initial),
                d.sample_time_s,
                d.scheme
            ));
        }
        let topic = source.options.topic.as_deref().unwrap_or("/imu/data");
        sheet.line("ekf_filter_node:");
        sheet.line("  ros__parameters:");
        sheet.indent("    ");
        sheet.put("angular_velocity_covariance[8]", variance, Shape::Scalar, |v| {
            format!("# in each message of imu0: angular_velocity_covariance[8] = {v}")
        });
        sheet.comment("topic of the corrected rates");
        sheet.line(&format!("imu0: \"{topic}\""));
        sheet.comment("x y z, roll pitch yaw, their rates (the last of three is fused), accelerations");
        sheet.line("imu0_config: [false, false, false,");
        sheet.line("              false, false, false,");
        sheet.line("              false, false, false,");
        sheet.line("              false, false, true,");
        sheet.line("              false, false, false]");
        sheet.line("imu0_differential: false");
        Ok(())
    }
}
