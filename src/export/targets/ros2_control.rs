//! ros2_control: static_covariance_angular_velocity = N² f I; wheel_separation = 2 b, wheel_radius = r, and b, r_l, r_r over these
//!
//! Discrete, and squared: imu_sensor_broadcaster copies the nine numbers, row by row, into
//! `sensor_msgs/Imu.angular_velocity_covariance`, the covariance of one message in (rad/s)². Neither message nor
//! broadcaster has a bias. Where the configuration has `[vehicle]`, diff_drive_controller's geometry is written too.

use super::super::number::Known;
use super::super::sheet::{Shape, Sheet};
use super::super::source::{Geometry, Source};
use super::super::target::{SUBTRACT, Target};
use crate::error::Result;
use crate::export::about::{About, Comment, Key};

static ABOUT: About = About {
    id: "ros2-control",
    program: "ros2_control: imu_sensor_broadcaster, and diff_drive_controller where the configuration has a robot",
    file: "controllers.yaml",
    keys: &[
        Key {
            name: "static_covariance_angular_velocity",
            unit: "(rad/s)^2, discrete, 3 x 3 by rows",
            meaning: "N^2 f: variance of a message's rate",
        },
        Key { name: "wheel_separation", unit: "m", meaning: "twice [vehicle] half_track_m" },
        Key { name: "wheel_radius", unit: "m", meaning: "[vehicle] wheel_radius_m" },
        Key { name: "wheel_separation_multiplier", unit: "", meaning: "half track with [[effect]]s, over [vehicle]" },
        Key { name: "left_wheel_radius_multiplier", unit: "", meaning: "left radius with [[effect]]s, over [vehicle]" },
        Key {
            name: "right_wheel_radius_multiplier",
            unit: "",
            meaning: "right radius with [[effect]]s, over [vehicle]",
        },
    ],
    needs: "N and the rate at which messages are published; [vehicle] for the wheels; the other parameters from you",
    convention: "discrete: the covariance of one message, N^2 f; f is the rate of the messages",
    source: "control.ros.org: imu_sensor_broadcaster, diff_drive_controller; sensor_msgs/Imu",
    warm_up: SUBTRACT,
    comment: Comment::Hash,
};

pub(super) struct Ros2Control;

impl Target for Ros2Control {
    fn about(&self) -> &'static About {
        &ABOUT
    }

    fn fill(&self, source: &Source<'_>, sheet: &mut Sheet) -> Result<()> {
        let rate = source.rate_hz()?;
        let variance = source.angle_random_walk()?.squared().times(rate);
        sheet.note(format!(
            "{}, of messages that hold the mean since the last one; whoever thins out without averaging gives the gyro's \
             own rate",
            source.rate_text()?
        ));
        sheet.note("there is no state for a bias: publish rates from which e(t) is subtracted");
        sheet.line("imu_sensor_broadcaster:");
        sheet.line("  ros__parameters:");
        sheet.indent("    ");
        sheet.put("static_covariance_angular_velocity", variance, Shape::Diagonal, |v| {
            format!("static_covariance_angular_velocity: [{v}]")
        });
        let hint = "name the sensor of your ros2_control description";
        sheet.leave_out("sensor_name, frame_id", "a log does not name them", hint);
        sheet.indent("");
        if let Some(vehicle) = &source.config.vehicle {
            sheet.line("diff_drive_controller:");
            sheet.line("  ros__parameters:");
            sheet.indent("    ");
            let separation = Known::exact(2.0 * vehicle.half_track_m);
            sheet.put("wheel_separation", separation, Shape::Scalar, |v| format!("wheel_separation: {v}"));
            let radius = Known::exact(vehicle.wheel_radius_m);
            sheet.put("wheel_radius", radius, Shape::Scalar, |v| format!("wheel_radius: {v}"));
            if let Some(Geometry { track, radii: [left, right], effects }) =
                source.geometry()?.filter(|g| !g.effects.is_empty())
            {
                sheet.note(format!(
                    "multipliers of [[effect]] {}: how this robot differs from [vehicle]",
                    effects.join(", ")
                ));
                for (key, factor) in [
                    ("wheel_separation_multiplier", track),
                    ("left_wheel_radius_multiplier", left),
                    ("right_wheel_radius_multiplier", right),
                ] {
                    sheet.put(key, Known::exact(factor), Shape::Scalar, |v| format!("{key}: {v}"));
                }
            }
        } else {
            let hint = "fit with --base ROBOT.toml, which brings [vehicle]";
            sheet.leave_out("wheel_separation, wheel_radius", "the configuration has no [vehicle]", hint);
        }
        Ok(())
    }
}
