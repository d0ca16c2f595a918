//! Gazebo's plugins and sensors of a robot, in URDF as in SDF.

use super::model::{Drive, Imu, Model};
use super::xml::{Xml, child, child_text, children};
use crate::error::Result;
use roxmltree::Node;

/// Elements that name wheels of each side, in Gazebo Classic (ROS 1 and ROS 2) and in Gazebo Sim.
const LEFT: [&str; 4] = ["left_joint", "leftJoint", "leftFrontJoint", "leftRearJoint"];
const RIGHT: [&str; 4] = ["right_joint", "rightJoint", "rightFrontJoint", "rightRearJoint"];

/// Adds to `model` what the plugins and the IMU of `node`, at any depth, say.
pub(super) fn read(xml: &Xml, node: Node, model: &mut Model) -> Result<()> {
    for plugin in node.descendants().filter(|n| n.has_tag_name("plugin")) {
        let called = [plugin.attribute("name"), plugin.attribute("filename")];
        let name = called.into_iter().flatten().next().unwrap_or("plugin").to_string();
        let words = called.into_iter().flatten().collect::<Vec<_>>().join(" ").to_lowercase();
        if ["mecanum", "ackermann", "tricycle", "omni"].iter().any(|other| words.contains(other)) {
            model.other_drive.get_or_insert(name);
            continue;
        }
        let joints = |names: [&str; 4]| -> Vec<String> {
            let named = plugin.children().filter(|c| names.contains(&c.tag_name().name()));
            let texts = named.filter_map(|c| c.text());
            texts.flat_map(|t| t.split([' ', ',', '\n', '\t'])).filter(|t| !t.is_empty()).map(String::from).collect()
        };
        let number = |names: [&str; 2]| -> Result<Option<f64>> {
            names.iter().find_map(|name| child(plugin, name)).map_or(Ok(None), |found| {
                let [value] = xml.numbers(found, found.text().unwrap_or_default())?;
                Ok((value > 0.0).then_some(value))
            })
        };
        let (left, right) = (joints(LEFT), joints(RIGHT));
        if left.is_empty() || right.is_empty() {
            continue;
        }
        let diameter = number(["wheel_diameter", "wheelDiameter"])?;
        model.drives.push(Drive {
            name,
            left,
            right,
            separation_m: number(["wheel_separation", "wheelSeparation"])?,
            radius_m: number(["wheel_radius", "wheelRadius"])?.or(diameter.map(|d| d / 2.0)),
        });
    }
    let imu = node.descendants().find(|n| n.has_tag_name("sensor") && n.attribute("type") == Some("imu"));
    if let (None, Some(sensor)) = (&model.imu, imu) {
        let about_z = ["imu", "angular_velocity", "z", "noise"].iter().try_fold(sensor, |at, name| child(at, name));
        let noise = about_z.map(|n| xml.text_scalar(n, "stddev")).transpose()?.flatten();
        model.imu = Some(Imu {
            name: sensor.attribute("name").unwrap_or("imu").to_string(),
            rate_hz: xml.text_scalar(sensor, "update_rate")?.filter(|hz| *hz > 0.0),
            noise_std_rad_s: noise.filter(|std| *std > 0.0),
        });
    }
    Ok(())
}

/// Joints that the tables of actuators of a URDF name: `<transmission>` and `<ros2_control>` with a command interface.
pub(super) fn driven<'a>(root: Node<'a, '_>) -> Vec<&'a str> {
    let of_transmissions = children(root, "transmission").flat_map(|t| children(t, "joint")).filter_map(|j| {
        // older files name the joint in the element's text
        j.attribute("name").or_else(|| j.text().map(str::trim))
    });
    let commanded = children(root, "ros2_control").flat_map(|c| children(c, "joint"));
    let commanded = commanded.filter(|j| child(*j, "command_interface").is_some()).filter_map(|j| j.attribute("name"));
    of_transmissions.chain(commanded).collect()
}

/// Whether a model is fixed to the world.
pub(super) fn is_static(model: Node) -> bool {
    matches!(child_text(model, "static"), Some("true" | "1"))
}
